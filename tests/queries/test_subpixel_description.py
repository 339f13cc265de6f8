"""Displays and viewers as jobs describe them: what they mean, and what is refused."""

import pathlib

import numpy as np
import pytest
from pydantic import ValidationError

from queries.errors import QueryError
from queries.subpixel.description import LayoutDescription, SubpixelDescription, layout, read_layout, shipped_layouts
from renderer.filters.subpixel.layout import INACTIVE, OPPONENT_RGB, OPPONENT_RGBW

CYCLES = np.array([0.0, 3.0, 12.0])


def test_a_layout_of_ones_own_means_what_it_says() -> None:
    described = LayoutDescription(
        pattern=["R . G .", ". B . W"], cells=(2, 2), origin=(0.25, 0.75), extent={"G": (2, 1)}, opponent={"B": (0.1, 0.2, -0.3)}
    )
    found = described.layout("mine")
    assert (found.name, found.primaries, found.cells, found.origin) == ("mine", ("R", "G", "B", "W"), (2, 2), (0.25, 0.75))
    assert found.pattern.tolist() == [[0, INACTIVE, 1, INACTIVE], [INACTIVE, 2, INACTIVE, 3]]
    assert found.extent == ((1, 1), (2, 1), (1, 1), (1, 1))
    assert found.opponent[:, [0, 1, 3]].tolist() == OPPONENT_RGBW[:, [0, 1, 3]].tolist()
    assert found.opponent[:, 2].tolist() == [0.1, 0.2, -0.3]
    assert LayoutDescription(pattern=["R", "G", "B"], cells=(1, 3)).layout("lying").opponent.tolist() == OPPONENT_RGB.tolist()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"extent": {"W": (2, 2)}}, "`extent` names W"),
        ({"opponent": {"W": (0.3, 0.0, 0.0)}}, "`opponent` names W"),
        ({"opponent": {"R": (np.inf, 0.0, 0.0)}}, "finite number"),
        ({"pattern": ["R G B", "R G"]}, "equally many positions"),
        ({"pattern": ["R G X"]}, "found X"),
        ({"pattern": ["R G ."]}, "has no B"),
        ({"pattern": ["R G B " * 9]}, "at most 24 x 24 positions, found 27 x 1"),
        ({"cells": (2, 1)}, "no whole pixels of 2 x 1"),
        ({"origin": (1.0, 0.5)}, "less than 1"),
        ({"origin": (float("nan"), 0.5)}, "origin"),
        ({"extent": {"R": (0, 1)}}, "greater than or equal to 1"),
    ],
)
def test_layouts_that_make_no_sense_are_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        LayoutDescription.model_validate({"pattern": ["R G B"], "cells": (3, 1)} | change)


@pytest.mark.parametrize(
    ("described", "weights"),
    [
        ({"exponential": 2.3}, [np.exp(-CYCLES / 2.3)] * 3),
        ({"exponential": [2.0, 4.0, 8.0]}, [np.exp(-CYCLES / a) for a in (2.0, 4.0, 8.0)]),
        ({"gaussian": 3.0}, [np.exp(-(CYCLES**2) / 18.0)] * 3),
        ({"box": [3.0, 2.0, 20.0]}, [[1, 1, 0], [1, 0, 0], [1, 1, 1]]),
        ({"table": {"frequency": [1, 5], "weights": [[2, 0], [0, 4], [1, 1]]}}, [[2, 1, 0], [0, 2, 4], [1, 1, 1]]),
    ],
)
def test_sensitivities_have_the_weights_that_they_say(described: dict[str, object], weights: list[list[float]]) -> None:
    found = SubpixelDescription.model_validate({"sensitivity": described}).sensitivity.sensitivity()
    assert found.weights(CYCLES) == pytest.approx(np.array(weights), abs=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sensitivity": {}}, "exactly one of"),
        ({"sensitivity": {"box": 3.0, "gaussian": 3.0}}, "exactly one of"),
        ({"sensitivity": {"exponential": 0.0}}, "greater than 0"),
        ({"sensitivity": {"table": {"frequency": [1, 1], "weights": [[1, 1]] * 3}}}, "ascending frequencies"),
        ({"sensitivity": {"table": {"frequency": [1, 2], "weights": [[1, 1], [1, 1], [1]]}}}, "as many weights"),
        ({"sensitivity": {"table": {"frequency": [1, 2], "weights": [[0, 0]] * 3}}}, "some that are positive"),
        ({"layouts": ["pentile"]}, "no layout `pentile`: known are rgb_stripe"),
        ({"custom": {"rgbw": {"pattern": ["R G B"], "cells": [3, 1]}}}, "name of a layout that is shipped"),
        ({"zeros": 1}, "greater than or equal to 2"),
        ({"distance": 0}, "greater than or equal to 1"),
        ({"method": "lanczos"}, "pixel_box"),
    ],
)
def test_analyses_that_make_no_sense_are_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        SubpixelDescription.model_validate(change)


def test_layouts_are_found_by_name_and_in_files(tmp_path: pathlib.Path) -> None:
    asked = SubpixelDescription.model_validate({"layouts": ["mine", "rgbg"], "custom": {"mine": {"pattern": ["B R G"], "cells": [3, 1]}}})
    assert list(asked.displays()) == ["mine", "rgbg"]
    assert asked.displays()["mine"].pattern.tolist() == [[2, 0, 1]]
    assert asked.displays()["rgbg"].pattern.tolist() == layout("rgbg").pattern.tolist()
    file = tmp_path / "mine.yaml"
    file.write_text("pattern: [B R G]\ncells: [3, 1]\n")
    assert read_layout(file).layout("mine").pattern.tolist() == [[2, 0, 1]]
    file.write_text("pattern: [B R]\ncells: [2, 1]\n")
    with pytest.raises(QueryError, match="has no G"):
        read_layout(file)
    file.write_text("pattern: [")
    with pytest.raises(QueryError, match="cannot be read"):
        read_layout(file)
    with pytest.raises(QueryError, match="no layout `pentile`"):
        layout("pentile")
    assert list(shipped_layouts()) == ["rgb_stripe", "bgr_stripe", "rgbg", "rgbw"]
