"""The whole analysis: filters derived for every display, applied to a run's samples or to an image, and judged."""

import contextlib
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import QueryError
from queries.lpe import Expression
from queries.luminance import luminance_of
from queries.run import Run
from queries.subpixel.analysis import Analysis, Display
from queries.subpixel.description import Method, SubpixelDescription
from queries.subpixel.display import clipped_share, fine_grid
from queries.subpixel.evaluate import judge
from queries.subpixel.full import apply_kernels
from queries.subpixel.images import apply, display_size, resample
from queries.subpixel.preference import layouts_ranked, methods_ranked
from queries.subpixel.reasons import reasons
from queries.subpixel.resolve import grid, resolve
from queries.subpixel.targets import target
from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import subpixel_filter
from renderer.filters.subpixel.windowed_sinc import Fit, fit

F32 = npt.NDArray[np.float32]
Kind = Literal["run", "image"]
Window = tuple[int, int, int, int]  # left, top, right, bottom: whole pixels of a display

TARGET_SIZE = (96, 72)  # pixels of the display that shows the project's own test images
LARGEST_WINDOW = (192, 144)  # of the input that is judged, pixels: S-CIELAB of more would take minutes


@dataclass(frozen=True, eq=False)
class Derived:
    """A display's kernels, and the analytic filter of each of its subpixels."""

    layout: Layout
    kernels: Kernels
    fits: tuple[Fit, ...]


class Source(Protocol):
    """What is shown. ``size``: pixels of the display, across and down."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def kind(self) -> Kind:
        """What it is."""

    @property
    def size(self) -> tuple[int, int]:
        """Pixels of the display, across and down."""

    def lattice(self, method: Method, display: Derived, zeros: int) -> F32:
        """The drive of every position of a display, float32 (rows, columns), unclipped."""

    def samples(self, fine: int, window: Window) -> F32:
        """A part of it with ``fine`` x ``fine`` samples for each pixel, float32 (rows, columns, 3), linear."""


@dataclass(frozen=True, eq=False)
class RunSource:
    """The samples of a run, of all paths or of those that an expression matches: a pixel of the display for each pixel of the film."""

    run: Run
    expression: Expression | None = None
    threads: int | None = None

    @property
    def name(self) -> str:
        """The run's name."""
        return str(self.run.manifest.get("name", self.run.path.name))

    @property
    def kind(self) -> Kind:
        """A run."""
        return "run"

    @property
    def size(self) -> tuple[int, int]:
        """The film's."""
        return self.run.settings["width"], self.run.settings["height"]

    def lattice(self, method: Method, display: Derived, zeros: int) -> F32:
        """See ``Source``."""
        if method == "kernels":
            offset = display.layout.origin[0] - 0.5, display.layout.origin[1] - 0.5  # of the cell around the first position
            signal = grid(self.run, *display.layout.cells, expression=self.expression, threads=self.threads, offset=offset)
            return np.asarray(apply_kernels(signal, display.kernels), np.float32)
        filter = subpixel_filter(method, display.layout, display.fits, zeros)
        return resolve(self.run, filter, expression=self.expression, threads=self.threads).lattice

    def samples(self, fine: int, window: Window) -> F32:
        """See ``Source``."""
        return grid(self.run, fine, fine, expression=self.expression, threads=self.threads, window=window)


@dataclass(frozen=True, eq=False)
class ImageSource:
    """An image, float32 (height, width, 3), linear: ``scale`` x ``scale`` of its pixels are a pixel of the display."""

    name: str
    image: F32
    scale: float

    @property
    def kind(self) -> Kind:
        """An image."""
        return "image"

    @property
    def size(self) -> tuple[int, int]:
        """As many pixels as the image fills wholly."""
        return display_size(self.image, self.scale)

    def lattice(self, method: Method, display: Derived, zeros: int) -> F32:
        """See ``Source``."""
        return apply(self.image, method, display.layout, display.kernels, display.fits, zeros, self.scale)

    def samples(self, fine: int, window: Window) -> F32:
        """See ``Source``."""
        return resample(self.image, self.scale, fine, window)


