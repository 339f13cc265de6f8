"""Cameras of pictures: the job's own, one placed by hand, and orbits around the scene."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.errors import QueryError
from queries.regions.description import LARGEST, Length, Number, Part, Position

if TYPE_CHECKING:
    from queries.regions.scene import SceneGeometry
    from queries.run import Run

F64 = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
JOB_CAMERA = "job"
DEFAULT_ANGLE = 40.0  # degrees
MOST_FRAMES = 3600
_MARGIN = 1.04  # how much larger than the scene a picture is that shows all of it
_PARALLEL = 1e-6  # sine of the angle between the view and `up` below which up is no direction
Angle = Annotated[Number, Field(gt=0, lt=180)]


class Place(Part):
    """A camera at a point."""

    position: Position = Field(description="Where the camera is, world units.")
    target: Position = Field(description="What it looks at, world units.")
    up: Position | None = Field(default=None, description="What is up in the picture: a direction. Default: the axis nearest to the job camera's up.")
    angle: Angle = Field(default=DEFAULT_ANGLE, description="The vertical angle of view, degrees.")

    @model_validator(mode="after")
    def _some_view(self) -> "Place":
        view = np.subtract(self.target, self.position)
        if np.abs(view).max() < 1 / LARGEST:
            raise ValueError("expected a `target` that is not the `position`")
        if self.up is not None and _sine(view, np.array(self.up)) < _PARALLEL:
            raise ValueError("expected an `up` that is not (0, 0, 0) and does not point along the view")
        return self


class Orbit(Part):
    """A camera on a circle around the scene."""

    azimuth: Number = Field(default=30.0, description="Angle around the up axis, degrees: 0 on the job camera's side, growing to its right.")
    elevation: Annotated[Number, Field(ge=-90, le=90)] = Field(default=20.0, description="Angle above the horizon, degrees.")
    distance: Length | None = Field(
        default=None, description="From the target, in diagonals of the scene's bounds. Default: as near as shows the whole scene."
    )
    target: Position | None = Field(default=None, description="What the camera looks at, world units. Default: the center of the scene's bounds.")
    frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = Field(default=1, description="How many pictures: evenly, once around. 1: a still picture.")
    angle: Angle = Field(default=DEFAULT_ANGLE, description="The vertical angle of view, degrees.")


class CameraDescription(Part):
    """A camera of pictures: exactly one of these keys."""

    place: Place | None = Field(default=None, description="A camera at a point: `position`, `target`, `up`, `angle`.")
    orbit: Orbit | None = Field(default=None, description="Around the scene: `azimuth`, `elevation`, `distance`, `target`, `frames`, `angle`.")

    @model_validator(mode="after")
    def _one_way(self) -> "CameraDescription":
        if (self.place is None) == (self.orbit is None):
            raise ValueError(f"expected exactly one of `place` and `orbit`, found {'none' if self.place is None else 'both'}")
        return self


@dataclass(frozen=True)
class Pose:
    """A camera for one picture.

    ``position``, ``target``: world units; ``up``: a direction; ``angle``: vertical angle of view, degrees; ``aspect``: width over height of the film
    that the angle belongs to (none: the picture's own); ``shift``: the principal point's offset as shares of that film, to the right and down, as
    Mitsuba has it; ``mirrored``: whether left and right are exchanged.
    """

    name: str
    position: Vector
    target: Vector
    up: Vector
    angle: float
    aspect: float | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    mirrored: bool = False

    @property
    def axes(self) -> F64:
        """Unit directions (3, 3) of the picture in the world: to the right, up, and where the camera looks."""
        forward = _unit(np.subtract(self.target, self.position))
        right = _unit(np.cross(forward, self.up))
        return np.stack([-right if self.mirrored else right, np.cross(right, forward), forward])

    def tangents(self, size: tuple[int, int]) -> tuple[float, float]:
        """Tangents of half the angles of view, horizontal and vertical, of a picture of this size: the film's field lies inside."""
        tangent, aspect = math.tan(math.radians(self.angle) / 2), size[0] / size[1]
        vertical = tangent * max(1.0, (self.aspect or aspect) / aspect)
        return vertical * aspect, vertical

    def center(self, size: tuple[int, int]) -> tuple[float, float]:
        """Where the axis of view leaves the middle of a picture, to the right and up, in halves of its sides: the principal point, negated."""
        x, y = self.tangents(size)
        tangent = math.tan(math.radians(self.angle) / 2)
        return 2 * self.shift[0] * tangent * (self.aspect or x / y) / x, -2 * self.shift[1] * tangent / y

    def project(self, points: npt.NDArray[np.floating[Any]], size: tuple[int, int]) -> tuple[F64, F64]:
        """Where points (n, 3) are seen in a picture of this size: pixels (n, 2) from its upper left corner; and distances (n,) along the axis."""
        right, up, depth = self.axes @ (np.asarray(points, np.float64) - self.position).T
        x, y = self.tangents(size)
        at_x, at_y = self.center(size)
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = np.stack([size[0] * (1 + right / (depth * x) - at_x) / 2, size[1] * (1 - up / (depth * y) + at_y) / 2], axis=1)
        return pixels, depth


def job_pose(run: "Run") -> Pose:
    """The job's camera: its perspective exactly, as a picture of the film's shape has it. Raises ``QueryError`` for a run that does not say."""
    camera = run.geometry.camera
    to_world = np.linalg.inv(camera.to_camera[:, :3])
    left, up, forward = to_world.T
    tan_x, tan_y, shift_x, shift_y = (float(value) for value in camera.film[:4])
    position = camera.origin
    return Pose(
        JOB_CAMERA,
        _vector(position),
        _vector(position + _unit(forward) * max(run.geometry.extent / 2, 1 / LARGEST)),
        _vector(_unit(up)),
        2 * math.degrees(math.atan(tan_y)),
        tan_x / tan_y,
        (shift_x, shift_y),
        bool(np.dot(np.cross(left, up), forward) < 0),
    )


def poses(
    run: "Run", camera: "str | CameraDescription | None", named: Mapping[str, "CameraDescription"], geometry: "SceneGeometry | None" = None
) -> list[Pose]:
    """The poses of a view: one, or as many as its orbit has frames.

    ``camera``: ``job`` or none, a key of ``named``, or a description. Raises ``QueryError``.
    """
    if camera is None or (camera == JOB_CAMERA and JOB_CAMERA not in named):
        return [job_pose(run)]
    name = camera if isinstance(camera, str) else "camera"
    if isinstance(camera, str):
        if camera not in named:
            known = [JOB_CAMERA, *named]
            near = difflib.get_close_matches(camera, known, n=1)
            hint = f"did you mean `{near[0]}`?" if near else f"expected {', '.join(f'`{known_name}`' for known_name in known)}"
            raise QueryError(f"there is no camera `{camera}`: {hint}")
        camera = named[camera]
    geometry = geometry or run.geometry
    if camera.place is not None:
        return [_placed(name, camera.place, run)]
    assert camera.orbit is not None
    return _orbit(name, camera.orbit, run, geometry)


def _placed(name: str, place: Place, run: "Run") -> Pose:
    up, view = place.up, np.subtract(place.target, place.position)
    if up is None:
        axes = _horizon(run)
        # Straight up or down, what lies ahead of the job's camera is up
        up = _vector(axes[0] if _sine(view, axes[0]) >= _PARALLEL else axes[2])
    return Pose(name, place.position, place.target, up, place.angle)


def _orbit(name: str, orbit: Orbit, run: "Run", geometry: "SceneGeometry") -> list[Pose]:
    """All poses keep the same distance, so that the scene turns and does not pulsate."""
    low, high = geometry.caster.bounds
    target = np.array(orbit.target) if orbit.target is not None else (low + high) / 2
    up, right, ahead = _horizon(run)
    elevation, frames = math.radians(orbit.elevation), []
    for i in range(orbit.frames):
        azimuth = math.radians(orbit.azimuth + 360 * i / orbit.frames)
        outward = math.sin(azimuth) * right - math.cos(azimuth) * ahead
        # The derivative by elevation is up in the picture, also straight above the target
        frames.append((math.cos(elevation) * outward + math.sin(elevation) * up, math.cos(elevation) * up - math.sin(elevation) * outward))
    if orbit.distance is not None:
        distance = orbit.distance * float(np.linalg.norm(high - low))
    else:
        distance = max(_fitting(toward, above, target, low, high, orbit.angle) for toward, above in frames)
    width = len(str(orbit.frames - 1))
    names = [name] if orbit.frames == 1 else [f"{name} {i:0{width}d}" for i in range(orbit.frames)]
    return [
        Pose(called, _vector(target + distance * toward), _vector(target), _vector(above), orbit.angle)
        for called, (toward, above) in zip(names, frames)
    ]


def _fitting(toward: F64, above: F64, target: F64, low: F64, high: F64, angle: float) -> float:
    """The least distance from the target from which a square picture holds the box between two corners."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]) - target
    beside = np.maximum(np.abs(corners @ above), np.abs(corners @ np.cross(above, toward)))
    needed = (corners @ toward + _MARGIN * beside / math.tan(math.radians(angle) / 2)).max()
    return float(max(needed, 1e-6 * max(1.0, float(np.abs(high - low).max()))))


def _horizon(run: "Run") -> tuple[F64, F64, F64]:
    """The axis nearest to the job camera's up, and across it what is to the camera's right and ahead; y is up in a run without a camera."""
    try:
        _, camera_up, ahead = job_pose(run).axes
    except QueryError:
        camera_up, ahead = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    axis = int(np.argmax(np.abs(camera_up)))
    up = np.zeros(3)
    up[axis] = math.copysign(1.0, camera_up[axis])
    # A camera that looks along the axis has its own up ahead of it
    level = ahead - (ahead @ up) * up
    if np.linalg.norm(level) < _PARALLEL:
        level = camera_up - (camera_up @ up) * up
    ahead = _unit(level)
    return up, np.cross(ahead, up), ahead


def _unit(vector: npt.NDArray[Any]) -> F64:
    found: F64 = np.asarray(vector, np.float64) / np.linalg.norm(vector)
    return found


def _vector(values: npt.NDArray[Any]) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _sine(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> float:
    """The sine of the angle between two vectors; 0 where one is nothing."""
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.linalg.norm(np.cross(a, b))) / lengths if lengths > 0 else 0.0
