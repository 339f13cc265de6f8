"""Scenes that several test files share."""

import pathlib

import pytest

from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene

ROOT = pathlib.Path(__file__).parent.parent


@pytest.fixture(scope="session")
def cornell() -> Scene:
    """The measured Cornell box that the project ships."""
    return load_scene(ROOT / "configs" / "scenes" / "cornell.yaml")


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder for the meshes and images of test scenes."""
    return tmp_path_factory.mktemp("scenes")
