"""Pages and what lies beside them: templates in which everything is escaped, and pictures under names that are free."""

import pathlib
import re
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from queries.errors import QueryError
from viz.report.numbers import number, percent, seconds, size
from viz.report.picture import Picture
from viz.report.tables import heading

HERE = pathlib.Path(__file__).parent
_LARGEST_FILE = 40_000_000  # bytes, of what is copied: larger files stay where they are, and are named


@dataclass(frozen=True)
class Shown:
    """A picture inside the report: ``file`` and ``links`` (label, file, size) are relative to its folder; ``left``: files that were too large."""

    name: str
    caption: str
    alt: str
    file: str
    width: int
    height: int
    expression: str = ""
    figures: Sequence[tuple[str, str]] = ()
    links: Sequence[tuple[str, str, str]] = ()
    left: Sequence[str] = field(default_factory=tuple)


def environment() -> Any:
    """Templates, in which everything is escaped."""
    import jinja2

    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE / "templates"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    templates.filters |= {"number": number, "percent": percent, "seconds": seconds, "size": size, "slug": slug, "coded": coded}
    return templates


def copy_static(folder: pathlib.Path, names: Iterable[str]) -> None:
    """Copy style sheets and scripts beside a page."""
    for name in names:
        shutil.copyfile(HERE / "static" / name, folder / name)


def coded(text: str) -> Any:
    """Text whose parts in backticks are code; all of it escaped."""
    import markupsafe

    parts = [markupsafe.escape(part) for part in text.split("`")]
    return markupsafe.Markup("").join(markupsafe.Markup("<code>{}</code>").format(part) if i % 2 else part for i, part in enumerate(parts))


def slug(name: str) -> str:
    """A name as a file name and as an anchor: letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "picture"


class Copier:
    """Copies pictures into the folder of a page under names that are free. ``keep``: files that are linked where they lie, if that is there."""

    def __init__(self, work: pathlib.Path, keep: Iterable[pathlib.Path] = ()) -> None:
        self._work = work
        inside = [file for file in keep if file.resolve().is_relative_to(work.resolve())]
        self._kept = {file: file.resolve().relative_to(work.resolve()).as_posix() for file in inside}
        self._taken = {file.name for file in inside}

    def copy(self, source: pathlib.Path, stem: str, folder: str = "pictures") -> str:
        """Copy a file; where it lies now, relative to the page."""
        if source in self._kept:
            return self._kept[source]
        name, count = f"{stem}{source.suffix.lower()}", 1
        while name in self._taken:
            count += 1
            name = f"{stem}-{count}{source.suffix.lower()}"
        self._taken.add(name)
        (self._work / folder).mkdir(exist_ok=True)
        try:
            shutil.copyfile(source, self._work / folder / name)
        except OSError as error:
            raise QueryError(f"the picture `{source}` cannot be read ({error.strerror}): draw it again") from None
        return f"{folder}/{name}"

    def picture(self, picture: Picture, kind: str) -> Shown:
        """Copy a picture and the files that belong to it."""
        stem = f"{kind}-{slug(picture.name)}"
        file = self.copy(picture.file, stem)
        small = {key: path for key, path in picture.files.items() if path.stat().st_size <= _LARGEST_FILE}
        stems = {key: f"{stem}-{slug(key)}" if path.suffix == ".png" else stem for key, path in small.items()}
        links = [(key, self.copy(path, stems[key]), size(path.stat().st_size)) for key, path in small.items()]
        left = [f"{path.name} ({size(path.stat().st_size)})" for key, path in picture.files.items() if key not in small]
        figures = [(heading(key), number(value) if isinstance(value, (int, float)) else str(value)) for key, value in picture.figures.items()]
        return Shown(picture.name, picture.caption, picture.alt, file, *picture_size(self._work / file), figures=figures, links=links, left=left)


def picture_size(file: pathlib.Path) -> tuple[int, int]:
    """Width and height of a picture, pixels. Raises QueryError where it cannot be read."""
    from PIL import Image

    try:
        with Image.open(file) as picture:
            return picture.size
    except OSError:
        raise QueryError(f"the picture `{file}` cannot be read: draw it again") from None
