"""Runs of random walks from either end, and the word and the places of whatever arrives at each vertex, in plain Python."""

import json
import pathlib
import random
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from placed import EYE, INFINITE, REGIONS, Point, _point, _single, inside, places
from synthetic import EMITTERS, OBJECTS, WordTree, _catalogues, _letters, _write, event_of

from queries.lpe.syntax import PathEvent
from renderer import tables
from renderer.tables import ABSORBED, CAMERA_ROOT, DEPTH_LIMIT, EMITTER, ESCAPED, LENS, LIGHT_ROOT, NO_OBJECT, ROULETTE

WIDTH, HEIGHT, PASSES = 7, 5, 6
FAR = 1000.0


@dataclass
class WalkRun:
    """A run folder; for each row, its events as a path with the receiver at the other end (none at depth 0), and the regions of its interactions."""

    folder: pathlib.Path
    rows: list[dict[str, Any]] = field(default_factory=list)
    words: list[tuple[PathEvent, ...]] = field(default_factory=list)
    reached: list[set[str]] = field(default_factory=list)


def make_walks(folder: pathlib.Path, side: str, seed: int, emitters: tuple[int, ...] = (0, 1, 2, 3), lens: bool = False, shards: int = 3) -> WalkRun:
    """Write a run of random walks; ``emitters``: those that light walks leave; ``lens``: camera walks begin at a recorded point of the lens."""
    generator, tree, run = random.Random(seed), WordTree(random.Random(seed + 1)), WalkRun(folder)
    known = {"method": {"light": "light", "camera": "path"}[side], "width": WIDTH, "height": HEIGHT, "passes": PASSES, "keep": 1.0, "filter": "box"}
    table = tables.LIGHT_VERTICES if side == "light" else tables.CAMERA_VERTICES
    schema = table.schema(tuple(column.name for column in table.columns if not column.optional))
    per_shard, total = WIDTH * HEIGHT * PASSES // shards, 0
    for name in ("tables", "shards"):
        (folder / name).mkdir(parents=True)
    for shard in range(shards):
        found = [row for walk in range(shard * per_shard, (shard + 1) * per_shard) for row in _walk(run, tree, generator, side, walk, emitters, lens)]
        file = f"tables/{table.name}/{shard:05d}.arrow"
        total += len(found)
        record = {"files": {file: _write(folder / file, pa.Table.from_pylist(found, schema))}}
        (folder / "shards" / f"{shard:05d}.json").write_text(json.dumps(record))
    words = pa.Table.from_pylist(tree.rows(), tables.WORDS.schema(tuple(c.name for c in tables.WORDS.columns)))
    catalogues = _catalogues() | {"words": words}
    kept = catalogues["emitters"].append_column("infinite", pa.array(INFINITE))
    catalogues["emitters"] = kept.take(list(emitters)) if side == "light" else kept
    matrix = np.eye(4)
    matrix[:3, 3] = EYE
    manifest = {
        "name": "walks", "status": "complete", "settings": known, "shards": {"count": shards, "walks": per_shard},
        "rows": {table.name: total, "words": words.num_rows}, "camera": {"to_world": matrix[:3].tolist()}, "job": {"regions": REGIONS},
        "catalogues": {name: _write(folder / "tables" / f"{name}.arrow", found) for name, found in catalogues.items()},
    }  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return run


