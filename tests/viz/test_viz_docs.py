"""The examples in docstrings of ``viz``."""

import doctest
import importlib

import pytest

WITH_EXAMPLES = ["viz.numbers", "viz.ticks", "viz.report.numbers"]


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples(name: str) -> None:
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0
    assert found.attempted > 0
