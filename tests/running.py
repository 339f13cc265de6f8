"""How tests run jobs whose tables they ask questions of: with one specialization of the kernels for all scenes."""

import contextlib
import pathlib
from collections.abc import Iterator, Sequence

import pytest
from rendering import all_features

import pipeline.stages
import renderer.trace
from pipeline.run_folder import RunFolder
from renderer.scene.arrays import SceneArrays
from renderer.textures.pixel_filter import with_memory


@contextlib.contextmanager
def shared_kernels() -> Iterator[None]:
    """Here kernels know every optional piece of a scene: compiling them anew for each small scene would take longer than all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(renderer.trace, "with_memory", shared)
        yield


def run_job(path: pathlib.Path, overrides: Sequence[str] = (), out: pathlib.Path | None = None, threads: int | None = None) -> RunFolder:
    """``pipeline.stages.run_job`` with shared kernels; what they find is the same up to rounding."""
    with shared_kernels():
        return pipeline.stages.run_job(path, overrides, out=out, threads=threads)


def shared(arrays: SceneArrays) -> SceneArrays:
    """The arrays of a scene for the shared specialization; those of a scene with a lens or an elliptical filter are left as they are."""
    arrays = with_memory(arrays)
    return arrays if arrays.ewa is not None or arrays.sensor.lens_radius is not None else all_features(arrays)
