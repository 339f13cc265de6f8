"""The light walks that irradiance, probes and fluence are estimated from: a run's own, or those of its pass for inspection."""

import contextlib
from collections.abc import Iterator

from queries.errors import QueryError
from queries.run import Run, open_run

FOLDER = "inspection"  # of the light pass, inside the run's folder


@contextlib.contextmanager
def walks_of(run: Run, side: str = "light") -> Iterator[Run]:
    """The run whose tables hold these walks: ``run`` itself, or the light pass that its job added.

    ``side``: "light", or "camera" where importance is asked for. Raises ``QueryError`` where there are none, with the line of the job that adds them.
    """
    if f"{side}_vertices" in run.tables and run.settings["keep"] > 0:
        yield run
    elif side == "light" and (run.path / FOLDER / "manifest.json").exists():
        with open_run(run.path / FOLDER, run.memory_limit, run.threads, regions=run.regions) as found:
            yield found
    elif side == "light":
        raise QueryError(
            f"`{run.path}` has no light walks, which this is estimated from: add `inspection: {{samples: 16}}` to the job and run it with --resume, "
            "or render with `method: light`, or ask for the importance of camera walks with `walks: camera`"
        )
    else:
        raise QueryError(f"`{run.path}` has no {side} walks: render with `method: path`, or ask for `walks: light`")
