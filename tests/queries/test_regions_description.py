"""Regions as text: what is read, and what every mistake is told."""

import json
import pathlib
from typing import Any

import pytest
import yaml
from pydantic import BaseModel

from queries.errors import QueryError
from queries.regions import Box, Inside, Mesh, Polygon, RegionDescription, Sphere, Stroke, Surface, parse_region, region

GOOD: dict[str, Any] = {
    "{sphere: {center: [0, 1, 0.5], radius: 0.2}}": Sphere((0, 1, 0.5), 0.2),
    "{box: {min: [0, 0, 0], max: [1, 2, 4]}}": Box((0.5, 1, 2), (1, 2, 4)),
    "{box: {center: [0, 1, 0], size: [1, 2, 3]}}": Box((0, 1, 0), (1, 2, 3)),
    "{box: {center: [0, 1, 0], size: [1, 2, 3], rotate: {axis: [0, 1, 1], angle: -30}}}": Box((0, 1, 0), (1, 2, 3), (0, 1, 1), -30),
    "{object: glass}": Surface("glass"),
    "{object: {name: glass}}": Surface("glass"),
    "{object: {name: glass, part: surface}}": Surface("glass"),
    "{object: {name: glass, part: inside}}": Inside("glass"),
    "{mesh: room.ply}": Mesh(pathlib.Path("jobs/room.ply")),
    "{mesh: {file: ../room.ply, scale: 2, translate: [0, 1, 0]}}": Mesh(pathlib.Path("jobs/../room.ply"), 2, (0, 1, 0)),
    "{mesh: /room.ply}": Mesh(pathlib.Path("/room.ply")),
    "{stroke: {points: [[1, 2], [3, 4]], radius: 3}}": Stroke(((1, 2), (3, 4)), 3),
    "{polygon: [[0, 0], [10, 0], [10, 1e1]]}": Polygon((((0, 0), (10, 0), (10, 10)),)),
}

BAD: dict[str, str] = {
    "{}": "expected exactly one of `sphere`, `box`, `object`, `mesh`, `stroke`, `polygon`, found none",
    "": "expected a description, that is one of the keys `sphere`, .* found None",
    "glass": "expected a description, that is one of the keys `sphere`, .* found glass",
    "[1, 2]": r"expected a description, .* found \[1, 2\]",
    "{object: a, mesh: b}": "expected exactly one of .*, found `object`, `mesh`",
    "{spere: {center: [0, 0, 0], radius: 1}}": "unknown key `spere`: did you mean `sphere`?",
    "{1: 2}": "`1`: Keys should be strings, found 1",
    "{sphere: {center: [0, 0, 0]}}": "`sphere.radius` is missing",
    "{sphere: {center: [0, 0], radius: 1}}": "`sphere.center`: expected one value more",
    "{sphere: {center: [0, 0, 0, 0], radius: 1}}": "`sphere.center`: .*at most 3 items",
    "{sphere: {center: [0, 0, .nan], radius: 1}}": "`sphere.center.2`: expected a finite number, found nan",
    "{sphere: {center: [0, 0, .inf], radius: 1}}": "`sphere.center.2`: expected a finite number, found inf",
    "{sphere: {center: [0, 0, 1e30], radius: 1}}": r"`sphere.center.2`: expected a number of at most 1e\+18, found 1e\+30",
    "{sphere: {center: [0, 0, '1'], radius: 1}}": "`sphere.center.2`: expected a valid number, found 1",
    "{sphere: {center: [0, 0, true], radius: 1}}": "`sphere.center.2`: expected a valid number, found True",
    "{sphere: {center: origin, radius: 1}}": "`sphere.center`: expected a valid tuple, found origin",
    "{sphere: {center: [0, 0, 0], radius: 0}}": r"`sphere.radius`: expected a number above 0, of at most 1e\+18, found 0",
    "{sphere: {center: [0, 0, 0], radius: -2}}": "`sphere.radius`: expected a number above 0, .*found -2",
    "{sphere: {center: [0, 0, 0], radius: 1, radios: 2}}": "unknown key `sphere.radios`: did you mean `radius`?",
    "{sphere: 3}": "`sphere`: expected a .*dictionary.*found 3",
    "{box: {}}": "`box`: expected `min` and `max`, or `center` and `size` .*found neither",
    "{box: {min: [0, 0, 0]}}": "`box`: expected `min` and `max`, .*found `min`",
    "{box: {min: [0, 0, 0], size: [1, 1, 1]}}": "`box`: expected `min` and `max`, .*found `min`, `size`",
    "{box: {min: [0, 0, 0], max: [1, 1, 1], rotate: {axis: [1, 0, 0], angle: 3}}}": "found `max`, `min`, `rotate`",
    "{box: {min: [0, 0, 0], max: [1, 0, 1]}}": "`box`: expected each coordinate of `max` above that of `min`",
    "{box: {center: [0, 0, 0], size: [1, 0, 1]}}": "`box.size.1`: expected a number above 0",
    "{box: {center: [0, 0, 0], size: [1, 1, 1], rotate: {axis: [0, 0, 0], angle: 3}}}": r"`box.rotate`: expected an `axis` that is not \(0, 0, 0\)",
    "{box: {center: [0, 0, 0], size: [1, 1, 1], rotate: {axis: [0, 0, 1]}}}": "`box.rotate.angle` is missing",
    "{box: {center: [0, 0, 0], size: [1, 1, 1], rotate: {axis: [0, 0, 1], angle: 3, unit: 1}}}": "unknown key `box.rotate.unit`",
    "{object: ''}": "`object.name`: .*at least 1 character",
    "{object: {name: a, part: outside}}": "`object.part`: expected 'surface' or 'inside', found outside",
    "{object: 3}": "`object`: expected .*found 3",
    "{object: {part: inside}}": "`object.name` is missing",
    "{mesh: {scale: 2}}": "`mesh.file` is missing",
    "{mesh: {file: a.ply, scale: 0}}": "`mesh.scale`: expected a number above 0",
    "{mesh: {file: a.ply, translate: 3}}": "`mesh.translate`: expected a valid tuple, found 3",
    "{stroke: {points: [], radius: 3}}": "`stroke.points`: .*at least 1 item",
    "{stroke: {points: [[1, 2, 3]], radius: 3}}": "`stroke.points.0`: .*at most 2 items",
    "{stroke: {points: [[1, 2]]}}": "`stroke.radius` is missing",
    "{polygon: [[0, 0], [1, 1]]}": "`polygon`: .*at least 3 items",
    "{polygon: [[0, 0], [1, 1], [2, 2]]}": "`polygon`: expected corners that enclose an area, found all of them on one line",
    "{polygon: [[0, 0], [1, 1], [0, 0], [1, 1]]}": "all of them on one line",
    "{polygon: [[3, 3], [3, 3], [3, 3]]}": "all of them on one line",
    "{polygon: {points: 3}}": "`polygon`: expected a valid list",
    "{sphere: {center: [0, 0, 0], radius: 1": "not valid YAML",
    "{sphere: &a {center: [0, 0, 0], radius: 1}, box: *a}": "not valid YAML.*found an alias",
    "{sphere: {center: [0, 0, 0], radius: 1}, sphere: {center: [0, 0, 0], radius: 2}}": "the key `sphere` is given twice",
    "{? [1, 2] : 3}": "not valid YAML",
    "!!python/object:os.system x": "not valid YAML",
    "2001-99-99": "a value cannot be read",
    "[" * 5000: "not valid YAML: nested too deeply",
    "{sphere: {center: [0, 0, 0], radius: 1" + "0" * 5000 + "}}": "thousands of digits|cannot be read|4300",
    "{object: " + "x" * 600_000 + "}": "at most 500,000 characters",
    "{object: " + "x" * 6000 + "}": "`object.name`: .*at most 1000 characters",
    "\x00": "not valid YAML",
}


