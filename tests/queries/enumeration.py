"""Paths of a run one by one, in plain Python: what rankings and classes are compared with."""

import json
import pathlib
import random
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from synthetic import SyntheticRun

from queries import Run
from renderer.tables import CAMERA_ROOT, EMITTER_HIT, LIGHT_ROOT, LIGHT_VERTICES

Point = tuple[float, float, float]


@dataclass
class OnePath:
    """A path: the walk that owns it, its class, its luminance, and where its interactions are, from the camera outward."""

    walk: int
    letters: tuple[str, ...]
    objects: tuple[str | None, ...]
    luminance: float
    places: list[Point] = field(default_factory=list)


def luminance_of(row: dict[str, Any]) -> float:
    return float(0.2126 * row["contribution_r"] + 0.7152 * row["contribution_g"] + 0.0722 * row["contribution_b"])


def scatter(run: SyntheticRun, seed: int = 1) -> dict[tuple[str, int, int], Point]:
    """Move the vertices of a synthetic run to random places of the unit cube: places by (side, walk, depth).

    Paths of two walks have light letters without vertices; rows are written for them.
    """
    generator = random.Random(seed)
    places: dict[tuple[str, int, int], Point] = {}
    for file in sorted((run.folder / "shards").glob("*.json")):
        record = json.loads(file.read_text())
        walks = range(record["first"], record["first"] + record["count"])
        if any("camera_vertices" in name for name in record["files"]) and any(row["light_depth"] for row in run.rows):
            name = f"tables/light_vertices/{record['shard']:05d}.arrow"
            rows = [_light_vertex(walk, depth) for walk in walks for depth in (1, 2)]
            names = tuple(c.name for c in LIGHT_VERTICES.columns if not c.optional)
            record["files"][name] = _write(run.folder / name, pa.Table.from_pylist(rows, LIGHT_VERTICES.schema(names)))
            _count(run.folder, "light_vertices", len(rows))
        for name in record["files"]:
            if "_vertices" in name:
                table = pa.ipc.open_file(str(run.folder / name)).read_all()
                moved = np.array([[np.float32(generator.random()) for _ in range(3)] for _ in range(table.num_rows)], np.float32).reshape(-1, 3)
                for axis in range(3):
                    table = table.set_column(table.schema.get_field_index("xyz"[axis]), table.schema.field("xyz"[axis]), pa.array(moved[:, axis]))
                record["files"][name] = _write(run.folder / name, table)
                side = name.split("/")[1].removesuffix("_vertices")
                for walk, depth, point in zip(table["walk"].to_pylist(), table["depth"].to_pylist(), moved.tolist()):
                    places[side, walk, depth] = tuple(point)
        file.write_text(json.dumps(record))
    return places


def paths_of_synthetic(run: SyntheticRun, places: dict[tuple[str, int, int], Point]) -> list[OnePath]:
    found = []
    for row, word in zip(run.rows, run.words):
        letters = tuple(event.type + (event.scattering or "") for event in word)
        objects = tuple(event.labels[0] if event.labels else None for event in word)
        walk = row["camera_walk"]
        camera = [places.get(("camera", walk, depth)) for depth in range(1, row["camera_depth"] + 1 - (row["technique"] == EMITTER_HIT))]
        light = [places.get(("light", row["light_walk"], depth)) for depth in range(row["light_depth"], 0, -1)]
        points = [point for point in (*camera, *light) if point is not None]
        assert len(points) == len(letters) - 2
        found.append(OnePath(walk, letters, objects, luminance_of(row), points))
    return found


def paths_of_run(run: Run) -> list[OnePath]:
    """The paths of a real run, letter by letter from its tables."""
    words = {row["word"]: row for row in run.tables["words"].to_pylist()}
    events = {row["key"]: row["type"] + (row["scattering"] or "") for row in run.tables["events"].to_pylist()}
    names = run.tables["objects"]["name"].to_pylist()
    emitters = {row["emitter"]: row for row in run.tables["emitters"].to_pylist()}
    vertices = {}
    for side in ("camera", "light"):
        for row in run.tables[f"{side}_vertices"].to_pylist() if f"{side}_vertices" in run.tables else []:
            vertices[side, row["walk"], row["depth"]] = (row["x"], row["y"], row["z"])

    def spell(word: int | None, root: int) -> list[tuple[str, str]]:
        spelled = []
        while word is not None and word != root:
            spelled.append((events[words[word]["event"]], names[words[word]["object"]]))
            word = words[word]["parent"]
        return spelled

    found = []
    for row in run.tables["paths"].to_pylist():
        emitter = emitters[row["emitter"]]
        end = emitter["name"] or (names[emitter["object"]] if emitter["object"] is not None else None)
        middle = [*reversed(spell(row.get("camera_word"), CAMERA_ROOT)), *spell(row.get("light_word"), LIGHT_ROOT)]
        counts = {
            "camera": row.get("camera_depth", 0) - (row["technique"] == EMITTER_HIT and "camera_depth" in row),
            "light": row.get("light_depth", 0),
        }
        camera = [vertices["camera", row["camera_walk"], depth] for depth in range(1, counts["camera"] + 1)]
        light = [vertices["light", row["light_walk"], depth] for depth in range(counts["light"], 0, -1)]
        letters, objects = ("C", *(letter for letter, _ in middle), emitter["symbol"]), (None, *(thing for _, thing in middle), end)
        assert len(camera) + len(light) == len(middle)
        walk = row["camera_walk"] if "camera_walk" in row else row["light_walk"]
        found.append(OnePath(walk, letters, objects, luminance_of(row), [*camera, *light]))
    return found


def _light_vertex(walk: int, depth: int) -> dict[str, Any]:
    numbers = dict.fromkeys(("x", "y", "z", "throughput_r", "throughput_g", "throughput_b"), 0.0)
    return {"walk": walk, "depth": depth, "event": 8, "object": 0, **numbers}


def _write(file: pathlib.Path, table: pa.Table) -> dict[str, Any]:
    file.parent.mkdir(parents=True, exist_ok=True)
    with pa.ipc.new_file(str(file), table.schema) as writer:
        writer.write_table(table)
    return {"rows": table.num_rows, "bytes": file.stat().st_size, "xxh3": ""}


def _count(folder: pathlib.Path, name: str, rows: int) -> None:
    """Add to the manifest's number of rows."""
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["rows"][name] = manifest["rows"].get(name, 0) + rows
    (folder / "manifest.json").write_text(json.dumps(manifest))
