"""Classes of pixels: the shares are those of brute force, add up, and are the images of the classes' expressions."""

import collections
import pathlib

import numpy as np
import pytest
from synthetic import SyntheticRun, make_run

from queries import open_run
from queries.errors import QueryError
from queries.images import images
from queries.kernels.luminance import LUMINANCE
from queries.kernels.pixel_classes import largest_shares
from queries.pixel_classes import NO_CLASS, SLOTS, WHOLE, PixelClasses, cell_size, pixel_classes


def brute_force(synthetic: SyntheticRun, block: int) -> dict[tuple[int, int], dict[str, float]]:
    """Luminance of each class in each cell (row, column), path by path."""
    cells: dict[tuple[int, int], dict[str, float]] = collections.defaultdict(lambda: collections.defaultdict(float))
    for row, word in zip(synthetic.rows, synthetic.words, strict=True):
        letters = [event.type + (event.scattering or "") for event in word]
        spelled = " ".join(letter if len(letter) == 1 else f"<{letter}>" for letter in letters)
        cell = int(row["raster_y"]) // block, int(row["raster_x"]) // block
        cells[cell][spelled] += sum(weight * row[f"contribution_{c}"] for weight, c in zip(LUMINANCE, "rgb"))
    return cells


def shares_of(found: PixelClasses, cell: tuple[int, int]) -> dict[str, int]:
    """The parts of one cell by expression; all other classes under an empty one."""
    named = {found.named[number].expression: int(part) for number, part in zip(found.classes[cell], found.parts[cell]) if number != NO_CLASS}
    return named | {"": int(found.parts[cell][SLOTS])}


@pytest.mark.parametrize("method", ["path", "light", "both"])
@pytest.mark.parametrize("most", [10_000, 12])
def test_shares_are_those_of_brute_force(tmp_path: pathlib.Path, method: str, most: int) -> None:
    synthetic = make_run(tmp_path / "run", method, seed=6, passes=6)
    with open_run(synthetic.folder) as run:
        found = pixel_classes(run, most=most)
    assert found.block == (1 if most > 35 else 2)
    assert found.classes.shape == ((5, 7, SLOTS) if found.block == 1 else (3, 4, SLOTS))
    expected = brute_force(synthetic, found.block)
    whole: dict[str, float] = collections.Counter()
    for classes in expected.values():
        whole.update(classes)
    assert found.count == len(whole)
    assert [name.expression for name in found.named] == sorted(whole, key=lambda name: -whole[name])[: len(found.named)]
    shares = [whole[name.expression] / sum(whole.values()) for name in found.named]
    np.testing.assert_allclose([name.share for name in found.named], shares, rtol=1e-6)
    known = {name.expression for name in found.named}
    crowded = 0
    for row in range(found.classes.shape[0]):
        for column in range(found.classes.shape[1]):
            classes, shares = expected.get((row, column), {}), shares_of(found, (row, column))
            total = sum(classes.values())
            assert sum(shares.values()) == (WHOLE if total else 0)
            largest = sorted((name for name in classes if name in known), key=lambda name: -classes[name])[:SLOTS]
            assert [name for name in shares if name] == largest
            crowded += len(classes) > SLOTS
            for name in largest:
                assert abs(shares[name] - WHOLE * classes[name] / total) < 1
    assert crowded > 3  # else nothing was ever left to the others


def test_shares_are_the_images_of_the_expressions(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        found = pixel_classes(run)
        chosen = [name.expression for name in found.named[:5]]
        layers = images(run, {expression: expression for expression in chosen} | {"all": "C .* [LOB]"})
    luminance = {name: image.astype(np.float64) @ np.array(LUMINANCE) for name, image in layers.items()}
    for number, expression in enumerate(chosen):
        listed = np.argwhere(found.classes == number)
        assert len(listed) > 5
        for y, x, slot in listed:
            assert found.parts[y, x, slot] / WHOLE == pytest.approx(luminance[expression][y, x] / luminance["all"][y, x], abs=1.01 / WHOLE)


def test_few_names_leave_the_rest_to_the_others(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        few, many = pixel_classes(run, named=2), pixel_classes(run)
    assert len(few.named) == 2
    assert few.named == many.named[:2]
    assert set(np.unique(few.classes)) == {0, 1, NO_CLASS}
    assert (few.parts.sum(axis=2) == many.parts.sum(axis=2)).all()
    assert (few.parts[..., SLOTS] >= many.parts[..., SLOTS]).all()
    assert (few.parts[..., SLOTS] > many.parts[..., SLOTS]).any()


def test_bits_do_not_depend_on_threads(both_run: SyntheticRun) -> None:
    with open_run(both_run.folder) as run:
        one, three = pixel_classes(run, threads=1), pixel_classes(run, threads=3)
    assert one.named == three.named
    assert np.array_equal(one.classes, three.classes)
    assert np.array_equal(one.parts, three.parts)


def test_any_sums_give_parts_that_add_up() -> None:
    random = np.random.default_rng(4)
    sums = random.exponential(size=(4000, 9)) ** random.uniform(0.2, 9, (4000, 1)) * (random.random((4000, 9)) < 0.6)
    sums[0], sums[1], sums[2] = 0, [0] * 8 + [3], [1] * 9
    before = sums.copy()
    classes, parts = np.empty((4000, SLOTS), np.uint8), np.empty((4000, SLOTS + 1), np.uint16)
    largest_shares(sums, WHOLE, classes, parts)
    assert np.array_equal(parts.sum(axis=1), np.where(before.sum(axis=1) > 0, WHOLE, 0))
    assert parts[1].tolist() == [0] * SLOTS + [WHOLE]
    assert classes[2].tolist() == [0, 1, 2, 3, 4, 5]
    assert parts[2].tolist() == [1111] * SLOTS + [3334]
    total = np.maximum(before.sum(axis=1), 1e-300)
    for slot in range(SLOTS):
        listed = np.flatnonzero(classes[:, slot] != NO_CLASS)
        exact = WHOLE * before[listed, classes[listed, slot]] / total[listed]
        assert np.abs(parts[listed, slot] - exact).max() < 1


@pytest.mark.parametrize(("size", "block"), [((256, 256), 1), ((640, 468), 1), ((641, 469), 2), ((1920, 1080), 3), ((3, 400_000), 3), ((1, 1), 1)])
def test_cells_are_as_small_as_they_may_be(size: tuple[int, int], block: int) -> None:
    assert cell_size(*size) == block
    assert -(-size[0] // block) * -(-size[1] // block) <= 300_000


def test_a_run_without_paths_is_refused(tmp_path: pathlib.Path) -> None:
    synthetic = make_run(tmp_path / "run", keep=0.0)
    with open_run(synthetic.folder) as run, pytest.raises(QueryError, match="recorded no paths"):
        pixel_classes(run)
