"""How samples are drawn: every row as often as it should be, and sums of the estimates right on average, for any order and any parts."""

import numpy as np
import numpy.typing as npt
import pytest
import scipy.stats
from splitmix import uniform
from stats import one_sample, sidak

from queries.priority import Candidates, Draw, by_luminance

F64 = npt.NDArray[np.float64]
ROWS, MOST, SEEDS = 240, 30, 3000


def rows() -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint16], F64]:
    """Owners with three paths each, and weights over six orders of magnitude."""
    generator = np.random.default_rng(5)
    owner, path = np.repeat(np.arange(ROWS // 3, dtype=np.uint32), 3), np.tile(np.arange(3, dtype=np.uint16), ROWS // 3)
    return owner, path, 10 ** generator.uniform(-4, 2, ROWS)


def drawn(weight: F64, most: int, seed: int, order: npt.NDArray[np.int64] | None = None, cuts: tuple[int, ...] = ()) -> Candidates:
    """The rows drawn when they are offered in this order, a part at a time."""
    owner, path, _ = rows()
    draw = Draw(most, seed)
    for part in np.split(np.arange(len(weight)) if order is None else order, cuts):
        draw.offer(weight[part], owner[part], path[part], 0, 0)
    return draw.best()


def numbers(found: Candidates) -> npt.NDArray[np.int64]:
    """The rows' numbers."""
    return found.owner.astype(np.int64) * 3 + found.path


@pytest.mark.parametrize("seed", [0, 1, 2**63 + 11, -3])
@pytest.mark.parametrize("weighted", [False, True])
def test_the_rows_of_highest_priority_are_drawn(seed: int, weighted: bool) -> None:
    owner, path, weight = rows()
    weight = weight if weighted else np.ones(ROWS)
    q = [w / uniform(seed, int(o), int(p)) for w, o, p in zip(weight, owner, path)]
    expected = sorted(range(ROWS), key=lambda i: -q[i])[:MOST]
    found = drawn(weight, MOST, seed)
    assert sorted(numbers(found)) == sorted(expected)
    assert np.array_equal(np.sort(found.priority), np.sort([q[i] for i in expected]))


def test_order_and_parts_do_not_matter() -> None:
    generator, weight = np.random.default_rng(9), rows()[2]
    expected = sorted(numbers(drawn(weight, MOST, 4)))
    for cuts in ((), (1, 2, 100), tuple(range(5, ROWS, 5))):
        order = generator.permutation(ROWS)
        assert sorted(numbers(drawn(weight, MOST, 4, order, cuts))) == expected
    # Draws of parts, joined, each of which may pass over what another has shown to be too low
    owner, path, _ = rows()
    whole = Draw(MOST, 4)
    for part in np.array_split(generator.permutation(ROWS), 7):
        some = Draw(MOST, 4, whole.least) if len(part) else whole
        some.offer(weight[part], owner[part], path[part], 0, 0)
        whole.add(some.best())
    assert whole.least > 0
    assert sorted(numbers(whole.best())) == expected


def test_equal_priorities_go_to_the_first_walks() -> None:
    names = np.array([5, 3, 3, 9, 1], np.uint64), np.array([0, 2, 1, 0, 4])
    nothing = np.zeros(5, np.int64)
    tied = Candidates(np.array([1.0, 1.0, 1.0, 2.0, 1.0]), *names, nothing, nothing)
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [1, 4, 0, 2, 3]):
        best = tied.take(np.array(order)).best(3)
        assert sorted(zip(best.owner.tolist(), best.path.tolist())) == [(1, 4), (3, 1), (9, 0)]


def test_equal_weights_are_drawn_equally_often() -> None:
    samples = np.zeros((SEEDS, ROWS))
    for seed in range(SEEDS):
        samples[seed, numbers(drawn(np.ones(ROWS), MOST, seed))] = 1
    assert (samples.sum(axis=1) == MOST).all()
    share, tests = MOST / ROWS, 3
    # Counts of sampling without replacement are negatively correlated: as of a multinomial, but for this factor
    expected = SEEDS * share
    chi2 = np.sum((samples.sum(axis=0) - expected) ** 2) / (expected * (1 - share)) * (ROWS - 1) / ROWS
    assert scipy.stats.chi2.sf(chi2, ROWS - 1) > sidak(tests)
    # Pairs: of one walk, and of neighboring walks
    both = share * (MOST - 1) / (ROWS - 1)
    for apart in (1, 3):
        assert one_sample(np.mean(samples[:, apart:] * samples[:, :-apart], axis=1), both) > sidak(tests)


def test_sums_over_any_subset_are_unbiased() -> None:
    weight = rows()[2]
    generator = np.random.default_rng(2)
    subsets = [np.ones(ROWS), generator.random(ROWS) < 0.3, np.arange(ROWS) % 3 == 0, weight < 1, weight > 10]
    value = np.stack([subset * weight for subset in subsets] + [generator.normal(size=ROWS) * weight])
    estimates = np.empty((SEEDS, len(value)))
    for seed in range(SEEDS):
        best = drawn(weight, MOST + 1, seed)
        threshold, chosen = best.priority.min(), numbers(best.best(MOST))
        assert len(chosen) == MOST
        estimates[seed] = value[:, chosen] @ (np.maximum(weight[chosen], threshold) / weight[chosen])
    exact = value.sum(axis=1)
    assert (one_sample(estimates, exact) > sidak(len(value))).all()
    # No more variance than a sum of equal rows drawn one less times has (duffield2007, section 1.4)
    assert estimates[:, 0].std() < exact[0] / np.sqrt(MOST - 1)


def test_rows_without_weight_are_never_drawn() -> None:
    weight = rows()[2].copy()
    weight[::2] = 0
    assert len(drawn(np.zeros(ROWS), MOST, 0)) == 0
    assert sorted(numbers(drawn(weight, ROWS, 0))) == list(range(1, ROWS, 2))


def test_weights_are_luminances() -> None:
    nan, inf = np.nan, np.inf
    given = np.array([[1, 0, 0], [0, 2, 0], [0, 0, 3], [nan, 1, 1], [inf, 0, 0], [0, 0, 0], [-1, 0, 0], [3e38, 3e38, 3e38]], np.float32)
    found = by_luminance(given)
    assert np.allclose(found, [0.2126, 2 * 0.7152, 3 * 0.0722, 0, 0, 0, 0, 3e38], rtol=1e-6)
