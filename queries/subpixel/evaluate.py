"""How well each method of filtering shows pictures on each display: by S-CIELAB, by the error that the kernels make least, and by what is clipped.

A method is judged by the light of the display that it drives, as a viewer sees it from where the filters were derived for, beside the picture at full
resolution. What a display cannot show is cut off first, of the light and of the picture; the columns ``clipped`` and ``scielab_unclipped`` say what
that does. Pictures brighter than white, as renders with a lamp in view, are filtered as they are.
"""

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import get_args

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.diagnostics.answers import REAL, TEXT, Figure, answer
from queries.errors import QueryError
from queries.shards import cores
from queries.subpixel.description import Method
from queries.subpixel.display import clipped_share, shown
from queries.subpixel.images import apply, signal_of_image
from queries.subpixel.scielab import appearance, summary
from queries.subpixel.weighted_error import weighted_error
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import METHODS
from renderer.filters.subpixel.sensitivity import Sensitivity
from renderer.filters.subpixel.viewing import Viewing
from renderer.filters.subpixel.windowed_sinc import Fit

F32 = npt.NDArray[np.float32]

REPEATS, LONG = 3, 0.1  # a filter is timed so often, or as often as fits into so many seconds
FIGURES = (
    Figure("layout", TEXT, "the display"),
    Figure("image", TEXT, "the picture that is shown"),
    Figure("method", TEXT, "how the picture is filtered"),
    Figure("scielab", REAL, "S-CIELAB difference to the picture at full resolution, mean over it; about 1 can just be seen"),
    Figure("scielab_95", REAL, "S-CIELAB difference that 95 % of the picture stay below"),
    Figure("lightness", REAL, "part of the S-CIELAB difference that is in lightness: mean of |ΔL*|"),
    Figure("chroma", REAL, "part of the S-CIELAB difference that is in color: mean of the length of (Δa*, Δb*)"),
    Figure("weighted_error", REAL, "error weighed by contrast sensitivity (thesis, Eq. 4.4) in units of the picture's own weighed energy, unclipped"),
    Figure("clipped", REAL, "share of subpixels that should be darker than black or brighter than they can be"),
    Figure("scielab_unclipped", REAL, "mean S-CIELAB difference of a display that could show those too, to the picture as bright as it is"),
    Figure("seconds", REAL, "time of filtering on all cores, the display's and the viewer's part left out; none where the picture came filtered"),
)


@dataclass(frozen=True, eq=False)
class _Shown:
    """One picture by one method on one display: its ``lattice`` and the ``seconds`` of filtering."""

    layout: str
    image: str
    method: Method
    lattice: F32
    seconds: float


