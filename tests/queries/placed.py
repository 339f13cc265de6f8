"""Synthetic runs whose vertices have positions, and what every event of every path should be, places included, in plain Python."""

import json
import pathlib
import random
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from synthetic import EMITTERS, NAMES, OBJECTS, Letter, WordTree, _catalogues, _letters, _recorded, _stored_schema, _write, event_of

from queries.lpe.syntax import PathEvent
from renderer.tables import (
    CAMERA_ROOT,
    CONNECTION,
    EMITTER,
    EMITTER_HIT,
    EMITTER_SAMPLE,
    LENS,
    LENS_SAMPLE,
    LIGHT_ROOT,
    LIGHT_VERTICES,
    NO_OBJECT,
    WORDS,
)

Point = tuple[float, float, float]
EYE: Point = (0.25, -0.5, -3.0)
INFINITE = [name == "sky" for name, _, _ in EMITTERS]
REGIONS: dict[str, dict[str, Any]] = {
    "ball": {"sphere": {"center": [0.3, 0.2, 0.1], "radius": 0.6}},
    "far_ball": {"sphere": {"center": [0.0, 0.0, 3.5], "radius": 2.3}},
    "crate": {"box": {"min": [-1.0, -0.4, -0.5], "max": [0.1, 0.5, 0.7]}},
    "eye": {"sphere": {"center": list(EYE), "radius": 0.1}},
    "floor": {"object": "floor"},
}


@dataclass
class PlacedRun:
    """A run folder, and for each row of paths and of occluded its events with all facts."""

    folder: pathlib.Path
    words: dict[str, list[tuple[PathEvent, ...]]] = field(default_factory=lambda: {"paths": [], "occluded": []})
    rows: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {"paths": [], "occluded": []})


@dataclass
class Walk:
    """One walk: what it met and where; ``first``: where it begins."""

    letters: list[Letter]
    points: list[Point]
    throughputs: list[Point]
    first: Point | None
    emitter: int = 0


def make_placed_run(folder: pathlib.Path, method: str, seed: int, walks: int = 540, shards: int = 3, lens: bool = False) -> PlacedRun:
    """Write a run of random paths through a cube; ``lens``: camera walks begin at a recorded point of the lens."""
    generator, tree, run = random.Random(seed), WordTree(random.Random(seed + 1)), PlacedRun(folder)
    known = {"method": method, "width": 7, "height": 5, "passes": 4, "keep": 1.0, "filter": "box", "occluded": True}
    per_shard, totals = walks // shards, dict[str, int]()
    for name in ("tables", "shards"):
        (folder / name).mkdir(parents=True)
    kinds = _recorded(known) | ({"light_vertices": LIGHT_VERTICES} if method == "both" else {})
    for shard in range(shards):
        ids = range(shard * per_shard, (shard + 1) * per_shard)
        camera = {i: _walk(generator, generator.choice([0, 1, 2, 3, 4]) if method != "light" else 0, _lens(generator) if lens else None) for i in ids}
        light = {i: _walk(generator, generator.choice([0, 1, 2, 3]), _point(generator)) for i in ids}
        tables: dict[str, list[dict[str, Any]]] = {name: [] for name in kinds}
        for i in ids:
            other = i if method == "light" else i ^ 1  # light walks are not in the order of the camera walks that they join
            for path in range(generator.randrange(6)):
                _add_path(run, tree, generator, method, i, other, path, camera[i], light[other], tables)
            for side, given, start in (("camera", camera, LENS), ("light", light, EMITTER)):
                if f"{side}_vertices" in kinds:
                    tables[f"{side}_vertices"] += _vertices(i, given[i], start)
        files = {}
        for name, table in kinds.items():
            rows = pa.Table.from_pylist(tables[name], _stored_schema(table, known))
            totals[name] = totals.get(name, 0) + rows.num_rows
            files[f"tables/{name}/{shard:05d}.arrow"] = _write(folder / f"tables/{name}/{shard:05d}.arrow", rows)
        (folder / "shards" / f"{shard:05d}.json").write_text(json.dumps({"files": files}))
    words = pa.Table.from_pylist(tree.rows(), WORDS.schema(tuple(c.name for c in WORDS.columns)))
    catalogues = _catalogues() | {"words": words}
    catalogues["emitters"] = catalogues["emitters"].append_column("infinite", pa.array(INFINITE))
    matrix = np.eye(4)
    matrix[:3, 3] = EYE
    manifest = {
        "name": "placed", "status": "complete", "settings": known, "shards": {"count": shards, "walks": per_shard},
        "rows": totals | {"words": words.num_rows}, "camera": {"to_world": matrix[:3].tolist()}, "job": {"regions": REGIONS},
        "catalogues": {name: _write(folder / "tables" / f"{name}.arrow", table) for name, table in catalogues.items()},
    }  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return run