def _walk(
    run: WalkRun, tree: WordTree, generator: random.Random, side: str, walk: int, emitters: tuple[int, ...], lens: bool
) -> list[dict[str, Any]]:
    letters = _letters(generator, generator.choice([0, 1, 1, 2, 3, 4, 5]))
    tree.add(LIGHT_ROOT if side == "light" else CAMERA_ROOT, letters)
    emitter = generator.choice(emitters)
    thing = EMITTERS[emitter][1]
    rows: list[tuple[int, int, int, Point]] = []
    if side == "light" or lens:
        owner = NO_OBJECT if thing is None or side == "camera" else thing
        rows.append((0, EMITTER if side == "light" else LENS, owner, _point(generator)))
    rows += [(depth, event, thing, _point(generator)) for depth, (event, thing) in enumerate(letters, start=1)]
    end = generator.choice([None, ABSORBED, ESCAPED, ROULETTE, DEPTH_LIMIT])
    if end == ESCAPED:
        way = np.array(_point(generator))
        rows.append((len(letters) + 1, ESCAPED, NO_OBJECT, _single(list(way / np.linalg.norm(way)))))
    elif end is not None:
        rows.append((len(letters) + 1, end, generator.randrange(len(OBJECTS)), _point(generator)))
    dark = side == "light" and INFINITE[emitter]
    found = []
    for depth, event, thing, point in rows:
        color = [0.0 if depth == 0 and dark else np.float32(generator.uniform(0.1, 2)).item() for _ in range(3)]
        colors = dict(zip(("throughput_r", "throughput_g", "throughput_b"), color))
        found.append({"walk": walk, "depth": depth, "event": event, "object": thing, **dict(zip("xyz", point)), **colors})
    run.rows += found
    for count in range(len(rows)):
        there = rows[: count + 1]
        run.words.append(_arrived(side, there, emitter) if there[-1][0] else ())
        met = [row for row in there if row[0] > 0 and row[1] != ESCAPED]
        run.reached.append({name for name in REGIONS for row in met if inside(name, row[3], OBJECTS[row[2]][0])})
    return found


def _arrived(side: str, rows: list[tuple[int, int, int, Point]], emitter: int) -> tuple[PathEvent, ...]:
    """The events of a path that ends at the last of these rows."""
    name, owner, symbol = EMITTERS[emitter]
    points = [row[3] for row in rows]
    _, event, thing, end = rows[-1]
    start = points[-2] if len(points) > 1 else EYE
    gone = event == ESCAPED
    if gone:
        points[-1] = end = _beyond(start, end)
    here = set() if gone else {("region", region) for region in REGIONS if inside(region, end, OBJECTS[thing][0])}
    inner = [row for row in rows[:-1] if row[0] > 0]
    if side == "camera":
        eye = {("region", region) for region in REGIONS if inside(region, EYE, None)}
        events = [PathEvent("C", None, (), frozenset(eye))]
        ways = list(zip([EYE, *points] if rows[0][0] else points, points if rows[0][0] else points[1:]))
        for row, (a, b) in zip(inner, ways):
            events.append(_scattered(row, a, b))
        crossed = {fact for fact in places(*ways[-1], None, None) if fact[0] == "crosses"}
        return (*events, PathEvent("L", None, (), frozenset(here | crossed)))
    events = [PathEvent("C", None, (), frozenset(here))]
    for row, to in reversed(list(zip(inner, points[2:]))):
        events.append(_scattered(row, to, row[3]))
    labels, facts = [name] if name else [], {("light", name)} if name else set()
    if owner is not None:
        labels += OBJECTS[owner]
        facts |= {("object", OBJECTS[owner][0]), ("material", OBJECTS[owner][1]), ("light", OBJECTS[owner][0])}
    first = points[0]
    at: Point | None = first
    if INFINITE[emitter]:
        at, first = None, _beyond(points[1], tuple(np.array(first) - points[1]))
    found = places(points[1], first, at, OBJECTS[owner][0] if owner is not None else None)
    return (*events, PathEvent(symbol, None, tuple(labels), frozenset(facts | found)))


def _scattered(row: tuple[int, int, int, Point], start: Point, end: Point) -> PathEvent:
    """An interaction: its segment leads from ``start``, on the camera's side, to ``end``."""
    event = event_of((row[1], row[2]))
    assert event.facts is not None
    return event._replace(facts=event.facts | places(start, end, row[3], OBJECTS[row[2]][0]))


def _beyond(start: Point, way: Point) -> Point:
    x, y, z = (np.array(start) + FAR * np.array(way) / np.linalg.norm(way)).tolist()
    return x, y, z
