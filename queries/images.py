"""Images resolved from tables: contributions of paths, filtered as the film does, summed by pixel."""

import os
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError, RunError
from queries.lpe import Expression, compile
from queries.run import MEMORY_LIMIT, Run, open_run
from queries.sql import batches
from renderer.filters import reconstruction_filter

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
_CHUNK = 500_000  # rows that are filtered at a time
_MAPPED_ROWS = 2_000_000  # paths that are mapped at a time: some 200 MB of memory


def image(run: Run | str | os.PathLike[str], threads: int | None = None, memory_limit: str = MEMORY_LIMIT) -> F32:
    """The image of all recorded paths: float32 (height, width, 3), linear; see ``aov_image``."""
    return _resolve(run, None, threads, memory_limit)


def aov_image(run: Run | str | os.PathLike[str], expression: Expression | str, threads: int | None = None, memory_limit: str = MEMORY_LIMIT) -> F32:
    """The image of the paths that a light path expression matches: float32 (height, width, 3), linear.

    Images of expressions that partition the paths sum to ``image``. A run given by its path is gone through some shards at a
    time, so that memory does not grow with it, by so many threads within ``memory_limit``; with one thread, sums have the same
    bits each time. Raises ``ExpressionError`` for a bad expression.
    """
    return _resolve(run, compile(expression) if isinstance(expression, str) else expression, threads, memory_limit)


def _resolve(run: Run | str | os.PathLike[str], expression: Expression | None, threads: int | None, memory_limit: str) -> F32:
    if isinstance(run, Run):
        return _resolve_part(run, expression).astype(np.float32)
    with open_run(run, memory_limit, threads) as whole:
        groups = _shard_groups(whole)
        if len(groups) == 1:
            return _resolve_part(whole, expression).astype(np.float32)
        total = np.zeros((whole.settings["height"], whole.settings["width"], 3))
    for shards in groups:
        with open_run(run, memory_limit, threads, shards) as part:
            total += _resolve_part(part, expression)
    return total.astype(np.float32)


def _shard_groups(run: Run) -> list[range]:
    """The run's shards in runs of some ``_MAPPED_ROWS`` paths."""
    count: int = run.manifest["shards"]["count"]
    step = max(1, count * _MAPPED_ROWS // max(1, run.manifest["rows"].get("paths", 0)))
    return [range(first, min(first + step, count)) for first in range(0, count, step)]


def _resolve_part(run: Run, expression: Expression | None) -> F64:
    """What the open shards add to the image: float64 (height, width, 3)."""
    if run.settings["keep"] <= 0 or "paths" not in run.tables:
        raise QueryError(f"`{run.path}` recorded no paths (record.keep is none), so no image can be made of them: record some, as in `keep: 0.1`")
    columns = "p.raster_x, p.raster_y, p.contribution_r, p.contribution_g, p.contribution_b"
    rows = expression.sql(columns=columns, light_words=run.light_words) if expression else f"SELECT {columns} FROM paths AS p"
    if run.settings["filter"] == "box":
        sums = _box_sums(run, rows) / run.settings["passes"]
    else:
        sums = _filtered_sums(run, rows) / _weights(run)
    return np.asarray(sums / run.settings["keep"])


def _box_sums(run: Run, rows: str) -> F64:
    """Sums by pixel: float64 (height, width, 3)."""
    height, width = run.settings["height"], run.settings["width"]
    text = f"""SELECT floor(raster_y)::BIGINT * {width} + floor(raster_x)::BIGINT AS pixel,
        sum(contribution_r::DOUBLE) AS r, sum(contribution_g::DOUBLE) AS g, sum(contribution_b::DOUBLE) AS b FROM ({rows}) GROUP BY pixel"""
    found = run.connection.execute(text).fetchnumpy()
    sums = np.zeros((height * width, 3))
    for channel, name in enumerate("rgb"):
        sums[found["pixel"], channel] = found[name]
    return sums.reshape(height, width, 3)


def _filtered_sums(run: Run, rows: str) -> F64:
    """Sums of contributions by pixel, weighted by the run's filter about each pixel's center: float64 (height, width, 3)."""
    height, width = run.settings["height"], run.settings["width"]
    filter = reconstruction_filter(run.settings["filter"])
    table = filter.table().astype(np.float64)
    offsets = np.linspace(0.0, filter.radius, len(table))
    sums = np.zeros((3, height * width))
    for x, y, contribution in _samples(run, rows):
        first_x, first_y = np.ceil(x - filter.radius), np.ceil(y - filter.radius)
        for j in range(int(2 * filter.radius) + 1):
            pixel_y = first_y + j
            weight_y = np.interp(np.abs(pixel_y - y), offsets, table, right=0.0)
            for i in range(int(2 * filter.radius) + 1):
                pixel_x = first_x + i
                weight = weight_y * np.interp(np.abs(pixel_x - x), offsets, table, right=0.0)
                inside = (weight != 0) & (pixel_x >= 0) & (pixel_x < width) & (pixel_y >= 0) & (pixel_y < height)
                pixel = (pixel_y[inside] * width + pixel_x[inside]).astype(np.int64)
                for channel in range(3):
                    sums[channel] += np.bincount(pixel, weight[inside] * contribution[channel][inside], height * width)
    return np.ascontiguousarray(sums.T).reshape(height, width, 3)


def _samples(run: Run, rows: str) -> Iterator[tuple[F64, F64, list[F64]]]:
    """Film positions relative to pixel centers, and contributions, some rows at a time."""
    for batch in batches(run.connection, rows, _CHUNK):
        x, y, *contribution = (column.to_numpy().astype(np.float64) for column in batch.columns)
        yield x - 0.5, y - 0.5, contribution


def _weights(run: Run) -> F64:
    """What divides the filtered sums: the weights of all camera walks, which the film kept, or the filter's integral for light walks."""
    if run.settings["method"] != "path":
        weight: F64 = np.array(run.settings["passes"] * reconstruction_filter(run.settings["filter"]).integral ** 2)
        return weight
    file = run.path / "film" / "sum.npy"
    try:
        film = np.load(file, mmap_mode="r", allow_pickle=False)
        weights = np.array(film[: run.settings["height"], : run.settings["width"], 3:], np.float64)
    except (OSError, ValueError, IndexError) as error:
        raise RunError(f"`{file}`, which holds the weights of the run's filter, cannot be read ({error}): run the job again with --resume") from None
    return np.where(weights != 0, weights, 1.0)
