"""Small runs made without a renderer: random walks, their words and paths, written as a run folder, and kept as plain Python beside it."""

import json
import pathlib
import random
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from words import dated, matches

from queries.lpe.syntax import Node, PathEvent
from renderer.filters import reconstruction_filter
from renderer.tables import (
    CAMERA_ROOT,
    CAMERA_VERTICES,
    CONNECTION,
    EMITTER,
    EMITTER_HIT,
    EMITTER_SAMPLE,
    EVENTS,
    FIRST_SCATTERING,
    LENS_SAMPLE,
    LIGHT_ROOT,
    LIGHT_VERTICES,
    NO_OBJECT,
    OCCLUDED,
    PATHS,
    TECHNIQUES,
    UNLIT,
    WORDS,
    Table,
)

OBJECTS = [("floor", "white"), ("wall", "white"), ("glass_ball", "glass"), ("lamp", "black"), ("o'brien", "a\\b")]
EMITTERS = [("lamp_light", 3, "L"), ("sky", None, "B"), ("glow", 1, "O"), ("spot", None, "L"), ("", None, "L")]  # the last has no name: no label
NAMES = {EMITTER_HIT: "hit", EMITTER_SAMPLE: "sample", LENS_SAMPLE: "lens", CONNECTION: "connection"}  # of techniques in expressions
SCATTERING = [event for event in EVENTS if event.key >= FIRST_SCATTERING]
CAMERA = PathEvent("C", None, (), frozenset())
_PLACE = ("x", "y", "z", "throughput_r", "throughput_g", "throughput_b")
Letter = tuple[int, int]  # key of the event, object
Tables = dict[str, list[dict[str, Any]]]  # rows by table


@dataclass
class SyntheticRun:
    """A run folder, and what should be found in it: for each path its word, film position and contribution."""

    folder: pathlib.Path
    words: list[tuple[PathEvent, ...]] = field(default_factory=list)
    rows: list[dict[str, Any]] = field(default_factory=list)
    occluded: list[dict[str, Any]] = field(default_factory=list)
    occluded_words: list[tuple[PathEvent, ...]] = field(default_factory=list)
    vertices: int = 0

    def matched(self, tree: Node, backward: bool = False) -> list[int]:
        """The rows of paths whose words match, by trying every path; ``backward`` reads them from the light."""
        return [i for i, word in enumerate(self.words) if matches(tree, dated(word)[::-1] if backward else word)]

    def image(self, rows: list[int], settings: dict[str, Any]) -> np.ndarray:
        """The image of some rows, pixel by pixel."""
        filter = reconstruction_filter(settings["filter"])
        weights = np.load(self.folder / "film" / "sum.npy")[..., 3]
        image = np.zeros((settings["height"], settings["width"], 3))
        for row in (self.rows[i] for i in rows):
            for y in range(settings["height"]):
                for x in range(settings["width"]):
                    if filter.name == "box":
                        weight = float(int(row["raster_x"]) == x and int(row["raster_y"]) == y)
                    else:
                        offset = np.abs(np.array([row["raster_x"] - x - 0.5, row["raster_y"] - y - 0.5]))
                        weight = float(np.prod(filter.weight(offset) * (offset < filter.radius)))
                    image[y, x] += weight * np.array([row[f"contribution_{c}"] for c in "rgb"])
        divisor = weights[..., None] if settings["method"] == "path" else settings["passes"] * filter.integral**2
        return image / (divisor * settings["keep"])


def event_of(letter: Letter) -> PathEvent:
    """What an expression sees of one interaction."""
    event, (name, material) = next(e for e in EVENTS if e.key == letter[0]), OBJECTS[letter[1]]
    return PathEvent(event.type, event.scattering, (name, material, event.lobe), frozenset({("object", name), ("material", material)}))


def emitter_of(row: dict[str, Any], blocked: bool = False) -> PathEvent:
    """What an expression sees of the emitter at the end of a path."""
    name, thing, symbol = EMITTERS[row["emitter"]]
    technique = row["technique"]
    s = {EMITTER_HIT: 0, EMITTER_SAMPLE: 1}.get(technique, row["light_depth"] + 1)
    t = 1 if technique == LENS_SAMPLE else row["camera_depth"] + 1
    facts = {("technique", NAMES[technique]), ("s", str(s)), ("t", str(t))}
    labels = [name]
    if thing is not None:
        labels += OBJECTS[thing]
        facts |= {("object", OBJECTS[thing][0]), ("material", OBJECTS[thing][1]), ("light", OBJECTS[thing][0])}
    if name:
        facts.add(("light", name))
    if blocked and row["blocker"] != NO_OBJECT:
        facts.add(("blocker", OBJECTS[row["blocker"]][0]))
    return PathEvent(symbol, None, tuple(label for label in labels if label), frozenset(facts))


