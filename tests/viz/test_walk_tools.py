"""What tools that measure walks say of them: whether it is light or importance, in which units, and where it is not known."""

import pathlib

import pytest
from small_runs import small_run

from queries import Run, open_run
from viz.grids import Corners
from viz.look import Look
from viz.stage import Stage
from viz.tools.base import Drawn, WalkTool
from viz.tools.fluence import FluenceVolume
from viz.tools.particles import Particles

TOOLS = [FluenceVolume(resolution=8), Particles(resolution=8, most=50, color="fluence", least_anisotropy=0.05)]


def drawn_by(run: Run, tool: WalkTool, **fields: object) -> Drawn:
    with Stage(run, Look(scene="hidden"), (40, 30)) as stage:
        return tool.model_copy(update=fields).draw(run, stage)


@pytest.fixture(scope="module")
def sky(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A mesh under an environment light, traced from there."""
    return small_run("sky", tmp_path_factory.mktemp("sky"), "render.method=light")


@pytest.mark.parametrize("tool", TOOLS, ids=["fluence", "particles"])
def test_importance_is_not_called_flux(spheres_run: Run, tool: WalkTool) -> None:
    drawn = drawn_by(spheres_run, tool, walks="camera", expression="C D L")
    assert drawn.color_bar is not None
    assert drawn.color_bar.label == "importance in space (importance / world unit²)"
    assert "total_importance_times_length" in drawn.figures
    assert not any("flux" in name for name in drawn.figures)
    assert "of light" not in drawn.caption


@pytest.mark.parametrize("tool", TOOLS, ids=["fluence", "particles"])
def test_voxels_that_light_from_infinity_misses_are_told(sky: pathlib.Path, tool: WalkTool) -> None:
    with open_run(sky) as run:
        low, high = run.geometry.caster.bounds
        far = Corners(min=tuple((2 * low - high).tolist()), max=tuple((2 * high - low).tolist()))
        assert "show too little" not in drawn_by(run, tool).caption
        assert "show too little" in drawn_by(run, tool, box=far).caption
