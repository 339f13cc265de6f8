"""A view drawn into files: pictures, an animation where there are several, and what was drawn as meshes."""

import pathlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.run import Run
from viz.cameras import MOST_FRAMES, CameraDescription, Pose, poses
from viz.description import View
from viz.exports import write_gltf, write_vtp
from viz.pictures import finished, message_picture, write_animation, write_png
from viz.stage import Stage

if TYPE_CHECKING:
    from viz.tools.base import Drawn

U8 = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class DrawnView:
    """What was written: ``files`` by kind (png, gif, vtp, gltf), ``frames`` of a sequence in order, the caption, and the figures of the tool."""

    caption: str
    files: dict[str, pathlib.Path]
    frames: tuple[pathlib.Path, ...] = ()
    figures: dict[str, Any] = field(default_factory=dict)


def draw_view(run: Run, view: View, folder: pathlib.Path, name: str) -> DrawnView:
    """Draw a view as ``<folder>/<name>.png``; a sequence also as ``<name>.gif`` and ``<name>/0000.png`` …; meshes as ``<name>.vtp`` and ``.glb``.

    The picture of a sequence is the one in its middle. Raises ``QueryError``, also where no picture can be drawn on this machine.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with Stage(run, view.look, view.size) as stage:
        drawn = view.tool.draw(run, stage)
        pictures = _pictures(run, view, stage, drawn)
        files = {"png": folder / f"{name}.png"}
        count = _count(run, view, stage, drawn)
        frames: tuple[pathlib.Path, ...] = ()
        if count == 1:
            write_png(files["png"], next(pictures))
        else:
            files["gif"] = folder / f"{name}.gif"
            frames = _write_sequence(pictures, count, files, folder / name, drawn.frame_seconds)
        files |= _write_meshes(view, drawn, folder / name)
    return DrawnView(drawn.caption, files, frames, dict(drawn.figures))


def _poses(run: Run, view: View, stage: Stage) -> list[Pose]:
    """Where the picture is taken from."""
    named = (run.manifest.get("job") or {}).get("cameras") or {}
    return poses(run, view.camera, {key: CameraDescription.model_validate(given) for key, given in named.items()}, stage.geometry)


def _count(run: Run, view: View, stage: Stage, drawn: "Drawn") -> int:
    """How many pictures there are: around an orbit, through time, or both at once."""
    if drawn.empty or drawn.image is not None:
        return 1
    return max(len(_poses(run, view, stage)), len(drawn.frames) or 1)


def _pictures(run: Run, view: View, stage: Stage, drawn: "Drawn") -> Iterator[U8]:
    """The finished pictures, one at a time."""
    if drawn.empty:
        yield finished(message_picture(view.size, "No light here"), drawn)
        return
    if drawn.image is not None:
        yield finished(drawn.image, drawn)
        return
    places = _poses(run, view, stage)
    steps: tuple[Callable[[], None], ...] = drawn.frames
    for i in range(max(len(places), len(steps) or 1)):
        if steps:
            steps[i % len(steps)]()
        note = drawn.frame_notes[i % len(steps)] if drawn.frame_notes else ""
        yield finished(stage.picture(places[i % len(places)]), drawn, note)


def _write_sequence(
    pictures: Iterator[U8], count: int, files: dict[str, pathlib.Path], folder: pathlib.Path, seconds: float
) -> tuple[pathlib.Path, ...]:
    """Write every picture as a PNG of its own, the middle one once more as the view's picture, and all of them as an animation."""
    folder.mkdir(exist_ok=True)
    for old in folder.glob("[0-9][0-9][0-9][0-9].png"):  # of a longer sequence; whatever else lies there is someone's
        if int(old.stem) < MOST_FRAMES:
            old.unlink()
    frames = tuple(folder / f"{i:04d}.png" for i in range(count))

    def written() -> Iterator[U8]:
        for i, picture in enumerate(pictures):
            write_png(frames[i], picture)
            if i == count // 2:
                write_png(files["png"], picture)
            yield picture

    write_animation(files["gif"], written(), seconds)
    return frames


def _write_meshes(view: View, drawn: "Drawn", stem: pathlib.Path) -> dict[str, pathlib.Path]:
    """Write what was drawn, where the view asks for it and there is something."""
    files: dict[str, pathlib.Path] = {}
    if "gltf" in view.export and drawn.meshes:
        files["gltf"] = stem.with_name(stem.name + ".glb")
        write_gltf(files["gltf"], drawn.meshes)
    if "vtp" in view.export:
        for part, mesh in drawn.meshes.items():
            key = "vtp" if len(drawn.meshes) == 1 else f"vtp {part}"
            files[key] = stem.with_name(f"{stem.name}.vtp" if len(drawn.meshes) == 1 else f"{stem.name}-{part}.vtp")
            write_vtp(files[key], mesh)
    return files
