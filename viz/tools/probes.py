"""Probes as a job describes them, and the rings that mark them in a picture."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.regions.description import LARGEST, Length, Part, Position
from viz.glyphs import Mesh, joined, ring

if TYPE_CHECKING:
    from queries.probes import Probe
    from queries.run import Run

RADIUS = 0.02  # of a probe, in diagonals of the scene's bounds, unless it says otherwise
MOST_PROBES = 64
_RING = 0.0016  # radius of a marker's tube, in diagonals of the scene's bounds
_THICKEST = 0.12  # likewise, in radii of the probe
_AXES = np.eye(3)


class ProbeSection(Part):
    """Where light is measured: a sphere in free space, or a disk on a surface."""

    position: Position = Field(description="Its center, world units.")
    radius: Length | None = Field(default=None, description="Its radius, world units. Default: 2 % of the diagonal of the scene's bounds.")
    normal: Position | None = Field(
        default=None,
        description="A disk's normal, of any length but 0: light from that side is measured. Default: a sphere, and light from all sides.",
    )

    @model_validator(mode="after")
    def _some_normal(self) -> "ProbeSection":
        if self.normal is not None and max(map(abs, self.normal)) < 1 / LARGEST:
            raise ValueError("expected a `normal` that is not (0, 0, 0): leave it out for a probe in free space")
        return self


def probes_of(run: "Run", sections: Sequence[ProbeSection]) -> "list[Probe]":
    """The probes that a job describes. Raises ``QueryError`` for a run that does not store its surfaces where a radius is left out."""
    from queries.probes import Probe

    return [Probe(section.position, section.radius or RADIUS * diagonal(run), section.normal) for section in sections]


def diagonal(run: "Run") -> float:
    """The diagonal of the bounds of the scene's surfaces, world units. Raises ``QueryError`` for a run that does not store them."""
    low, high = run.geometry.caster.bounds
    return float(np.linalg.norm(high - low)) or run.geometry.extent


def marker(probe: "Probe", size: float) -> Mesh:
    """A disk's ring, or a sphere's three, in a scene of this diagonal."""
    thickness = min(_RING * size, _THICKEST * probe.radius)
    axes: npt.NDArray[np.float64] = _AXES if probe.normal is None else np.array([probe.normal], np.float64)
    return joined([ring(np.array(probe.position), axis, probe.radius, thickness) for axis in axes])


def places(probes: "Sequence[Probe]") -> str:
    """Probes in words: "the sphere of radius 0.1 around (0, 1, 0)", or how many they are."""
    if len(probes) != 1:
        return f"{len(probes)} probes"
    where = ", ".join(f"{value:.4g}" for value in probes[0].position)
    return f"the {'sphere' if probes[0].normal is None else 'disk'} of radius {probes[0].radius:.3g} around ({where})"
