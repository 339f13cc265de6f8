"""Files that a description names: where they are, and files of installed packages."""

import importlib.resources
import pathlib
from collections.abc import Sequence

from renderer.errors import SceneError
from renderer.scene.description import Value
from renderer.scene.reader import Reader

PACKAGE = "package:"


class Paths:
    """Folders in which relative file names are looked up, the description's own first."""

    def __init__(self, folders: Sequence[pathlib.Path]) -> None:
        self.folders = list(folders)

    def find(self, name: str, place: str) -> pathlib.Path:
        """The file that a name means.

        ``package:pyvista/examples/nut.ply`` is a file of an installed Python package; anything else is a path.
        """
        if "\0" in name or not name:
            raise SceneError(f"{name!r} is not a file name", place)
        if name.startswith(PACKAGE):
            return package_file(name, place)
        tried = [folder.absolute() / name for folder in self.folders]
        try:
            found = [path for path in tried if path.is_file()]
        except OSError as error:
            raise SceneError(f"cannot look for the file {name!r:.100}: {error.strerror}", place) from None
        if not found:
            raise SceneError(f"there is no file {name!r}; looked for {' and '.join(str(path) for path in tried)}", place)
        return found[0].resolve()

    def file(self, reader: Reader) -> tuple[pathlib.Path, str]:
        """The file that a node's ``filename`` means, and where it is named. The node then has the absolute path."""
        name = reader.text("filename")
        place = reader.node.properties["filename"].place
        path = self.find(name, place)
        reader.node.properties["filename"] = Value(str(path), place)
        return path, place


def package_file(name: str, place: str) -> pathlib.Path:
    """The file that ``package:<package>/<path>`` means."""
    package, _, inner = name.removeprefix(PACKAGE).partition("/")
    try:
        path = pathlib.Path(str(importlib.resources.files(package).joinpath(inner)))
    except (ModuleNotFoundError, ValueError, TypeError):
        raise SceneError(f"there is no installed Python package {package!r} (in {name!r})", place) from None
    if not path.is_file():
        raise SceneError(f"the package {package!r} has no file {inner!r}", place)
    return path.resolve()
