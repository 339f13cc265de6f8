"""Displays and their viewers as a job describes them: a strict schema, the layouts that are shipped, and what they mean."""

import functools
import pathlib
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
import yaml
from pydantic import AfterValidator, Field, ValidationError, model_validator

from queries.errors import QueryError
from queries.regions.description import NAME_PATTERN, Part
from renderer.filters.subpixel import sensitivity as csf
from renderer.filters.subpixel.layout import INACTIVE, OPPONENT_RGB, OPPONENT_RGBW, PRIMARIES, Layout
from renderer.filters.subpixel.viewing import Viewing

FOLDER = pathlib.Path(__file__).parent / "layouts"
EMPTY = "."  # a position that holds no subpixel
MOST_POSITIONS = 24  # of a period, along each axis

Primary = Literal["R", "G", "B", "W"]
Method = Literal["pixel_box", "pixel_mitchell", "none", "box", "mitchell", "optimal", "kernels"]
Target = Literal["text", "text_inverted", "hair", "foliage", "wire_frame", "zone_plate", "noise"]
Frequency = Annotated[float, Field(gt=0, le=1e6)]
Frequencies = Frequency | Annotated[tuple[Frequency, Frequency, Frequency], Field(strict=False)]
LayoutName = Annotated[str, Field(min_length=1, max_length=100, pattern=NAME_PATTERN)]
Count = Annotated[int, Field(ge=1, le=MOST_POSITIONS)]


def _rows(pattern: list[str]) -> list[str]:
    rows = [row.split() for row in pattern]
    if not rows or not rows[0] or len({len(row) for row in rows}) != 1:
        raise ValueError("expected rows of equally many positions, such as `R G B`")
    if max(len(rows), len(rows[0])) > MOST_POSITIONS:
        raise ValueError(f"expected a period of at most {MOST_POSITIONS} x {MOST_POSITIONS} positions, found {len(rows[0])} x {len(rows)}")
    unknown = sorted({letter for row in rows for letter in row} - {*PRIMARIES, EMPTY})
    if unknown:
        raise ValueError(f"expected positions R, G, B, W, or `{EMPTY}` for an empty one, found {', '.join(unknown)}")
    return pattern


class LayoutDescription(Part):
    """A display's subpixels: one period of the pattern, on a grid of positions. A pattern of one row has positions as high as a pixel."""

    pattern: Annotated[list[str], AfterValidator(_rows)] = Field(
        description="Rows of positions from top to bottom, such as `[R G, B W]`: the primary whose subpixel has its center there, or `.` for none."
    )
    cells: Annotated[tuple[Count, Count], Field(strict=False)] = Field(description="How many positions a pixel is wide and high.")
    origin: Annotated[tuple[Annotated[float, Field(ge=0, lt=1)], Annotated[float, Field(ge=0, lt=1)]], Field(strict=False)] = Field(
        default=(0.5, 0.5), description="Where the center of the first position lies, right of and below the corner of a pixel, in positions."
    )
    extent: dict[Primary, Annotated[tuple[Count, Count], Field(strict=False)]] = Field(
        default={}, description="Width and height of each primary's subpixels, in positions. Default: 1 x 1."
    )
    opponent: dict[Primary, Annotated[tuple[float, float, float], Field(strict=False)]] = Field(
        default={}, description="Y', C1 and C2 of each primary at full drive. Default: thesis, Eq. 4.2, with W Eq. 4.12."
    )

    @model_validator(mode="after")
    def _fits_together(self) -> "LayoutDescription":
        self.layout("layout")
        return self

    def layout(self, name: str) -> Layout:
        """The layout, under a name. Raises ValueError where its parts do not fit together."""
        letters = [row.split() for row in self.pattern]
        primaries = PRIMARIES if any("W" in row for row in letters) else PRIMARIES[:3]
        pattern = np.array([[INACTIVE if letter == EMPTY else PRIMARIES.index(letter) for letter in row] for row in letters], np.int64)
        opponent = np.array(OPPONENT_RGBW if "W" in primaries else OPPONENT_RGB)
        for key, named in (("opponent", self.opponent), ("extent", self.extent)):
            if not named.keys() <= set(primaries):
                raise ValueError(f"`{key}` names {', '.join(sorted(named.keys() - set(primaries)))}, which the pattern has not")
        for primary, column in self.opponent.items():
            opponent[:, primaries.index(primary)] = column
        extent = tuple(self.extent.get(primary, (1, 1)) for primary in primaries)  # type: ignore[call-overload]
        return Layout(name, primaries, pattern, self.cells, self.origin, extent, opponent)


class SensitivityTable(Part):
    """Tabulated weights, linear in between, constant beyond both ends."""

    frequency: list[Annotated[float, Field(ge=0, le=1e6)]] = Field(min_length=1, max_length=1000, description="Ascending, in cycles per degree.")
    weights: list[list[Annotated[float, Field(ge=0, le=1e6)]]] = Field(
        min_length=3, max_length=3, description="For each of Y', C1 and C2, a weight at each frequency."
    )