def _single(values: list[float]) -> Point:
    x, y, z = (np.float32(value).item() for value in values)
    return x, y, z


def _point(generator: random.Random) -> Point:
    return _single([generator.uniform(-1, 1) for _ in range(3)])


def _lens(generator: random.Random) -> Point:
    return _single([EYE[0] + generator.uniform(-0.2, 0.2), EYE[1] + generator.uniform(-0.2, 0.2), EYE[2]])


def _walk(generator: random.Random, length: int, first: Point | None) -> Walk:
    letters = _letters(generator, length)
    colors = [_single([generator.uniform(0.1, 1) for _ in range(3)]) for _ in range(length + 2)]
    return Walk(letters, [_point(generator) for _ in range(length)], colors, first, generator.randrange(len(EMITTERS)))


def _vertices(number: int, walk: Walk, start: int) -> list[dict[str, Any]]:
    rows = [] if walk.first is None else [(0, start, NO_OBJECT, walk.first)]
    rows += [(i + 1, event, thing, point) for i, ((event, thing), point) in enumerate(zip(walk.letters, walk.points))]
    if start == LENS:  # where a walk may have hit an emitter
        rows.append((len(walk.letters) + 1, EMITTER, NO_OBJECT, (0.0, 0.0, 0.0)))
    columns = ("throughput_r", "throughput_g", "throughput_b")
    return [
        {"walk": number, "depth": depth, "event": event, "object": thing, **dict(zip("xyz", point)), **dict(zip(columns, walk.throughputs[depth]))}
        for depth, event, thing, point in rows
    ]


def _add_path(
    run: PlacedRun, tree: WordTree, generator: random.Random, method: str, number: int, other: int, path: int, camera: Walk, light: Walk, tables: Any
) -> None:
    """One path over prefixes of the two walks."""
    technique = {"path": EMITTER_SAMPLE, "light": LENS_SAMPLE}.get(method, generator.choice([CONNECTION, EMITTER_SAMPLE, LENS_SAMPLE]))
    uses_light = technique in (LENS_SAMPLE, CONNECTION)
    near = [] if technique == LENS_SAMPLE else camera.letters[: generator.randint(0, len(camera.letters))]
    far = light.letters[: generator.randint(0, len(light.letters))] if uses_light else []
    if technique == EMITTER_SAMPLE and (len(near) == len(camera.letters) or not near) and (generator.random() < 0.5 or not near):
        technique = EMITTER_HIT  # by way of the walk's own lobes
    lobes = [generator.choice([8, 9, 10, 12]) for _ in range(2)]
    if near and technique != EMITTER_HIT:
        near = [*near[:-1], (lobes[0], near[-1][1])]
    if far:
        far = [*far[:-1], (lobes[1], far[-1][1])]
    emitter = light.emitter if uses_light else generator.randrange(len(EMITTERS))
    endpoint = _lens(generator) if technique == LENS_SAMPLE else _point(generator)
    if INFINITE[emitter] and not uses_light:
        endpoint = _single(list(np.array(endpoint) / np.linalg.norm(endpoint)))
    row = {
        "camera_walk": number, "light_walk": other, "path": path, "technique": technique, "camera_depth": len(near) + (technique == EMITTER_HIT),
        "light_depth": len(far), "camera_event": near[-1][0] if near and technique != EMITTER_HIT else EMITTER,
        "light_event": far[-1][0] if far else EMITTER, "camera_word": tree.add(CAMERA_ROOT, near), "light_word": tree.add(LIGHT_ROOT, far),
        "emitter": emitter, **{f"endpoint_{axis}": value for axis, value in zip("xyz", endpoint)},
        "raster_x": generator.uniform(0, 6.9), "raster_y": generator.uniform(0, 4.9),
        **{f"contribution_{c}": np.float32(generator.expovariate(1)).item() for c in "rgb"}, "mis_weight": generator.choice([1.0, 0.5, 0.25]),
        "blocker": generator.choice([NO_OBJECT, *range(len(OBJECTS))]),
    }  # fmt: skip
    table = "occluded" if generator.random() < 0.3 and technique != EMITTER_HIT else "paths"
    start = endpoint if technique == LENS_SAMPLE else camera.first or EYE
    chain = [*zip(near, camera.points), *reversed(list(zip(far, light.points)))]
    end = light.first if uses_light else endpoint
    assert end is not None
    tables[table].append(row)
    run.rows[table].append(row)
    run.words[table].append(_events(row, start, chain, end, table == "occluded"))