def analyze(source: Source, asked: SubpixelDescription) -> Analysis:
    """Derive the filters of every display that is asked for, show the source on it, and compare the methods. Raises QueryError."""
    watch = _Watch()
    derived = []
    with watch.part("derivation"):
        for name, layout in asked.displays().items():
            try:
                kernels = derive(layout, asked.viewing, asked.sensitivity.sensitivity())
                derived.append(Derived(layout, kernels, fit(kernels)))
            except ValueError as error:
                raise QueryError(f"layout `{name}`: {error}") from None
    kept: tuple[Method, ...] = ("pixel_box", asked.method)
    methods: tuple[Method, ...] = get_args(Method) if asked.evaluate else kept
    window = None
    if asked.evaluate:
        with watch.part("choice of the part to compare"):
            window = _window(source, [one.layout for one in derived])

    # Of all methods but those that are asked for, only the part that is compared stays in memory
    lattices: dict[tuple[str, Method], F32] = {}
    parts: dict[tuple[str, Method], F32] = {}
    for display in derived:
        for method in dict.fromkeys((*kept, *methods)):
            with watch.part(f"{display.layout.name}: {method}"):
                lattice = source.lattice(method, display, asked.zeros)
            if method in kept:
                lattices[display.layout.name, method] = lattice
            if window is not None:
                parts[display.layout.name, method] = _part(lattice, display.layout, window)
    displays = tuple(_display(one, lattices, asked.method) for one in derived)
    if window is None:
        return Analysis(source.name, source.kind, asked, displays, source.size, seconds=watch.seconds)
    with watch.part("comparison"):
        scores = _judged(source, asked, derived, window, parts)
        by_layout = {one.layout.name: methods_ranked(scores, one.layout.name) for one in derived}
        layouts = layouts_ranked(scores) if len(derived) > 1 else None
    return Analysis(source.name, source.kind, asked, displays, source.size, scores, by_layout, layouts, reasons(scores), watch.seconds)


def _display(derived: Derived, lattices: Mapping[tuple[str, Method], F32], method: Method) -> Display:
    layout = derived.layout
    lattice = lattices[layout.name, method]
    return Display(layout, derived.kernels, derived.fits, lattice, lattices[layout.name, "pixel_box"], clipped_share(lattice, layout))


def _judged(
    source: Source, asked: SubpixelDescription, derived: Sequence[Derived], window: Window, parts: Mapping[tuple[str, Method], F32]
) -> pa.Table:
    """The scores of all methods on all displays, for the project's test images and for a part of the source, of which ``parts`` has the lattices."""
    layouts = {one.layout.name: one.layout for one in derived}
    fine = fine_grid(layouts.values())
    pictures: dict[str, F32] = {name: target(name, *TARGET_SIZE, fine) for name in asked.targets}
    shown = source.name if source.name not in pictures else f"{source.name} ({source.kind})"
    pictures[shown] = source.samples(fine, window)
    given: dict[tuple[str, str, str], F32] = {(shown, name, method): part for (name, method), part in parts.items()}
    return judge(
        pictures,
        layouts,
        {one.layout.name: one.kernels for one in derived},
        {one.layout.name: one.fits for one in derived},
        asked.viewing,
        asked.sensitivity.sensitivity(),
        asked.zeros,
        fine,
        given=given,
    )


def _window(source: Source, layouts: Sequence[Layout]) -> Window:
    """The part of the source that is judged: all of it, or where its lightness changes most from pixel to pixel. It begins and ends with periods."""
    width, height = source.size
    across = math.lcm(*(layout.pattern.shape[1] // layout.cells[0] for layout in layouts))
    down = math.lcm(*(layout.pattern.shape[0] // layout.cells[1] for layout in layouts))
    if width < across or height < down:
        raise QueryError(f"`{source.name}` is {width} x {height} pixels of the display, less than a period of its pattern: {across} x {down}")
    size = tuple(max(most // period, 1) * period for most, period in zip(np.minimum((width, height), LARGEST_WINDOW).tolist(), (across, down)))

    # Changes between neighbors, summed over every window
    pixels = luminance_of(np.clip(source.samples(1, (0, 0, width, height)), 0.0, 1.0))
    change = np.zeros(pixels.shape)
    change[1:] += np.abs(np.diff(pixels, axis=0))
    change[:, 1:] += np.abs(np.diff(pixels, axis=1))
    sums = np.pad(change, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    found = sums[size[1] :, size[0] :] - sums[: -size[1], size[0] :] - sums[size[1] :, : -size[0]] + sums[: -size[1], : -size[0]]
    found = found[::down, ::across]
    top, left = np.unravel_index(int(np.argmax(found)), found.shape)
    return int(left) * across, int(top) * down, int(left) * across + size[0], int(top) * down + size[1]


def _part(lattice: F32, layout: Layout, window: Window) -> F32:
    """A copy of a window of a lattice."""
    (across, down), (left, top, right, bottom) = layout.cells, window
    return lattice[top * down : bottom * down, left * across : right * across].copy()


class _Watch:
    """Seconds of each part, by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextlib.contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Time a part."""
        start = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - start