class SensitivityDescription(Part):
    """Contrast sensitivity: how much errors of Y', C1 and C2 count at each spatial frequency. Exactly one of the keys; a number is for all three."""

    exponential: Frequencies | None = Field(default=None, description="exp(-f / this), cycles per degree. The default is 2.3.")
    gaussian: Frequencies | None = Field(default=None, description="A Gaussian of this standard deviation, cycles per degree.")
    box: Frequencies | None = Field(default=None, description="1 up to this frequency, 0 beyond; cycles per degree.")
    table: SensitivityTable | None = Field(default=None, description="Tabulated weights.")

    @model_validator(mode="after")
    def _one(self) -> "SensitivityDescription":
        if sum(value is not None for value in (self.exponential, self.gaussian, self.box, self.table)) != 1:
            raise ValueError("expected exactly one of `exponential`, `gaussian`, `box`, `table`")
        self.sensitivity()
        return self

    def sensitivity(self) -> csf.Sensitivity:
        """The weights. Raises ValueError where a table is not one."""
        if self.table is not None:
            return csf.table(self.table.frequency, self.table.weights)
        if self.exponential is not None:
            return csf.exponential(self.exponential)
        if self.gaussian is not None:
            return csf.gaussian(self.gaussian)
        assert self.box is not None
        return csf.box(self.box)


class SubpixelDescription(Part):
    """Subpixel filters (thesis chapter 4): derived for displays, applied to the run's samples, and compared. Written into `subpixel/`."""

    layouts: list[LayoutName] = Field(
        default=["rgb_stripe"], min_length=1, max_length=20, description="Displays: `rgb_stripe`, `bgr_stripe`, `rgbg`, `rgbw`, or names of `custom`."
    )
    custom: dict[LayoutName, LayoutDescription] = Field(default={}, description="Displays of your own: name -> layout.")
    dpi: float = Field(default=100.0, ge=1, le=10_000, description="Pixels of the display per inch.")
    distance: float = Field(default=46.0, ge=1, le=100_000, description="Distance of the viewer's eye from the display, centimeters.")
    sensitivity: SensitivityDescription = Field(
        default=SensitivityDescription(exponential=csf.DEFAULT_CONSTANT), description="The viewer's contrast sensitivity."
    )
    method: Method = Field(
        default="optimal",
        description="How the picture is filtered. For each pixel: `pixel_box`, `pixel_mitchell`. For each subpixel: `none`, `box`, `mitchell`, "
        "`optimal` (the analytic filter, clamped), `kernels` (all solved kernels).",
    )
    zeros: int = Field(
        default=2,
        ge=2,
        le=8,
        description="How many zeros of the sinc the `optimal` filter reaches to on each side: 2 ends it after its first negative lobe.",
    )
    evaluate: bool = Field(default=True, description="Compare all methods by S-CIELAB, the weighted error and the share of clipped subpixels.")
    targets: list[Target] = Field(
        default=["text", "text_inverted", "hair", "foliage", "wire_frame", "zone_plate", "noise"],
        description="The project's own test images that are compared beside the run's image.",
    )

    @model_validator(mode="after")
    def _known_layouts(self) -> "SubpixelDescription":
        known = {**shipped_layouts(), **self.custom}
        for name in self.layouts:
            if name not in known:
                raise ValueError(f"there is no layout `{name}`: known are {', '.join(known)}")
        clash = sorted(set(self.custom) & set(shipped_layouts()))
        if clash:
            raise ValueError(f"`custom.{clash[0]}` is the name of a layout that is shipped: choose another name")
        return self

    def displays(self) -> dict[str, Layout]:
        """The layouts that are asked for, by name."""
        known = {**shipped_layouts(), **self.custom}
        return {name: known[name].layout(name) for name in self.layouts}

    @property
    def viewing(self) -> Viewing:
        """Where the display is seen from."""
        return Viewing(self.dpi, self.distance)


@functools.cache
def shipped_layouts() -> Mapping[str, LayoutDescription]:
    """The layouts that come with the program, by name."""
    order = ("rgb_stripe", "bgr_stripe", "rgbg", "rgbw")
    return {name: read_layout(FOLDER / f"{name}.yaml") for name in order}


def layout(name: str) -> Layout:
    """A shipped layout. Raises QueryError for a name that is not known."""
    if name not in shipped_layouts():
        raise QueryError(f"there is no layout `{name}`: known are {', '.join(shipped_layouts())}")
    return shipped_layouts()[name].layout(name)


def read_layout(file: pathlib.Path) -> LayoutDescription:
    """A layout of a YAML file. Raises QueryError where it cannot be read, or is none."""
    try:
        return LayoutDescription.model_validate(yaml.safe_load(file.read_text("utf-8")))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise QueryError(f"the layout `{file}` cannot be read: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise QueryError(f"the layout `{file}`: {where + ': ' if where else ''}{first['msg']}") from None
