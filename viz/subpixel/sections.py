"""What the parts of the page of an analysis show: matrices of scores, parameters beside the thesis's, conditioning, settings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa

from queries.subpixel.analysis import Analysis, Display
from queries.subpixel.targets import DESCRIPTIONS
from renderer.filters.subpixel.methods import METHODS
from viz.report.numbers import UNKNOWN, number, percent
from viz.report.subpixel import image_title, layout_title, method_title
from viz.report.tables import Cell, Column, Table
from viz.subpixel.findings import OPTIMAL
from viz.subpixel.fits import FitRow, fit_rows
from viz.subpixel.pattern import pattern_drawing, pattern_in_words

_MODELS = {"across": "across", "down": "down", "radial": "distance", "separable": "across × down"}


@dataclass(frozen=True)
class Mark:
    """A score in a matrix. ``best``: of its image; ``lost``: of the optimal filter, where a simpler method is better."""

    text: str
    best: bool = False
    lost: bool = False


@dataclass(frozen=True)
class Matrix:
    """S-CIELAB of each method on each image of a display, and what it shows in words."""

    caption: str
    methods: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Mark]]]


@dataclass(frozen=True)
class Pattern:
    """A display as it is drawn, and its numbers."""

    title: str
    words: str
    drawing: object
    facts: Sequence[tuple[str, str]]


# --- scores --------------------------------------------------------------------------------------------------------


def matrices(scores: pa.Table) -> list[Matrix]:
    """The scores of each display: images down, methods across."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for row in scores.select(["layout", "image", "method", "scielab"]).to_pylist():
        found.setdefault(row["layout"], {}).setdefault(row["image"], {})[row["method"]] = row["scielab"]
    return [_matrix(layout, images) for layout, images in found.items()]


def _matrix(layout: str, images: dict[str, dict[str, float]]) -> Matrix:
    present = {method for scores in images.values() for method in scores}
    methods = [method for method in METHODS if method in present] + sorted(present - set(METHODS))
    rows = [(image_title(image), [_mark(method, scores) for method in methods]) for image, scores in images.items()]
    caption = f"{layout_title(layout)}: mean S-CIELAB difference to the reference, by image and method"
    return Matrix(caption, [method_title(method) for method in methods], rows)


def _mark(method: str, scores: dict[str, float]) -> Mark:
    score = scores.get(method)
    if score is None:
        return Mark(UNKNOWN)
    least = min(scores.values())
    simple = min((value for name, value in scores.items() if name not in OPTIMAL), default=math.inf)
    return Mark(f"{score:.2f}", score == least, method == "optimal" and simple < score)


# --- kernels -------------------------------------------------------------------------------------------------------


def fit_table(analysis: Analysis) -> Table:
    """The analytic filters' parameters beside the thesis's Table 4.1."""
    columns = [
        Column("layout", "display", "the display that the filter is for", "class"),
        Column("subpixel", "subpixel", "which subpixel of a period it is for, in reading order", "words"),
        Column(
            "model",
            "x is",
            "what x of the filter is, in positions of the display’s pattern: the offset, the distance, or both offsets in a product",
            "words",
        ),
        Column("a", "a", "where the filter’s zeros are: π / a apart; of products, across and then down", "number"),
        Column("b", "b", "how wide its window is, squared positions", "number"),
        Column("rms", "rms", "root mean square of the kernel’s difference from the filter; the thesis states less than 0.02", "number"),
        Column("relative", "relative", "the same in units of the kernel’s own root mean square", "number"),
        Column("thesis_a", "thesis’s a", "as its Table 4.1 states it, of the same units", "number"),
        Column("thesis_b", "thesis’s b", "as its Table 4.1 states it, of the same units", "number"),
        Column("agreement", "agreement", "of a within 2 % and of b within 5 %, where the display is seen at the thesis’s frequencies", "words"),
    ]
    return Table("Analytic filters: parameters, fit, and the thesis’s Table 4.1", columns, [_fit_row(row) for row in fit_rows(analysis)])


def _fit_row(row: FitRow) -> list[Cell]:
    title, model = layout_title(row.layout), _MODELS[row.model] + ("" if row.applied else " (not applied)")
    a, b = number(row.a), _width(row.b)
    if row.a_down is not None and row.b_down is not None:
        a, b = f"{a}, {number(row.a_down)}", f"{b}, {_width(row.b_down)}"
    return [
        *(Cell(title, title), Cell(row.subpixel, row.subpixel), Cell(model, model), Cell(a, row.a), Cell(b, row.b)),
        *(Cell(number(row.rms, 2), row.rms), Cell(percent(row.relative, 2), row.relative)),
        *(Cell(number(row.thesis_a), row.thesis_a), Cell(number(row.thesis_b), row.thesis_b), Cell(row.agreement, row.agreement)),
    ]


def _width(value: float) -> str:
    return "∞" if math.isinf(value) else number(value)


