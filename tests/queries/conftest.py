"""Runs that several test files ask questions of."""

import hashlib
import pathlib
from collections.abc import Callable

import pytest
from synthetic import SyntheticRun, make_run


@pytest.fixture(scope="session")
def path_run(tmp_path_factory: pytest.TempPathFactory) -> SyntheticRun:
    return make_run(tmp_path_factory.mktemp("path") / "run", "path", seed=1, passes=20, occluded=True)


@pytest.fixture(scope="session")
def light_run(tmp_path_factory: pytest.TempPathFactory) -> SyntheticRun:
    return make_run(tmp_path_factory.mktemp("light") / "run", "light", seed=2, passes=12)


@pytest.fixture(scope="session")
def both_run(tmp_path_factory: pytest.TempPathFactory) -> SyntheticRun:
    return make_run(tmp_path_factory.mktemp("both") / "run", "both", seed=3, passes=20)


@pytest.fixture(params=["path_run", "light_run", "both_run"])
def any_run(request: pytest.FixtureRequest) -> SyntheticRun:
    run: SyntheticRun = request.getfixturevalue(request.param)
    return run


@pytest.fixture
def fingerprint() -> Callable[[pathlib.Path], dict[str, str]]:
    """Checksums of every file of a folder."""

    def digests(folder: pathlib.Path) -> dict[str, str]:
        return {str(f.relative_to(folder)): hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(folder.rglob("*")) if f.is_file()}

    return digests
