"""The share of light that ``max_depth`` cuts, estimated by tracing some of a run's walks again, and deeper.

Random numbers depend on walk and depth alone, so a walk that is traced with a larger limit repeats itself up to the old one, bit for bit,
and then goes on: what it finds beyond is what was cut. Only walks that the limit ended can find more. Of these, some are chosen by the hash
that also chooses which walks are recorded, and what they find on average is taken to be what all of them would (hajek1971).
"""

import dataclasses
import json
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from pipeline.config import Job
from pipeline.errors import JobError
from pipeline.identity import scene_digest
from pipeline.job_file import LoadedJob
from pipeline.prepare import compile_scene, with_texture_filter
from queries.diagnostics.answers import INTEGER, REAL, TEXT, Figure, answer, pixels_of, require_paths
from queries.diagnostics.depths import segments
from queries.errors import QueryError
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.statistics import Units, verdicts
from queries.tally import Tally
from renderer.errors import SceneError
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import UNBOUNDED_DEPTH, TraceSettings
from renderer.tables import DEPTH_LIMIT, PATHS
from renderer.trace import Tracer, Write, mark_recorded

F64 = npt.NDArray[np.float64]
U64 = npt.NDArray[np.uint64]
MOST_WALKS = 100_000  # that are traced again, about
_LOST = 0.01  # share of the walks that may come out differently, as the last bits of another processor's numbers do

FIGURES = (
    Figure("max_depth", INTEGER, "the run's limit, segments"),
    Figure("traced_to", INTEGER, "the limit of the walks that were traced again, segments"),
    Figure("ended", INTEGER, "recorded walks that the run's limit ended"),
    Figure("replayed", INTEGER, "how many of them were traced again"),
    Figure("deepest", INTEGER, "segments of the deepest path that they found"),
    Figure("energy", REAL, "the image's mean luminance, of linear sRGB"),
    Figure("cut", REAL, "what the limit cuts off it, luminance"),
    Figure("standard_error", REAL, "standard error of `cut`; NULL where it cannot be trusted"),
    Figure("share", REAL, "`cut` over `energy` + `cut`, 0 … 1"),
    Figure("share_error", REAL, "standard error of `share`; NULL where it cannot be trusted"),
    Figure("units", INTEGER, "independent units (replicates, passes or groups of walks) that standard errors rest on"),
    Figure("verdict", TEXT, "why the estimate of the error cannot be trusted; NULL where it can"),
)


def cut(run: Run, most: int = MOST_WALKS, traced_to: int = UNBOUNDED_DEPTH, scene: Scene | None = None) -> pa.Table:
    """Estimate what ``max_depth`` cuts (columns: ``FIGURES``; one row).

    About ``most`` walks, or all if there are fewer, are traced again up to ``traced_to`` segments. ``scene``: the run's, if it is at hand. Raises
    ``QueryError`` for a run without paths or a limit that is no deeper, ``JobError`` where the scene is no longer there as it was.
    """
    require_paths(run)
    limit = int(run.settings["max_depth"])
    if not limit <= traced_to <= UNBOUNDED_DEPTH or (traced_to == limit < UNBOUNDED_DEPTH):
        raise QueryError(f"the run's max_depth is {limit}: expected a depth from {limit + 1} to {UNBOUNDED_DEPTH}, found {traced_to}")
    units = Units.of_run(run)
    ended, walks = choose_walks(run, units, most)
    whole = _whole(run, units).sums[0]
    beyond = Tally(1, units)
    deepest, reason = 0, ""
    unknown = traced_to == limit and ended.any()
    if unknown:
        reason = f"the run's max_depth is {limit} segments, the most that can be traced"
    elif not ended.any():
        reason = "no recorded walk was ended by max_depth"
    else:
        deepest = _trace_beyond(run, walks, traced_to, scene or run_scene(run), beyond)
        reason = units.reason or verdicts(beyond.moments)[0]
    sums = (beyond.sums[0], ended, np.bincount(units.of_walks(walks), minlength=units.count).astype(np.float64))
    found = units.jackknife(lambda *totals: _of_all(*totals) * units.scale, *sums)
    part = units.jackknife(lambda *totals: _of_all(*totals[:3]) / (_of_all(*totals[:3]) + totals[3]), *sums, whole)
    trusted, known = (np.nan if reason else 1.0), (np.nan if unknown else 1.0)
    pixels = pixels_of(run)
    values = {
        "max_depth": [limit],
        "traced_to": [traced_to],
        "ended": [int(ended.sum())],
        "replayed": [0 if unknown else len(walks)],
        "deepest": [deepest or None],
        "energy": [float(units.total(whole).value) / pixels],
        "cut": [float(found.value) / pixels * known],
        "standard_error": [float(found.error) / pixels * trusted],
        "share": [float(part.value) * known],
        "share_error": [float(part.error) * trusted],
        "units": [units.count],
        "verdict": [reason or None],
    }
    return answer(FIGURES, values)


def _of_all(light: F64, ended: F64, replayed: F64) -> F64:
    """What all ended walks would find, from what the replayed ones found."""
    return np.where(ended > 0, light * ended / replayed, 0.0)


# --- which walks --------------------------------------------------------------------------------------------------


