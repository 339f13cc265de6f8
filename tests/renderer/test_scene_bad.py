"""Bad scenes: each gives one clear error that says what is wrong and where, and never anything else."""

import pathlib
import re
from typing import Any

import numpy as np
import pytest
import yaml

from renderer.errors import SceneError
from renderer.scene import compile
from renderer.scene.load import load_scene
from tests.renderer.test_scene_formats import XML, YAML

CASES = yaml.safe_load((pathlib.Path(__file__).parent / "bad_scenes.yaml").read_text(encoding="utf-8"))
SENSOR = "{type: perspective}"
CONTENTS = {  # what would not be readable, or not be text, in the table
    "@open@": b"[" * 20000,
    "@objects@": b"{type: twosided, a: " * 100 + b"{}" + b"}" * 100,
    "@elements@": b"<scene version='3.0.0'>" + b"<shape type='sphere'>" * 100,
    "@junk@": np.random.default_rng(3).bytes(4096),
    "@latin@": "type: scène".encode("latin-1"),
}


def content(case: dict[str, Any]) -> tuple[str, bytes]:
    """File name and bytes of a case."""
    if "xml" in case:
        frame = f'<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>\n{case["xml"]}\n</scene>'
        return "scene.xml", frame.encode()
    if "whole" in case:
        data = case["whole"].encode()
        for word, replacement in CONTENTS.items():
            data = data.replace(word.encode(), replacement)
        return case.get("name", "scene.yaml"), data
    body = case.get("yaml", "wall: {type: rectangle}")
    if case.get("flow"):
        body = "\n".join(f"{key}: {yaml.safe_dump(value, default_flow_style=True).strip()}" for key, value in yaml.safe_load(body).items())
    return "scene.yaml", f"type: scene\ns: {case.get('sensor', SENSOR)}\ne: {{type: constant}}\n{body}".encode()


@pytest.mark.parametrize("case", CASES, ids=[case["title"] for case in CASES])
def test_bad_scene(case: dict[str, Any], tmp_path: pathlib.Path) -> None:
    for name, text in case.get("files", {}).items():
        (tmp_path / name).write_text(text)
    name, data = content(case)
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / name)
    message = str(caught.value)
    assert re.search(case["error"], message, re.DOTALL), message
    if "line" in case:
        assert message.startswith(f"{tmp_path / name}:{case['line']}: "), message
    assert len(message) < 1500
    assert "\n" not in message


def test_the_table_is_long_enough() -> None:
    assert len(CASES) >= 40
    assert len({case["title"] for case in CASES}) == len(CASES)


def test_scene_files_that_are_not_there(tmp_path: pathlib.Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path, tmp_path / ("x" * 5000), "a\0b"):
        with pytest.raises(SceneError):
            load_scene(path)


def test_black_lights_are_told(tmp_path: pathlib.Path) -> None:
    scene = load_scene({"type": "scene", "s": {"type": "perspective"}, "wall": {"type": "rectangle", "e": {"type": "area", "radiance": 0.0}}})
    assert any("the emitter 'wall' gives no light" in warning for warning in scene.warnings)


@pytest.mark.parametrize(("name", "text"), [("scene.xml", XML), ("scene.yaml", YAML)])
def test_damaged_files_give_scene_errors_only(name: str, text: str, tmp_path: pathlib.Path) -> None:
    rng = np.random.default_rng(17)
    original = np.frombuffer(text.encode(), np.uint8)
    refused = []
    for _ in range(400):
        data = original.copy()
        for _ in range(rng.integers(1, 4)):
            at, kind = int(rng.integers(len(data) - 12)), rng.integers(4)
            if kind == 0:
                data[at] = rng.integers(32, 127)
            elif kind == 1:
                data = np.delete(data, slice(at, at + int(rng.integers(1, 12))))
            elif kind == 2:
                data = np.concatenate([data[:at], data[max(0, at - 9) :]])
            else:
                data = np.concatenate([data[: at + 12], data[at:]])
        (tmp_path / name).write_bytes(data.tobytes())
        try:
            load_scene(tmp_path / name)
        except SceneError as error:
            refused.append(str(error))
    assert len(refused) > 200
    assert all(str(tmp_path / name) in message for message in refused)


@pytest.mark.parametrize(("limit", "what"), [("MOST_SHAPES", "3 shapes"), ("MOST_EMITTERS", "2 emitters")])
def test_more_than_the_tables_can_tell_apart(monkeypatch: pytest.MonkeyPatch, limit: str, what: str) -> None:
    shapes = {name: {"type": "rectangle"} for name in ("floor", "wall", "lid")}
    lamps = {name: {"type": "point", "position": [0, 0, 1]} for name in ("left", "right")}
    scene = {"type": "scene", "sensor": {"type": "perspective"}, **shapes, **lamps}
    load_scene(scene)
    monkeypatch.setattr(compile, limit, int(what[0]) - 1)
    with pytest.raises(SceneError, match=what):
        load_scene(scene)
