"""The examples in docstrings."""

import doctest
import importlib

import pytest

NAMES = ["tokens", "syntax", "names", "prefixes", "printer", "describe", "phrases", "descriptors", "thesis", "compile"]


@pytest.mark.parametrize("name", NAMES)
def test_examples(name: str) -> None:
    # by its full name: `queries.lpe.compile` is the function where it is an attribute
    found = doctest.testmod(importlib.import_module(f"queries.lpe.{name}"))
    assert found.attempted > 0
    assert found.failed == 0
