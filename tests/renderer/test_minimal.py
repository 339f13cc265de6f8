"""The minimal path tracer, walk by walk, against the wavefront: the same numbers, the same formulas, none of the machinery.

It runs with the JIT switched off, so this also shows that every kernel is plain Python too.
"""

import pathlib

import minimal_walks
import numpy as np
import pytest
from rendering import columns, record

DIVERGED = 0.01  # share of walks that may take another way: where rays graze edges, float32 and float64 meet different triangles


@pytest.fixture(scope="module")
def minimal(session_folder: pathlib.Path) -> dict[str, np.ndarray]:
    return minimal_walks.run(session_folder)


@pytest.mark.parametrize("name", minimal_walks.CASES)
def test_walk_by_walk(name: str, minimal: dict[str, np.ndarray], session_folder: pathlib.Path) -> None:
    scene, settings, walks = minimal_walks.case(name, session_folder)
    paths = columns(record(scene, settings, walks)["paths"])
    expected = np.zeros((len(walks), 3))
    contribution = np.stack([paths[f"contribution_{c}"] for c in "rgb"], axis=1).astype(np.float64)
    np.add.at(expected, np.searchsorted(walks, paths["camera_walk"]), contribution)
    found = minimal[name]
    assert (expected.max(axis=1) > 0).mean() > 0.2, "many walks should find light"
    same = np.isclose(found, expected, rtol=5e-3, atol=1e-4).all(axis=1)
    assert (~same).mean() <= DIVERGED, f"{(~same).sum()} of {len(walks)} walks differ: {walks[~same][:5]}, {found[~same][:5]}, {expected[~same][:5]}"
