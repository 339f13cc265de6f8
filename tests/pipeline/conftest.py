import pathlib

import pytest
from tiny_job import write_job

from pipeline.stages import run_job


@pytest.fixture(scope="session")
def tiny_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A finished run of the tiny job. Read it, or copy it; never change it."""
    folder = tmp_path_factory.mktemp("tiny")
    return run_job(write_job(folder), out=folder / "run", threads=2).path