def judge(
    images: Mapping[str, F32],
    layouts: Mapping[str, Layout],
    kernels: Mapping[str, Kernels],
    fits: Mapping[str, tuple[Fit, ...]],
    viewing: Viewing,
    sensitivity: Sensitivity,
    zeros: int,
    fine: int,
    methods: Sequence[str] = METHODS,
    given: Mapping[tuple[str, str, str], F32] | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> pa.Table:
    """One row for each layout, image and method, in that order; columns and their meanings: ``FIGURES``.

    ``images``: pictures at full resolution, float32 (height * fine, width * fine, 3), linear RGB, white at 1 and brighter where they are: ``fine`` x
    ``fine`` samples for each pixel of the display. ``kernels`` and ``fits`` by layout. ``given``: lattices that were filtered elsewhere, by (image,
    layout, method); those of a part of a display begin where a period of its layout does. ``clock``: seconds.
    Raises QueryError for unknown methods, pictures that hold no whole pixels, and lattices of other sizes.
    """
    chosen = _checked(images, layouts, methods, fine)
    found: list[_Shown] = []
    for (image, name, method), lattice in (given or {}).items():
        if image in images and name in layouts and lattice.shape != _lattice_shape(images[image], layouts[name], fine):
            expected = _lattice_shape(images[image], layouts[name], fine)
            raise QueryError(f"image `{image}` by `{method}` on `{name}`: expected a lattice of {expected}, found {lattice.shape}")
    for name, layout in layouts.items():
        for method in chosen:
            warm = True  # the first picture also compiles: it is filtered once more
            for image, reference in images.items():
                if given and (image, name, method) in given:
                    found.append(_Shown(name, image, method, given[image, name, method], float("nan")))
                    continue
                work = _filtering(reference, method, layout, kernels[name], fits[name], zeros, fine)
                if warm:
                    work()
                    warm = False
                found.append(_Shown(name, image, method, *_timed(work, clock)))
    order = {key: i for i, key in enumerate((layout, image, method) for layout in layouts for image in images for method in chosen)}
    found.sort(key=lambda one: order[one.layout, one.image, one.method])

    # What the viewer sees, one picture a thread
    degrees = viewing.degrees_per_pixel / fine
    with ThreadPoolExecutor(cores()) as pool:
        seen = dict(zip(images, pool.map(lambda picture: _Seen.of(picture, degrees), images.values())))
        pairs = [(layout, image) for layout in layouts for image in images]
        signals = dict(zip(pairs, pool.map(lambda pair: signal_of_image(images[pair[1]], layouts[pair[0]], fine, threads=1), pairs)))

        def judged(one: _Shown) -> dict[str, float]:
            layout = layouts[one.layout]
            error = weighted_error(one.lattice, signals[one.layout, one.image], layout, viewing, sensitivity)
            return {**_seen(one.lattice, layout, seen[one.image], degrees, fine), "weighted_error": error, "seconds": one.seconds}

        figures = list(pool.map(judged, found))
    columns = {name: [getattr(one, name) for one in found] for name in ("layout", "image", "method")}
    return answer(FIGURES, columns | {figure.name: [row[figure.name] for row in figures] for figure in FIGURES[3:]})


@dataclass(frozen=True, eq=False)
class _Seen:
    """What a viewer sees of a picture, float32 (rows, columns, 3): as far as light in [0, 1] can show it, and ``whole``."""

    cut: F32
    whole: F32

    @classmethod
    def of(cls, picture: F32, degrees: float) -> "_Seen":
        """Both, which are one unless some of the picture is brighter than white."""
        whole = appearance(picture, degrees)
        inside = picture.min() >= 0.0 and picture.max() <= 1.0
        return cls(whole if inside else appearance(np.clip(picture, 0.0, 1.0), degrees), whole)


def _seen(lattice: F32, layout: Layout, reference: _Seen, degrees: float, fine: int) -> dict[str, float]:
    """The figures of S-CIELAB of a lattice."""
    share = clipped_share(lattice, layout)
    difference = summary(reference.cut, appearance(shown(np.clip(lattice, 0.0, 1.0), layout, fine), degrees))
    same = share == 0.0 and reference.cut is reference.whole
    unclipped = difference.mean if same else summary(reference.whole, appearance(shown(lattice, layout, fine), degrees)).mean
    return {
        "scielab": difference.mean,
        "scielab_95": difference.high,
        "lightness": difference.lightness,
        "chroma": difference.chroma,
        "clipped": share,
        "scielab_unclipped": unclipped,
    }


def _lattice_shape(picture: F32, layout: Layout, fine: int) -> tuple[int, int]:
    """Rows and columns of positions that show a picture."""
    return picture.shape[0] // fine * layout.cells[1], picture.shape[1] // fine * layout.cells[0]


def _filtering(reference: F32, method: Method, layout: Layout, kernels: Kernels, fits: tuple[Fit, ...], zeros: int, fine: int) -> Callable[[], F32]:
    return lambda: apply(reference, method, layout, kernels, fits, zeros, fine)


def _timed(work: Callable[[], F32], clock: Callable[[], float]) -> tuple[F32, float]:
    """What ``work`` gives, and the median of its times."""
    times: list[float] = []
    while True:
        start = clock()
        found = work()
        times.append(clock() - start)
        if len(times) == REPEATS or sum(times) >= LONG:
            return found, statistics.median(times)


def _checked(images: Mapping[str, F32], layouts: Mapping[str, Layout], methods: Sequence[str], fine: int) -> list[Method]:
    """The methods, by their type."""
    known: tuple[Method, ...] = get_args(Method)
    chosen = [one for name in methods for one in known if one == name]
    if len(chosen) != len(methods) or not methods:
        raise QueryError(f"expected methods among {', '.join(known)}, found {', '.join(methods) or 'none'}")
    if not images or not layouts:
        raise QueryError("nothing to judge: give at least one image and one layout")
    for name, picture in images.items():
        if picture.ndim != 3 or picture.shape[2] != 3 or picture.shape[0] % fine or picture.shape[1] % fine or not picture.size:
            raise QueryError(f"image `{name}`: expected whole pixels of {fine} x {fine} samples of 3 colors, found an array of {picture.shape}")
    return chosen