def choose_walks(run: Run, units: Units, most: int) -> tuple[F64, U64]:
    """How many recorded walks the limit ended, float64 (units); and the ids of some of them, about ``most``, uint64, ascending."""
    if most < 1:
        raise QueryError(f"expected at least one walk to trace again, found most = {most}")

    def count(pieces: Iterator[Piece]) -> F64:
        found = np.zeros(units.count)
        for piece in pieces:
            found += np.bincount(units.of_walks(_ended(run, piece)), minlength=units.count)
        return found

    ended = np.sum(list(map_shards(run.shard_files, count, run.threads)), axis=0)
    share = min(1.0, most / max(ended.sum(), 1.0))

    def choose(pieces: Iterator[Piece]) -> U64:
        return np.concatenate([np.zeros(0, np.uint64), *(_chosen(_ended(run, piece), share * run.settings["keep"]) for piece in pieces)])

    return ended, np.concatenate([np.zeros(0, np.uint64), *map_shards(run.shard_files, choose, run.threads)])


def _ended(run: Run, piece: Piece) -> U64:
    """The walks of a piece that the limit ended: uint64, ascending."""
    table = "light_vertices" if run.settings["method"] == "light" else "camera_vertices"
    event = piece.column(table, "event")
    last = event == DEPTH_LIMIT
    if table == "light_vertices" and run.settings["max_depth"] == 1:
        last = piece.column(table, "depth") == 0  # no walk was let off its emitter
    return np.asarray(piece.column(table, "walk")[last], np.uint64)


def _chosen(walks: U64, share: float) -> U64:
    """Those walks that a run would have recorded with this ``keep``."""
    if share >= 1.0 or not len(walks):
        return walks
    kept = np.empty(len(walks), np.uint8)
    mark_recorded(walks, len(walks), np.uint64(int(share * 2.0**64)), kept)
    return np.asarray(walks[kept != 0])


# --- the scene ----------------------------------------------------------------------------------------------------


def run_scene(run: Run) -> Scene:
    """The scene that a run was traced in, compiled anew: from the job's files, or else from the description that the run keeps.

    Raises ``JobError`` where neither gives the same scene, down to the last bit.
    """
    failures = []
    for source in (_from_job, _from_description):
        try:
            scene = source(run)
        except (SceneError, JobError, OSError, ValueError, KeyError) as error:
            failures.append(str(error))
            continue
        if scene_digest(scene) == run.manifest.get("fingerprint", {}).get("scene"):
            return scene
    why = f" ({failures[0]})" if failures else ""
    raise JobError(f"the scene of `{run.path}` has changed since it was rendered{why}: walks can be traced again only in the same scene")


def _loaded(run: Run) -> LoadedJob:
    file = pathlib.Path(run.manifest["job_file"])
    return LoadedJob(Job.model_validate(run.manifest["job"]), file, str(file), {})


def _from_job(run: Run) -> Scene:
    return compile_scene(_loaded(run))


def _from_description(run: Run) -> Scene:
    loaded = _loaded(run)
    folder = loaded.folder if isinstance(loaded.scene, dict) else pathlib.Path(loaded.scene).parent
    scene = load_scene(json.loads(run.tables["run"]["scene"][0].as_py()), base=folder.absolute())
    return with_texture_filter(scene, loaded.job)


# --- tracing again ------------------------------------------------------------------------------------------------


def trace_again(run: Run, walks: U64, max_depth: int, scene: Scene, write: Write) -> None:
    """Trace some of a run's walks with another ``max_depth`` (segments), and hand the rows to ``write``: see ``Tracer.trace``."""
    known: dict[str, Any] = {**run.settings, "columns": frozenset(run.settings["columns"])}
    settings = dataclasses.replace(TraceSettings(**known), max_depth=max_depth, keep=1.0, occluded=False)
    Tracer(scene, settings).trace(walks, write, None)


def _trace_beyond(run: Run, walks: U64, max_depth: int, scene: Scene, beyond: Tally) -> int:
    """Add what walks find beyond the run's limit to a tally; the segments of the deepest path."""
    limit = int(run.settings["max_depth"])
    last = limit if run.settings["method"] == "path" else limit - 1  # the vertex where the limit ended them
    deepest, back = 0, 0

    def write(table: str, batch: pa.RecordBatch) -> None:
        nonlocal deepest, back
        piece = Piece({table: batch}, 0)
        if table.endswith("_vertices"):
            back += int(np.count_nonzero(piece.column(table, "depth") == last))
        elif table == PATHS.name:
            count = segments(piece)
            deepest = max(deepest, int(count.max(initial=0)))
            beyond.add(piece, np.where(count > limit, 0, -1).astype(np.int32))

    trace_again(run, walks, max_depth, scene, write)
    if back < (1.0 - _LOST) * len(walks):
        raise JobError(
            f"{len(walks) - back:,} of {len(walks):,} walks of `{run.path}` come out differently when they are traced again: "
            "it was rendered by another version of the renderer. Render the run again"
        )
    return deepest


def _whole(run: Run, units: Units) -> Tally:
    """All of the run's light, by unit."""

    def work(pieces: Iterator[Piece]) -> Tally:
        tally = Tally(1, units)
        for piece in pieces:
            tally.add(piece, np.zeros(piece.rows("paths"), np.int32))
        return tally.compact()

    whole = Tally(1, units)
    for part in map_shards(run.shard_files, work, run.threads):
        whole.merge(part)
    return whole
