"""Regions: parts of space and of surfaces that expressions and rankings speak of."""

from queries.regions.base import Region
from queries.regions.description import RegionDescription, RegionName, parse_region, region
from queries.regions.film import Polygon, Stroke
from queries.regions.grown import Grown, Union
from queries.regions.objects import Inside, Surface, Surroundings
from queries.regions.scene import SceneGeometry
from queries.regions.solids import Box, Mesh, Sphere

__all__ = [
    "Box",
    "Grown",
    "Inside",
    "Mesh",
    "Polygon",
    "Region",
    "RegionDescription",
    "RegionName",
    "SceneGeometry",
    "Sphere",
    "Stroke",
    "Surface",
    "Surroundings",
    "Union",
    "parse_region",
    "region",
]
