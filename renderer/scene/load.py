"""Scenes from files: a Mitsuba 3 XML, its dictionary as YAML, or the dictionary itself."""

import pathlib
from collections.abc import Mapping
from typing import Any

from renderer.errors import SceneError
from renderer.scene.arrays import Scene
from renderer.scene.compile import compile_scene
from renderer.scene.from_dict import node_from_dict
from renderer.scene.from_xml import read_xml
from renderer.scene.from_yaml import read_yaml
from renderer.scene.paths import Paths


def load_scene(
    source: str | pathlib.Path | Mapping[str, Any], parameters: Mapping[str, str] | None = None, base: pathlib.Path | None = None
) -> Scene:
    """Load and compile a scene.

    Args:
        source: a Mitsuba 3 ``.xml`` file, a YAML file with the dictionary of ``mi.load_dict``, or that dictionary.
        parameters: values of the XML's ``$parameters``, in place of its ``default`` ones.
        base: the folder that a dictionary's relative file names start from (a file's own folder otherwise).

    Raises:
        SceneError: whatever keeps the scene from being rendered, with its place.

    """
    if isinstance(source, Mapping):
        refuse_parameters(parameters, "a dictionary")
        return compile_scene(node_from_dict(source), Paths([base or pathlib.Path.cwd()]))
    path = pathlib.Path(source)
    try:
        if not path.is_file():
            raise SceneError(f"{str(path)!r} is a folder; expected a scene file" if path.is_dir() else f"there is no scene file {str(path)!r}")
    except (OSError, ValueError) as error:  # a name that no file can have
        raise SceneError(f"cannot open the scene file {str(path)!r:.200}: {error}") from None
    paths = Paths([base or path.parent])
    if path.suffix.lower() == ".xml":
        return compile_scene(read_xml(path, parameters or {}, paths), paths)
    refuse_parameters(parameters, "a YAML file")
    return compile_scene(read_yaml(path), paths)


def refuse_parameters(parameters: Mapping[str, str] | None, what: str) -> None:
    """Only XML files have parameters."""
    if parameters:
        raise SceneError(f"scene parameters ({', '.join(parameters)}) are for XML files; {what} has none")
