"""A region as a job describes it: a strict schema, and what it means."""

import difflib
import math
import pathlib
import re
import reprlib
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from queries.errors import QueryError
from queries.regions.base import Region
from queries.regions.film import Polygon, Stroke
from queries.regions.objects import Inside, Surface
from queries.regions.solids import Box, Mesh, Sphere
from queries.regions.text import read_yaml

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
LARGEST = 1e18  # world units or pixels: squares of it are far from overflow in float32 and float64
_MOST_COMPLAINTS = 5
_MOST_SHOWN = 80
_SHORT = reprlib.Repr()


def _in_range(value: float) -> float:
    if not abs(value) <= LARGEST:
        raise ValueError(f"expected a number of at most {LARGEST:g}")
    return value


def _positive(value: float) -> float:
    if not 1 / LARGEST <= value <= LARGEST:
        raise ValueError(f"expected a number above 0, of at most {LARGEST:g}")
    return value


RegionName = Annotated[str, Field(min_length=1, max_length=100, pattern=NAME_PATTERN)]
Number = Annotated[float, AfterValidator(_in_range)]
Length = Annotated[float, AfterValidator(_positive)]
Position = Annotated[tuple[Number, Number, Number], Field(strict=False)]
Sizes = Annotated[tuple[Length, Length, Length], Field(strict=False)]
Pixel = Annotated[tuple[Number, Number], Field(strict=False)]


class Part(BaseModel):
    """A part of a description: unknown keys are errors, and no value is converted silently."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class SphereDescription(Part):
    """All points within a distance of a center."""

    center: Position = Field(description="The center, world units.")
    radius: Length = Field(description="The radius, world units.")


class Rotation(Part):
    """A rotation about an axis, counterclockwise as seen from the axis's tip."""

    axis: Position = Field(description="The axis: a direction of any length but 0.")
    angle: Number = Field(description="The angle, degrees.")

    @model_validator(mode="after")
    def _some_axis(self) -> "Rotation":
        if max(map(abs, self.axis)) < 1 / LARGEST:
            raise ValueError("expected an `axis` that is not (0, 0, 0)")
        return self


class BoxDescription(Part):
    """A box: either `min` and `max`, with sides along the axes, or `center` and `size`, in any orientation."""

    min: Position | None = Field(default=None, description="The corner of least coordinates, world units.")
    max: Position | None = Field(default=None, description="The corner of largest coordinates, world units: each above that of `min`.")
    center: Position | None = Field(default=None, description="The center, world units.")
    size: Sizes | None = Field(default=None, description="Lengths of the sides before rotation, along x, y and z, world units.")
    rotate: Rotation | None = Field(default=None, description="Turns the box about its center.")

    @model_validator(mode="after")
    def _one_way(self) -> "BoxDescription":
        given = {name for name in ("min", "max", "center", "size", "rotate") if getattr(self, name) is not None}
        if given != {"min", "max"} and given - {"rotate"} != {"center", "size"}:
            found = f"`{'`, `'.join(sorted(given))}`" if given else "neither"
            raise ValueError(f"expected `min` and `max`, or `center` and `size` (and perhaps `rotate`), found {found}")
        if self.min is not None and self.max is not None and not all(low < high for low, high in zip(self.min, self.max)):
            raise ValueError("expected each coordinate of `max` above that of `min`")
        return self


class ObjectDescription(Part):
    """An object of the scene."""

    name: str = Field(min_length=1, max_length=1000, description="The object's name, as in the catalogue `objects`.")
    part: Literal["surface", "inside"] = Field(
        default="surface", description="`surface`: vertices on the object. `inside`: points enclosed by it, for closed meshes and spheres, or on it."
    )


class MeshDescription(Part):
    """What a closed mesh encloses."""

    file: str = Field(min_length=1, max_length=4096, description="A PLY, OBJ, STL or OFF file, relative to the job's file.")
    scale: Length = Field(default=1.0, description="Factor from the file's units to world units.")
    translate: Position = Field(default=(0.0, 0.0, 0.0), description="Added after scaling, world units.")


class StrokeDescription(Part):
    """A brush stroke on the film."""

    points: list[Pixel] = Field(min_length=1, max_length=10_000, description="Corners of a polyline, pixels: x to the right, y down.")
    radius: Length = Field(description="Half the stroke's width, pixels.")


def _named(value: Any) -> Any:
    return {"name": value} if isinstance(value, str) else value