def condition_table(analysis: Analysis) -> Table:
    """How well each display's kernels are determined."""
    columns = [
        Column("layout", "display", "the display whose kernels were solved for", "class"),
        Column("kernels", "kernels", "how many there are: one for each subpixel of a period and each channel of the signal", "number"),
        Column("positions", "signal", "positions of the periodic signal that they were solved on, across and down", "words"),
        Column("step", "step, cpd", "between neighboring frequencies along rows, cycles per degree", "number"),
        Column(
            "condition",
            "condition",
            "the largest ratio of a residue’s singular values; that of the residue’s part of the matrix A is its square",
            "number",
        ),
        Column("singular", "singular systems", "how many of the systems leave some frequencies open, and how many there are", "words"),
    ]
    return Table("Conditioning of the systems", columns, [_condition_row(display) for display in analysis.displays])


def _condition_row(display: Display) -> list[Cell]:
    kernels = display.kernels
    subpixels, primaries, rows, columns = kernels.h.shape
    title = layout_title(display.layout.name)
    return [
        Cell(title, title),
        Cell(number(subpixels * primaries), float(subpixels * primaries)),
        Cell(f"{columns} × {rows}", f"{columns} × {rows}"),
        Cell(number(kernels.step[1], 3), kernels.step[1]),
        Cell(number(kernels.condition, 3), kernels.condition),
        Cell(f"{kernels.deficient} of {kernels.residues}", f"{kernels.deficient} of {kernels.residues}"),
    ]


def warnings(analysis: Analysis) -> list[str]:
    """What should not be trusted: systems that are singular, kernels that displays clip, fits that miss."""
    return [
        layout_title(one.layout.name) + text.removeprefix(one.layout.name)
        for one in analysis.displays
        for text in (*one.kernels.warnings(), *(fit.warning for fit in one.fits))
        if text
    ]


# --- settings ------------------------------------------------------------------------------------------------------


def settings_rows(analysis: Analysis) -> list[tuple[str, str]]:
    """Everything that the analysis depends on beside its source."""
    described = analysis.description
    viewing = described.viewing
    return [
        (
            "source",
            f"{'an image' if analysis.source == 'image' else 'the samples of a run'}, shown on {analysis.size[0]} × {analysis.size[1]} pixels",
        ),
        ("pixel density", f"{viewing.dpi:g} pixels per inch"),
        ("viewing distance", f"{viewing.distance:g} cm"),
        ("angle of a pixel", f"{viewing.degrees_per_pixel:.4g}°, {1 / viewing.degrees_per_pixel:.4g} pixels per degree"),
        ("pixel Nyquist frequency", f"{0.5 / viewing.degrees_per_pixel:.3g} cycles per degree"),
        ("contrast sensitivity", described.sensitivity.sensitivity().name),
        ("method of the pictures", method_title(described.method)),
        ("optimal filter ends at", f"zero {described.zeros} of its sinc"),
        *((f"test image: {image_title(name)}", DESCRIPTIONS[name]) for name in described.targets if described.evaluate),
    ]


def times(analysis: Analysis) -> list[tuple[str, float]]:
    """Seconds of each stage; what was spent on filtering for one display, by all methods, is one stage."""
    found: dict[str, float] = {}
    for name, taken in analysis.seconds.items():
        layout, colon, _ = name.partition(": ")
        stage = f"filtering for {layout_title(layout)}" if colon else name
        found[stage] = found.get(stage, 0.0) + taken
    return list(found.items())


def patterns(analysis: Analysis) -> list[Pattern]:
    """The displays, drawn."""
    return [_pattern(display) for display in analysis.displays]


def _pattern(display: Display) -> Pattern:
    layout = display.layout
    title = layout_title(layout.name)
    words = pattern_in_words(layout)
    sizes = ", ".join(
        f"{primary} {_pixels(width, layout.cells[0])} × {_pixels(height, layout.cells[1])}"
        for primary, (width, height) in zip(layout.primaries, layout.extent, strict=True)
    )
    spacing = {primary: s for primary, s in zip((layout.primaries[q] for q in layout.active_primaries), layout.spacing.tolist())}
    facts = [
        ("positions of a pixel", f"{layout.cells[0]} × {layout.cells[1]}"),
        ("sizes, pixels", sizes),
        ("spacing, positions", ", ".join(f"{primary} {value:g}" for primary, value in spacing.items())),
    ]
    return Pattern(title, words[:1].upper() + words[1:], pattern_drawing(layout, title), facts)


def _pixels(positions: int, cells: int) -> str:
    """A length in positions as a fraction of a pixel.

    >>> _pixels(4, 6), _pixels(1, 1)
    ('2/3', '1')
    """
    divisor = math.gcd(positions, cells)
    return f"{positions // divisor}/{cells // divisor}" if cells != divisor else f"{positions // divisor}"
