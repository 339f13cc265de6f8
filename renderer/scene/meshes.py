"""Meshes from files."""

from renderer.scene.geometry import Mesh
from renderer.scene.paths import Paths
from renderer.scene.reader import Reader


def read_mesh(reader: Reader, paths: Paths) -> Mesh:
    """The mesh of a file."""
    raise reader.error("not yet")
