"""The contract of an emitter.

Each kind has ``sample_direction`` / ``pdf_direction`` (light that reaches a point, for camera walks), ``eval`` (emitted
radiance where a ray meets it) and ``sample_emission`` (a ray of light that leaves it, for light walks).
One emitter is chosen uniformly; its probability is inside every density.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.math.vec import BLACK, ZERO, Vec3

# Kinds. Area emitters are told apart by how their shape is sampled.
AREA_RECTANGLE, AREA_MESH, AREA_SPHERE, AREA_DISK, AREA_CYLINDER, POINT, SPOT, DIRECTIONAL, CONSTANT, ENVMAP = range(10)

# Columns of Emitters.frame where the kind is AREA_RECTANGLE: corner, two edges, unit normal (12 numbers).
# Other kinds: the rows of a 3 x 4 to_world matrix (point: its last column is the position; directional, spot: third
# column is the unit direction of travel).
# Columns of Emitters.scalar. A spot's angles are kept as 1 - cos, which float32 holds for the narrowest cones too.
AREA, CUTOFF, BEAM = range(3)
# Columns of Emitters.primitive
PRIMITIVE_FIRST, PRIMITIVE_COUNT, CDF_FIRST = range(3)


class Environment(NamedTuple):
    """An environment map with the tables to sample it, made by ``renderer.emitters.envmap.build_environment``.

    Pixels are nodes between which radiance is interpolated; the tables are over the cells that four nodes make.
    """

    pixels: npt.NDArray[np.float32]  # (height, width, 3) radiance, which Emitters.rgb multiplies
    row_cdf: npt.NDArray[np.float32]  # (height,) over the height - 1 rows of cells
    column_cdf: npt.NDArray[np.float32]  # (height - 1, width + 1)
    to_world: npt.NDArray[np.float32]  # (3, 3) rotation


class Emitters(NamedTuple):
    """One row for each emitter; ``ne`` rows (a scene has at least one)."""

    kind: npt.NDArray[np.int32]  # (ne,)
    object: npt.NDArray[np.int32]  # (ne,) -1 where there is no shape
    rgb: npt.NDArray[np.float32]  # (ne, 3) radiance, intensity, irradiance or (envmap) the scale of its pixels
    texture: npt.NDArray[np.int32]  # (ne,) of the radiance, -1: constant
    frame: npt.NDArray[np.float32]  # (ne, 12)
    scalar: npt.NDArray[np.float32]  # (ne, 3)
    primitive: npt.NDArray[np.int32]  # (ne, 3) first primitive and count of an area emitter's shape, where its cdf starts
    cdf: npt.NDArray[np.float32] | None  # all area meshes' cumulative areas, normalized, each with its leading 0
    bounds: npt.NDArray[np.float32]  # (4,) center and radius of the sphere around the scene
    infinite: Any  # int32, row of the constant or envmap emitter, -1: none
    curved: bool | None  # True: some area emitter is a mesh or a quadric
    delta: bool | None  # True: some emitter is a point, spot or directional light
    sky: bool | None  # True: there is a constant or envmap emitter
    environment: Environment | None


class DirectionSample(NamedTuple):
    """Light toward a point. ``pdf`` is zero for delta emitters, and nothing arrives where ``weight`` is black."""

    emitter: Any  # int32
    d: Vec3  # unit direction from the point to the light
    endpoint: Vec3  # on the light, pushed off its surface by the error bound; the direction d for infinite emitters
    distance: Any  # float32, to the endpoint; infinite emitters: 1e30
    weight: Vec3  # emitted radiance over density, per steradian (delta: intensity over squared distance)
    pdf: Any  # float32, per steradian, with the probability of choosing the emitter


NO_DIRECTION = DirectionSample(np.int32(-1), BLACK, BLACK, ZERO, BLACK, ZERO)


class EmissionSample(NamedTuple):
    """A ray of light that leaves an emitter: where a light walk starts. The choice of the emitter is in its weights."""

    emitter: Any  # int32
    point: Vec3  # on the emitter, pushed off its surface (infinite: on a disk outside the scene)
    normal: Vec3  # of the surface; zero where the emitter has none
    d: Vec3  # unit direction of travel
    radiance: Vec3  # Le over the positional density (area: per squared unit; delta position: intensity), so that a
    # connection to the lens multiplies it by the emitter's cosine (area) or falloff (spot); black where the emitter is
    # infinite or directional: no connection can find its ray. ``dispatch.emission_toward`` does this
    weight: Vec3  # power carried: Le cos / (positional density * directional density)