def _filed(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


def _some_area(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    x0, y0 = points[0]
    x1, y1 = max(points, key=lambda point: math.dist(point, points[0]))
    if all((x - x0) * (y1 - y0) == (y - y0) * (x1 - x0) for x, y in points):
        raise ValueError("expected corners that enclose an area, found all of them on one line")
    return points


class RegionDescription(Part):
    """A region: exactly one of these keys."""

    sphere: SphereDescription | None = Field(default=None, description="A ball: `center` and `radius`, world units.")
    box: BoxDescription | None = Field(default=None, description="A box: `min` and `max`, or `center`, `size` and perhaps `rotate: {axis, angle}`.")
    object: Annotated[ObjectDescription | None, BeforeValidator(_named, json_schema_input_type=str | ObjectDescription | None)] = Field(
        default=None, description="An object of the scene: its name, for its surface, or `name` and `part` (`surface` or `inside`)."
    )
    mesh: Annotated[MeshDescription | None, BeforeValidator(_filed, json_schema_input_type=str | MeshDescription | None)] = Field(
        default=None, description="What a closed mesh encloses: a file, or `file`, `scale` and `translate`."
    )
    stroke: StrokeDescription | None = Field(
        default=None, description="A brush stroke on the film, projected on the surfaces seen there: `points` and `radius`, pixels."
    )
    polygon: Annotated[list[Pixel], Field(min_length=3, max_length=10_000), AfterValidator(_some_area)] | None = Field(
        default=None, description="Corners of a polygon on the film, pixels (x to the right, y down), projected on the surfaces seen there."
    )

    @model_validator(mode="after")
    def _one_kind(self) -> "RegionDescription":
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"expected exactly one of {_listed(KINDS)}, found {_listed(given) if given else 'none'}")
        return self


KINDS = tuple(RegionDescription.model_fields)


def region(description: Mapping[str, Any] | RegionDescription, base: str | pathlib.Path | None = None) -> Region:
    """The region that a description means; names of files are relative to the folder ``base``. Raises QueryError, which says what was expected."""
    found = description if isinstance(description, RegionDescription) else _validated(description)
    if found.sphere is not None:
        return Sphere(found.sphere.center, found.sphere.radius)
    if found.box is not None:
        return _box(found.box)
    if found.object is not None:
        return (Surface if found.object.part == "surface" else Inside)(found.object.name)
    if found.mesh is not None:
        return Mesh(pathlib.Path(base or "") / found.mesh.file, found.mesh.scale, found.mesh.translate)
    if found.stroke is not None:
        return Stroke(tuple(found.stroke.points), found.stroke.radius)
    return Polygon((tuple(found.polygon or ()),))


def _box(found: BoxDescription) -> Box:
    """Either way to describe a box."""
    if found.min is not None and found.max is not None:
        (a, b, c), (d, e, f) = found.min, found.max
        return Box(((a + d) / 2, (b + e) / 2, (c + f) / 2), (d - a, e - b, f - c))
    center, size = found.center or (0.0, 0.0, 0.0), found.size or (1.0, 1.0, 1.0)
    return Box(center, size, found.rotate.axis, found.rotate.angle) if found.rotate else Box(center, size)


def parse_region(text: str) -> tuple[str, dict[str, Any]]:
    """The name and the description, checked, of a region as command lines give it. Raises QueryError.

    >>> parse_region("spot={sphere: {center: [0, 1, 0], radius: 0.2}}")
    ('spot', {'sphere': {'center': [0, 1, 0], 'radius': 0.2}})
    """
    name, equals, value = text.partition("=")
    name = name.strip()
    if not equals or not re.fullmatch(NAME_PATTERN, name):
        raise QueryError(f"expected NAME=DESCRIPTION, such as {_EXAMPLE}, found `{_shown(text)}`")
    try:
        description = read_yaml(value)
        _validated(description)
    except QueryError as error:
        raise QueryError(f"region `{name}`: {error}") from None
    return name, description


# --- complaints ---------------------------------------------------------------------------------------------------

_EXAMPLE = "spot={sphere: {center: [0, 1, 0], radius: 0.2}}"


def _validated(description: Any) -> RegionDescription:
    if not isinstance(description, Mapping):
        raise QueryError(f"expected a description, that is one of the keys {_listed(KINDS)}, found {_shown(description)}")
    try:
        return RegionDescription.model_validate(dict(description))
    except ValidationError as error:
        raise QueryError("; ".join(_complaint(item) for item in error.errors(include_url=False)[:_MOST_COMPLAINTS])) from None


def _complaint(item: Any) -> str:
    """One complaint of the schema: which key, what was expected, what was found."""
    *above, last = item["loc"] or ("",)
    key = ".".join(map(str, item["loc"]))
    if item["type"] == "missing":
        return f"`{key}` is missing" if isinstance(last, str) else f"`{'.'.join(map(str, above))}`: expected one value more"
    if item["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(last), _known_keys(above), n=1)
        return f"unknown key `{key}`" + (f": did you mean `{near[0]}`?" if near else f": expected {_listed(_known_keys(above))}")
    message = str(item["msg"]).removeprefix("Value error, ")
    text = message.replace("Input should be", "expected", 1) if message.startswith("Input should be") else message
    if item["type"] == "value_error" and isinstance(item["input"], (Mapping, BaseModel)):
        return f"`{key}`: {text}" if key else text  # it says what was found
    return (f"`{key}`: " if key else "") + f"{text}, found {_shown(item['input'])}"


def _known_keys(steps: list[Any]) -> list[str]:
    """The keys of the section that these steps lead to."""
    sections: dict[tuple[Any, ...], type[BaseModel]] = {
        (): RegionDescription,
        ("sphere",): SphereDescription,
        ("box",): BoxDescription,
        ("box", "rotate"): Rotation,
        ("object",): ObjectDescription,
        ("mesh",): MeshDescription,
        ("stroke",): StrokeDescription,
    }
    return list(sections[tuple(steps)].model_fields)


def _listed(names: Any) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _shown(value: Any) -> str:
    try:
        text = value if isinstance(value, str) else _SHORT.repr(value)
    except ValueError:  # a whole number of too many digits
        text = "a number of thousands of digits"
    return text if len(text) <= _MOST_SHOWN else text[:_MOST_SHOWN] + "…"
