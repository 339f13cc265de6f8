"""The examples in docstrings: of every module of ``queries``."""

import doctest
import importlib
import pkgutil

import pytest

import queries

NAMES = [module.name for module in pkgutil.walk_packages(queries.__path__, "queries.")]
WITH_EXAMPLES = {
    "tokens",
    "syntax",
    "names",
    "prefixes",
    "printer",
    "describe",
    "phrases",
    "descriptors",
    "thesis",
    "thesis_tokens",
    "osl",
    "compile",
}


@pytest.mark.parametrize("name", NAMES)
def test_examples(name: str) -> None:
    # by its full name: `queries.lpe.compile` is the function where it is an attribute
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0
    assert found.attempted > 0 or name.removeprefix("queries.lpe.") not in WITH_EXAMPLES
