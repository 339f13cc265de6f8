"""The page about expressions: every line of its blocks compiles in its notation, matches some path, and is found nowhere wanting."""

import pathlib
import re

import pytest

from queries.lpe import compile

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "expressions.md"
NAMES = {"objects": ["floor", "glass", "lamp", "ball", "white"], "regions": ["spot", "doorway"]}
BLOCKS = re.findall(r"```(lpe|osl|thesis)\n(.*?)```", PAGE.read_text(), re.DOTALL)
LINES = [({"lpe": "std"}.get(kind, kind), line.partition("#")[0].strip()) for kind, block in BLOCKS for line in block.splitlines()]


@pytest.mark.parametrize(("dialect", "text"), LINES)
def test_lines_of_the_page(dialect: str, text: str) -> None:
    expression = compile(text, dialect, **NAMES)
    assert not [warning for warning in expression.warnings if "matches no path" in warning]
    assert expression.describe()
    assert compile(expression.show(dialect), dialect, **NAMES).tree == expression.tree


def test_the_page_shows_all_three_notations() -> None:
    assert {dialect for dialect, _ in LINES} == {"std", "osl", "thesis"}
    assert len(LINES) >= 15