def _events(row: dict[str, Any], start: Point, chain: list[tuple[Letter, Point]], end: Point, blocked: bool) -> tuple[PathEvent, ...]:
    """The events of a path, from the camera outward."""
    camera = {("region", name) for name in REGIONS if inside(name, EYE, None)}
    events = [PathEvent("C", None, (), frozenset(camera))]
    at = start
    for letter, point in chain:
        event = event_of(letter)
        assert event.facts is not None
        events.append(event._replace(facts=event.facts | places(at, point, point, OBJECTS[letter[1]][0])))
        at = point
    name, thing, symbol = EMITTERS[row["emitter"]]
    technique = row["technique"]
    s = {EMITTER_HIT: 0, EMITTER_SAMPLE: 1}.get(technique, row["light_depth"] + 1)
    facts = {("technique", NAMES[technique]), ("s", str(s)), ("t", str(1 if technique == LENS_SAMPLE else row["camera_depth"] + 1)), ("light", name)}
    labels = (name, *(OBJECTS[thing] if thing is not None else ()))
    if thing is not None:
        facts |= {("object", OBJECTS[thing][0]), ("material", OBJECTS[thing][1]), ("light", OBJECTS[thing][0])}
    if blocked and row["blocker"] != NO_OBJECT:
        facts.add(("blocker", OBJECTS[row["blocker"]][0]))
    here: Point | None = end
    if INFINITE[row["emitter"]]:
        here = None
        # Light walks keep a point on a disk outside the scene, which the ray to infinity passes
        way = np.array(end) - (0 if technique in (EMITTER_HIT, EMITTER_SAMPLE) else np.array(at))
        end = tuple((np.array(at) + 1000 * way / np.linalg.norm(way)).tolist())
    owner = OBJECTS[thing][0] if thing is not None else None
    events.append(PathEvent(symbol, None, tuple(filter(None, labels)), frozenset(facts | places(at, end, here, owner))))
    return tuple(events)


def places(start: Point, end: Point, at: Point | None, thing: str | None) -> set[tuple[str, str]]:
    """The regions that hold an event at ``at`` on an object, and those that the segment to it crosses."""
    held = {("region", name) for name in REGIONS if at is not None and inside(name, at, thing)}
    return held | {("crosses", name) for name in REGIONS if name != "floor" and crossed(name, start, end)}


def inside(name: str, point: Point, thing: str | None) -> bool:
    """Whether a point on an object lies in a region."""
    ((kind, given),) = REGIONS[name].items()
    if kind == "object":
        return bool(thing == given)
    if kind == "sphere":
        return sum((a - b) ** 2 for a, b in zip(point, given["center"])) <= given["radius"] ** 2
    return all(low <= value <= high for low, value, high in zip(given["min"], point, given["max"]))


def crossed(name: str, start: Point, end: Point) -> bool:
    """Whether a segment has a point in a ball or a box."""
    ((kind, given),) = REGIONS[name].items()
    a, d = np.array(start), np.array(end) - np.array(start)
    if kind == "sphere":
        center = np.array(given["center"])
        along = np.clip((center - a) @ d / (d @ d), 0, 1) if d @ d > 0 else 0.0
        return bool(np.linalg.norm(a + along * d - center) <= given["radius"])
    near, far = 0.0, 1.0
    for axis in range(3):
        ends = sorted((bound[axis] - a[axis]) / d[axis] for bound in (given["min"], given["max"]))
        near, far = max(near, ends[0]), min(far, ends[1])
    return near <= far