@pytest.mark.parametrize("text", GOOD)
def test_good_descriptions(text: str) -> None:
    name, description = parse_region(f" a-region.2 = {text}")
    assert name == "a-region.2"
    assert description == yaml.safe_load(text) or "1e1" in text
    found = region(description, pathlib.Path("jobs"))
    assert found == GOOD[text]
    assert hash(found) == hash(GOOD[text])
    assert found.describe()
    assert found.enlarged().describe()


@pytest.mark.parametrize("text", GOOD)
def test_descriptions_survive_the_manifest(text: str) -> None:
    """A job is kept as JSON with all its defaults."""

    class Job(BaseModel):
        regions: dict[str, RegionDescription]

    job = Job.model_validate({"regions": {"a": parse_region(f"a={text}")[1]}})
    stored = json.loads(json.dumps(job.model_dump(mode="json")))
    assert region(stored["regions"]["a"], pathlib.Path("jobs")) == GOOD[text]
    assert region(job.regions["a"], pathlib.Path("jobs")) == GOOD[text]
    assert Job.model_validate(stored) == job


@pytest.mark.parametrize("text", BAD, ids=lambda text: text[:60].replace("\x00", "NUL"))
def test_bad_descriptions(text: str) -> None:
    with pytest.raises(QueryError, match=f"^region `bad`: .*(?:{BAD[text]})") as found:
        parse_region(f"bad={text}")
    assert len(str(found.value)) < 600


@pytest.mark.parametrize("text", ["", "a", "={object: a}", "a b={object: a}", ".a={object: a}", "a'={object: a}", "{object: a}", "x" * 10**6])
def test_bad_names(text: str) -> None:
    with pytest.raises(QueryError, match="expected NAME=DESCRIPTION, such as") as found:
        parse_region(text)
    assert len(str(found.value)) < 300


@pytest.mark.parametrize("description", [None, 3, "glass", [("object", "a")], {"sphere": {"center": (0, 0, float("inf")), "radius": 1}}, {3: 4}])
def test_bad_python_values(description: Any) -> None:
    with pytest.raises(QueryError):
        region(description)


def test_every_field_is_described() -> None:
    schema = RegionDescription.model_json_schema()
    for name, part in [("RegionDescription", schema), *schema["$defs"].items()]:
        for field, described in part["properties"].items():
            assert described.get("description", "").endswith("."), f"{name}.{field}"
