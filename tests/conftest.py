"""Scenes that several test files share."""

import copy
import pathlib

import pytest

from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene

ROOT = pathlib.Path(__file__).parent.parent


@pytest.fixture(scope="session")
def cornell() -> Scene:
    """The measured Cornell box that the project ships, on a film of 24 x 24 pixels."""
    description = copy.deepcopy(load_scene(ROOT / "configs" / "scenes" / "cornell.yaml").description)
    description["sensor"]["film"] |= {"width": 24, "height": 24}
    return load_scene(description)


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder for the meshes and images of test scenes."""
    return tmp_path_factory.mktemp("scenes")