class WordTree:
    """Words of walks: a random key for each prefix."""

    def __init__(self, random: random.Random) -> None:
        self.random = random
        self.keys: dict[tuple[int, int, int], int] = {}

    def add(self, root: int, letters: list[Letter]) -> int:
        """The key of a whole prefix."""
        word = root
        for event, thing in letters:
            word = self.keys.setdefault((word, event, thing), self.random.getrandbits(64))
        return word

    def rows(self) -> list[dict[str, int]]:
        """The table of words."""
        return [{"word": word, "parent": parent, "event": event, "object": thing} for (parent, event, thing), word in self.keys.items()]


def make_run(folder: pathlib.Path, method: str = "path", seed: int = 1, passes: int = 4, shards: int = 3, **settings: Any) -> SyntheticRun:
    """Write a run of random paths. ``method``: path, light, or both (connections of two walks)."""
    generator = random.Random(seed)
    known = {"method": method, "width": 7, "height": 5, "passes": passes, "keep": 1.0, "filter": "box", "occluded": False} | settings
    run, tree = SyntheticRun(folder), WordTree(generator)
    walks = known["width"] * known["height"] * passes
    per_shard = -(-walks // shards)
    film = np.zeros((known["height"], known["width"], 4))
    for name in ("tables", "shards", "film"):
        (folder / name).mkdir(parents=True)
    totals: dict[str, int] = {}
    for shard in range(shards):
        tables: Tables = {}
        for walk in range(shard * per_shard, min(walks, (shard + 1) * per_shard)):
            _add_walk(run, tree, generator, walk, known, tables, film)
        files = {}
        for name, table in _recorded(known).items():
            rows = tables.get(name, [])
            totals[name] = totals.get(name, 0) + len(rows)
            file = f"tables/{name}/{shard:05d}.arrow"
            files[file] = _write(folder / file, pa.Table.from_pylist(rows, _stored_schema(table, known)))
        record = {"shard": shard, "first": shard * per_shard, "count": per_shard, "counts": {}, "files": files}
        (folder / "shards" / f"{shard:05d}.json").write_text(json.dumps(record))
    np.save(folder / "film" / "sum.npy", film)
    run.vertices = totals.get("camera_vertices", 0) + totals.get("light_vertices", 0)
    words = pa.Table.from_pylist(tree.rows(), WORDS.schema(tuple(c.name for c in WORDS.columns)))
    catalogues = _catalogues() | {"words": words}
    manifest = {
        "format": 1,
        "name": "synthetic",
        "status": "complete",
        "settings": known,
        "shards": {"count": shards, "walks": per_shard},
        "rows": totals | {"words": words.num_rows},
        "catalogues": {name: _write(folder / "tables" / f"{name}.arrow", table) for name, table in catalogues.items()},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return run


def _letters(generator: random.Random, count: int) -> list[Letter]:
    """Random interactions."""
    return [(generator.choice(SCATTERING).key, generator.randrange(len(OBJECTS))) for _ in range(count)]


def _add_walk(
    run: SyntheticRun, tree: WordTree, generator: random.Random, walk: int, known: dict[str, Any], tables: Tables, film: np.ndarray
) -> None:
    """One walk: its vertices, and a few paths over its prefixes."""
    method = known["method"]
    raster = [np.float32(generator.uniform(0, known[size]) * (1 - 1e-6)).item() for size in ("width", "height")]
    _expose(film, raster, known)
    letters = _letters(generator, generator.choice([0, 1, 1, 2, 2, 3, 4]))
    vertices = "light_vertices" if method == "light" else "camera_vertices"
    for depth, (event, thing) in enumerate(letters, start=1):
        place = dict.fromkeys(_PLACE, float(depth))
        tables.setdefault(vertices, []).append({"walk": walk, "depth": depth, "event": event, "object": thing, **place})
    lit = len(run.rows)
    for path in range(generator.randrange(len(letters) + 2)):
        prefix = letters[:path]
        other = _letters(generator, generator.randrange(3)) if method == "both" else []
        emitter = generator.randrange(len(EMITTERS))
        technique = _technique(generator, method, prefix, other)
        hit = technique == EMITTER_HIT
        if prefix and not hit and generator.random() < 0.5:
            # The path ends with a lobe of its own, as a connection does.
            prefix = [*prefix[:-1], (generator.choice(SCATTERING).key, prefix[-1][1])]
        camera, light = ([], prefix) if method == "light" else (prefix, other)
        if hit and path == len(letters):
            # The walk ends at the emitter.
            thing = EMITTERS[emitter][1]
            there = {"event": EMITTER, "object": NO_OBJECT if thing is None else thing} | dict.fromkeys(_PLACE, float(path + 1))
            tables.setdefault(vertices, []).append({"walk": walk, "depth": path + 1, **there})
        row = {
            "camera_walk": walk,
            "light_walk": walk,
            "path": path,
            "technique": technique,
            "camera_depth": len(camera) + hit,
            "light_depth": len(light),
            "camera_event": camera[-1][0] if camera and not hit else EMITTER,
            "light_event": light[-1][0] if light else EMITTER,
            "camera_word": tree.add(CAMERA_ROOT, camera),
            "light_word": tree.add(LIGHT_ROOT, light),
            "emitter": emitter,
            "endpoint_x": 0.0,
            "endpoint_y": 1.0,
            "endpoint_z": 2.0,
            "raster_x": raster[0],
            "raster_y": raster[1],
            **{f"contribution_{c}": np.float32(generator.expovariate(1)).item() for c in "rgb"},
            "mis_weight": 0.5,
            "blocker": generator.choice([NO_OBJECT, *range(len(OBJECTS))]),
        }
        blocked = known["occluded"] and not hit and generator.random() < 0.4
        word = (CAMERA, *map(event_of, camera), *map(event_of, reversed(light)), emitter_of(row, blocked))
        (run.occluded if blocked else run.rows).append(row)
        (run.occluded_words if blocked else run.words).append(word)
        tables.setdefault("occluded" if blocked else "paths", []).append(row)
    if method == "path" and len(run.rows) == lit:
        tables.setdefault("unlit", []).append({"camera_walk": walk, "raster_x": raster[0], "raster_y": raster[1]})


def _technique(generator: random.Random, method: str, prefix: list[Letter], other: list[Letter]) -> int:
    """A technique that can make a path of such walks."""
    if method == "light" or (method == "both" and not prefix and generator.random() < 0.5):
        return LENS_SAMPLE
    return CONNECTION if other else generator.choice([EMITTER_HIT, EMITTER_SAMPLE])


def _expose(film: np.ndarray, raster: list[float], known: dict[str, Any]) -> None:
    """Add a walk's weights to the film, as the renderer does for every walk."""
    filter = reconstruction_filter(known["filter"])
    if filter.name == "box":
        # box images divide by the passes, which the film's own count equals where every pixel has its own walks
        film[..., 3] = known["passes"]
        return
    y = np.abs(raster[1] - 0.5 - np.arange(known["height"]))
    x = np.abs(raster[0] - 0.5 - np.arange(known["width"]))
    film[..., 3] += np.outer(filter.weight(y) * (y < filter.radius), filter.weight(x) * (x < filter.radius))


def _recorded(known: dict[str, Any]) -> dict[str, Table]:
    if known["keep"] == 0:
        return {}
    vertices = LIGHT_VERTICES if known["method"] == "light" else CAMERA_VERTICES
    found = {vertices.name: vertices, "paths": PATHS} | ({"occluded": OCCLUDED} if known["occluded"] else {})
    return found | ({"unlit": UNLIT} if known["method"] == "path" else {})


def _stored_schema(table: Table, known: dict[str, Any]) -> pa.Schema:
    """The columns that such a run stores."""
    absent = {"path": "light", "light": "camera"}.get(known["method"], "neither")
    skipped = {f"{absent}_{what}" for what in ("walk", "depth", "event", "word")} | ({"mis_weight"} if known["method"] == "light" else set())
    return table.schema(tuple(c.name for c in table.columns if c.name not in skipped and not c.optional))


def _catalogues() -> dict[str, pa.Table]:
    u8, u16 = pa.uint8(), pa.uint16()
    events = [{"key": e.key, "type": e.type, "scattering": e.scattering, "lobe": e.lobe} for e in EVENTS]
    objects = [{"object": i, "name": name, "material": material} for i, (name, material) in enumerate(OBJECTS)]
    emitters = [{"emitter": i, "name": name, "object": thing, "symbol": symbol} for i, (name, thing, symbol) in enumerate(EMITTERS)]
    text = pa.string()
    return {
        "events": pa.Table.from_pylist(events, pa.schema([("key", u8), ("type", text), ("scattering", text), ("lobe", text)])),
        "techniques": pa.table({"key": pa.array(range(len(TECHNIQUES)), u8), "name": list(TECHNIQUES)}),
        "objects": pa.Table.from_pylist(objects, pa.schema([("object", u16), ("name", text), ("material", text)])),
        "emitters": pa.Table.from_pylist(emitters, pa.schema([("emitter", u16), ("name", text), ("object", u16), ("symbol", text)])),
        "triangles": pa.table({"primitive": pa.array([0], pa.uint32()), "object": pa.array([0], u16)}),
        "run": pa.table({"name": ["synthetic"], "passes": pa.array([4], pa.uint32())}),
    }


def _write(file: pathlib.Path, table: pa.Table) -> dict[str, Any]:
    file.parent.mkdir(parents=True, exist_ok=True)
    with pa.ipc.new_file(str(file), table.schema) as writer:
        writer.write_table(table)
    return {"rows": table.num_rows, "bytes": file.stat().st_size, "xxh3": ""}
