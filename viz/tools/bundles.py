"""Light paths as bundles of illuminated curves (thesis 8.3)."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from viz.tools.base import Color, Drawn, Tool

if TYPE_CHECKING:
    import pyvista

    from queries.path_sample import PathSample
    from queries.run import Run
    from queries.selection import Selection
    from viz.bundles import BundledPaths
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]
I64 = npt.NDArray[np.int64]
Part = Literal["event", "object", "material", "normal"]

MEMORY = 1.5e9  # bytes, at most, of what is drawn
BYTES_PER_POINT = 72  # a point's place, colors and numbers, here and once more where OpenGL draws it, as measured with `weigh: width`
BYTES_PER_SEGMENT = 400  # beside its points: its ends, its vertices, its bundle and its path
DENSE = 6_000_000  # points from which pictures are not supersampled: lines lie upon lines, and it would take four times as many pixels
MOST_NAMES = 12  # in the legend
_WIDTHS = (0.4, 0.8, 1.4, 2.4)  # of lines, from least to most light, as multiples of `line_width`
_FAINTEST = 0.12  # share of `opacity` that a path of hardly any light has
_BRIGHT = 0.95  # quantile of contributions from which paths are drawn in full
_ON_LIGHT = 0.8  # of colors on a light ground
_NOTHING = "camera or sky"


class Bundles(Tool):
    """Light paths, from the emitter to the camera, their segments drawn together by kind of interaction and object."""

    most: Annotated[int, Field(ge=1, le=10_000_000)] = Field(
        default=2000, description="How many paths are drawn, at most. More than fit into 1.5 GB are drawn as many as fit, and the caption says so."
    )
    choose: Literal["uniform", "contribution"] = Field(
        default="contribution", description="`contribution`: paths are drawn as often as they are bright. `uniform`: all alike."
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(default=0, description="Of the choice of paths.")
    amount: Annotated[float, Field(ge=0, le=1)] = Field(
        default=0.85, description="How far curves are drawn to their bundle's axis: 0, straight segments, to 1, where all of a bundle meet."
    )
    points: Annotated[int, Field(ge=3, le=256)] = Field(default=24, description="Points of each curve.")
    flatten: bool = Field(
        default=False, description="Whether bundles stay together inside of paths and fan out at the ends of whole paths alone: for specular chains."
    )
    by: Annotated[list[Part], Field(min_length=1, max_length=4)] = Field(
        default=["event", "object"],
        description="What the two ends of a bundle's segments have in common: the kind of interaction (`event`), the `object`, its `material`, "
        "and the way its surface faces (`normal`, to the nearest of the six directions along the axes).",
    )
    color: Literal["object", "chrominance"] = Field(
        default="object", description="`object`: that which light leaves with a segment. `chrominance`: the color of the light that a path brings."
    )
    to_camera: bool = Field(
        default=False,
        description="Whether the segments that arrive at the camera are drawn too; from the camera they would cover what they show. "
        "Paths of one segment are always drawn.",
    )
    weigh: Literal["none", "opacity", "width"] = Field(
        default="none", description="What grows with the square root of a path's contribution: nothing, the opacity or the width of its lines."
    )
    opacity: Annotated[float, Field(gt=0, le=1)] = Field(default=0.6, description="Of lines, 0 to 1.")
    line_width: Annotated[float, Field(gt=0, le=20)] = Field(default=1.0, description="Of lines, pixels.")

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """See ``Tool``."""
        from viz.bundles import bundled

        selection = self.selection(run)
        selected = selection.describe()
        sample = self._sample(run, selection)
        if not len(sample):
            return Drawn(caption=f"Bundles: the run has no light path{' ' + selected if selected else ''}.", figures=_counts(sample), empty=True)
        paths = bundled(sample, self._codes(run, sample), self.amount, self.points, self.flatten, None if self.to_camera else _before_camera(sample))
        colors, legend = self._colors(run, sample, paths)
        if not stage.look.dark:
            colors = colors * np.float32(_ON_LIGHT)
            legend = tuple((name, (r * _ON_LIGHT, g * _ON_LIGHT, b * _ON_LIGHT)) for name, (r, g, b) in legend)
        self._show(stage, sample, paths, colors)
        bundles = len(np.unique(paths.segments.bundle))
        figures = _counts(sample) | {"segments_drawn": len(paths.segments), "bundles_drawn": bundles, "amount": self.amount}
        meshes = {"bundles": _mesh(run, sample, paths, colors)}
        return Drawn(self._caption(sample, bundles, selected), legend, figures=figures, meshes=meshes)

    # --- which paths --------------------------------------------------------------------------------------------------

    def _sample(self, run: "Run", selection: "Selection") -> "PathSample":
        """As many paths as are asked for and fit."""
        from queries.path_sample import sample_paths

        room = self._room()
        most = min(self.most, room)
        while True:
            sample = sample_paths(run, selection, most, self.choose, self.seed)
            segments = len(sample.event) - len(sample)
            if segments <= room:
                return sample
            most = max(1, int(min(most, len(sample)) * 0.98 * room / segments))

    def _room(self) -> int:
        """How many segments fit into memory."""
        return max(1, int(MEMORY // (BYTES_PER_POINT * self.points + BYTES_PER_SEGMENT)))

    def _codes(self, run: "Run", sample: "PathSample") -> I64:
        """What tells the kinds of vertices apart."""
        from viz.bundles import vertex_codes
        from viz.bundles.normals import facing

        names = run.tables["objects"]["material"].to_pylist()
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        materials = np.zeros(1 + max(run.tables["objects"]["object"].to_pylist(), default=-1), np.int64)
        materials[run.tables["objects"]["object"].to_pylist()] = [numbers[name] for name in names]
        normals = facing(sample, run.geometry.caster) if "normal" in self.by else None
        return vertex_codes(sample, tuple(self.by), materials, normals)

    # --- how they look ------------------------------------------------------------------------------------------------

    def _colors(self, run: "Run", sample: "PathSample", paths: "BundledPaths") -> tuple[F32, tuple[tuple[str, Color], ...]]:
        """The color of each segment, float32 (s, 3), and what colors mean."""
        from viz.colors import as_color, chrominance, object_colors

        if self.color == "chrominance":
            return chrominance(sample.contribution)[paths.segments.path], ()
        palette = object_colors(run)
        left = np.minimum(sample.object[paths.segments.begin], len(palette) - 1)  # what lies on no object has the last color
        shares = np.bincount(left, minlength=len(palette))
        names = [_NOTHING] * len(palette)
        for row in run.tables["objects"].to_pylist():
            names[row["object"]] = row["name"]
        largest = [int(i) for i in np.argsort(-shares, kind="stable")[:MOST_NAMES] if shares[i]]
        legend = [(names[i], as_color(palette[i])) for i in largest]
        return palette[left], tuple(legend)

    def _show(self, stage: "Stage", sample: "PathSample", paths: "BundledPaths", colors: F32) -> None:
        """Put the curves on the stage."""
        from viz.bundles.layers import CurveLayer

        if paths.curves.shape[0] * self.points >= DENSE:
            stage.oversampling = 1
        weight = _weights(sample)[paths.segments.path]
        opacity = np.full(len(weight), self.opacity, np.float32)
        if self.weigh == "opacity":
            opacity *= np.maximum(weight, np.float32(_FAINTEST))
        if self.weigh != "width":
            CurveLayer(stage, paths.curves, colors, opacity, self.line_width)
            return
        step = np.minimum((weight * len(_WIDTHS)).astype(np.int64), len(_WIDTHS) - 1)
        for i, width in enumerate(_WIDTHS):
            rows = np.flatnonzero(step == i)
            if len(rows):
                CurveLayer(stage, paths.curves[rows], colors[rows], opacity[rows], width * self.line_width)

    # --- what is said of them -----------------------------------------------------------------------------------------

    def _caption(self, sample: "PathSample", bundles: int, selected: str) -> str:
        drawn, found = len(sample), sample.found
        chosen = " (the brighter, the likelier)" if self.choose == "contribution" and drawn < found else ""
        number = f"{drawn:,} of {found:,} light paths{chosen}" if drawn < found else f"{drawn:,} light path{'s' if drawn > 1 else ''}"
        if drawn < min(self.most, found) and not self._only_dark_left(sample):
            number = f"{drawn:,} of the {self.most:,} light paths asked for, of {found:,}{chosen}: more would not fit into {MEMORY / 1e9:g} GB. Light"
        color = "the object that light leaves" if self.color == "object" else "that of the light which a path brings"
        weighed = {"none": "", "opacity": "; opacity: how much light", "width": "; width: how much light"}[self.weigh]
        if self.amount > 0:
            shape = (
                f"in {bundles:,} bundle{'s' if bundles > 1 else ''}, drawn together by {self.amount:.0%}"
                f"{' inside of the paths' if self.flatten else ''}. Curves are bundled for legibility: they are not physical paths."
            )
        else:
            shape = "as straight segments: the light's true paths."
        seen = "" if self.to_camera else " up to the last vertex before the camera,"
        return f"{number}{' ' + selected if selected else ''},{seen} {shape} Color: {color}{weighed}."

    def _only_dark_left(self, sample: "PathSample") -> bool:
        """Whether fewer were drawn than there are because the others bring no light, not because of memory."""
        room = self._room()
        return self.choose == "contribution" and self.most <= room and len(sample.event) - len(sample) <= room


def _before_camera(sample: "PathSample") -> Bools:
    """Which segments do not arrive at the camera, or are a whole path: bool (segments)."""
    length = np.diff(sample.start) - 1
    kept = np.ones(int(length.sum()), np.bool_)
    kept[np.cumsum(length)[length > 1] - 1] = False
    return kept


def _mesh(run: "Run", sample: "PathSample", paths: "BundledPaths", colors: F32) -> "pyvista.PolyData":
    """The curves, with what is known of each segment: where its path is in the sample and in the run, its place in the path, from the emitter, …"""
    from viz.bundles.names import bundle_names, class_words
    from viz.bundles.polylines import polyline_mesh
    from viz.colors import as_bytes

    segments, path = paths.segments, paths.segments.path
    classes, words = class_words(run, sample)
    flat = as_bytes(colors)
    mesh = polyline_mesh(paths.curves, np.repeat(flat[:, None], paths.curves.shape[1], axis=1))
    cells: dict[str, npt.NDArray[Any]] = {
        "path_id": path,
        "walk": sample.owner[path],
        "path": sample.path[path],
        "segment": (segments.begin - sample.start[path]).astype(np.int32),
        "bundle_id": segments.bundle,
        "class": classes[path],
        "contribution": sample.contribution[path],
    }
    for name, values in cells.items():
        mesh.cell_data[name] = values
    mesh.add_field_data(words, "classes")
    mesh.add_field_data(bundle_names(run, sample, segments), "bundles")
    return mesh


def _weights(sample: "PathSample") -> F32:
    """How strongly each path is drawn, 0 … 1, float32 (n): the square root of its contribution's luminance, relative to that of bright paths."""
    from queries.priority import by_luminance

    light = by_luminance(sample.contribution)
    bright = float(np.quantile(light, _BRIGHT)) or float(light.max(initial=0)) or 1.0
    return np.sqrt(np.minimum(light / bright, 1)).astype(np.float32)


def _counts(sample: "PathSample") -> dict[str, float | int | str]:
    return {"paths_found": sample.found, "paths_drawn": len(sample)}
