import pathlib
from collections.abc import Iterator

import pytest
from furnace import make_furnace
from small_runs import small_run

from queries import Run, open_run


@pytest.fixture(scope="session")
def small_folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Where small runs lie."""
    return tmp_path_factory.mktemp("small")


@pytest.fixture(scope="session")
def cornell_run(small_folder: pathlib.Path) -> Iterator[Run]:
    """The Cornell box, path traced. Never change it."""
    with open_run(small_run("cornell", small_folder)) as run:
        yield run


@pytest.fixture(scope="session")
def spheres_run(small_folder: pathlib.Path) -> Iterator[Run]:
    """A mirror and a glass ball in a room, path traced. Never change it."""
    with open_run(small_run("spheres", small_folder)) as run:
        yield run


@pytest.fixture(scope="session")
def spheres_light(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The folder of a run of the same room, traced from its lamp."""
    settings = ("method=light", "resolution=[64, 48]", "samples=16", "seed=3", "sampler=independent", "max_depth=5")
    return small_run("spheres", tmp_path_factory.mktemp("light"), *(f"render.{setting}" for setting in settings))


@pytest.fixture(scope="session")
def furnace(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The folder of a run of a closed room in which light is the same everywhere."""
    return make_furnace(tmp_path_factory.mktemp("furnace"))
