"""Pictures that others drew, as the report shows them."""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from queries.run import Run


@dataclass(frozen=True)
class Picture:
    """A picture and what is to be said of it.

    ``file``: a PNG (or GIF); ``alt``: what it shows, for those who do not see it; ``figures``: quantities by name; ``files``: what else belongs to
    it, by kind (gif, vtp, glb), which is copied beside it and linked.
    """

    name: str
    caption: str
    alt: str
    file: pathlib.Path
    figures: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, pathlib.Path] = field(default_factory=dict)


def run_views(run: Run) -> list[Picture]:
    """The views that a run's job had drawn, of those whose pictures are there.

    The manifest's ``views`` holds for each name ``caption``, ``alt``, ``figures`` and ``files``: by kind, paths inside the run folder, as text
    or as records with a ``file``.
    """
    found: list[Picture] = []
    for name, known in (run.manifest.get("views") or {}).items():
        files = {kind: _path(run, name, kind, given) for kind, given in (known.get("files") or {}).items()}
        there = {kind: path for kind, path in files.items() if path.is_file()}
        if shown := there.get("gif", there.get("png")):
            caption = known.get("caption") or name
            rest = {kind: path for kind, path in there.items() if path != shown}
            found.append(Picture(name, caption, known.get("alt") or caption, shown, known.get("figures") or {}, rest))
    return found


def _path(run: Run, name: str, kind: str, given: Any) -> pathlib.Path:
    """Where a file of a view lies."""
    if isinstance(given, str):
        return run.path / given
    named = given.get("file") if isinstance(given, Mapping) else None
    return run.path / (named or f"views/{name}.{kind}")
