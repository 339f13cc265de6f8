"""Rankings by resampled images, and the sentences that say why the optimal filter loses."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pytest
from scipy import stats

from queries.diagnostics.answers import meanings
from queries.errors import QueryError
from queries.subpixel.preference import FEWEST_IMAGES, RESAMPLES, SEED, interval, layouts_ranked, methods_ranked
from queries.subpixel.reasons import reasons

F64 = npt.NDArray[np.float64]
NAMES = [f"image {i}" for i in range(8)]


def scores(by_method: dict[str, Any], layout: str = "rgb_stripe") -> pa.Table:
    """S-CIELAB of each method on each image."""
    rows = [
        {"layout": layout, "image": image, "method": method, "scielab": float(value)}
        for method, values in by_method.items()
        for image, value in zip(NAMES, values)
    ]
    return pa.Table.from_pylist(rows)


def example(seed: int = 1) -> dict[str, F64]:
    """Images of unequal difficulty, methods that differ on all by nearly as much."""
    rng = np.random.default_rng(seed)
    image = rng.uniform(1.0, 6.0, 8)
    return {
        name: image + more + 0.05 * rng.standard_normal(8) for name, more in (("optimal", 0.0), ("box", 0.5), ("mitchell", -0.5), ("kernels", 0.0))
    }


def by_name(table: pa.Table, column: str = "method") -> dict[str, dict[str, Any]]:
    return {row[column]: row for row in table.to_pylist()}


# --- ranking ------------------------------------------------------------------------------------------------------


def test_ranks_means_and_paired_differences() -> None:
    """Images differ by much more than methods: only paired differences tell methods apart."""
    values = example()
    table = methods_ranked(scores(values), "rgb_stripe")
    found = by_name(table)
    assert table["scielab"].to_pylist() == sorted(table["scielab"].to_pylist())
    assert table["rank"].to_pylist() == [1, 2, 3, 4]
    for name, row in found.items():
        assert row["scielab"] == pytest.approx(values[name].mean(), rel=1e-12)
        assert row["difference"] == pytest.approx((values[name] - values["optimal"]).mean(), abs=1e-12)
        assert row["low"] < row["scielab"] < row["high"]
        assert row["wins"] == pytest.approx((values[name] < values["optimal"]).mean())
        assert row["images"] == 8
    assert (found["mitchell"]["verdict"], found["box"]["verdict"], found["optimal"]["verdict"]) == ("better", "worse", "reference")
    assert found["kernels"]["verdict"] == "not told apart"
    assert found["box"]["low"] < found["optimal"]["high"]  # the intervals of the means overlap all the same
    assert (found["mitchell"]["wins"], found["box"]["wins"]) == (1.0, 0.0)
    assert (found["mitchell"]["stability"], found["box"]["stability"]) == (1.0, 1.0)
    assert found["kernels"]["stability"] == pytest.approx(found["optimal"]["stability"])  # they have two ranks between them
    assert all(meanings(table).values())


def test_intervals_are_those_of_resampled_images_one_by_one() -> None:
    values = example()
    found = by_name(methods_ranked(scores(values), "rgb_stripe"))
    drawn = np.random.default_rng(SEED).integers(8, size=(RESAMPLES, 8))
    resampled = {name: np.array([v[d].mean() for d in drawn]) for name, v in values.items()}
    tail = stats.norm.cdf(-np.sqrt(8 / 7) * 2.364624252)  # the 97.5 % point of Student's t at 7 degrees of freedom, from tables
    for name, means in resampled.items():
        assert (found[name]["low"], found[name]["high"]) == pytest.approx(tuple(np.quantile(means, [tail, 1 - tail])), rel=1e-6)
        order = [sum(other[i] < means[i] - 1e-9 for other in resampled.values()) + 1 for i in range(0, RESAMPLES, 10)]
        assert found[name]["stability"] == pytest.approx(np.mean(np.array(order) == found[name]["rank"]), abs=0.07)  # 1000 of the resamples


def test_intervals_hold_the_mean_as_often_as_they_say() -> None:
    """1000 experiments of 8 images: 95 % nominally, 94 % to 95 % as simulated with many more; four deviations of the share around that."""
    rng = np.random.default_rng(2)
    held = []
    for _ in range(5):
        low, high = interval(rng.normal(3.0, 1.0, (200, 8)))
        held.append((low <= 3.0) & (high >= 3.0))
    assert 0.945 - 4 * np.sqrt(0.945 * 0.055 / 1000) < np.mean(held) < 0.945 + 4 * np.sqrt(0.945 * 0.055 / 1000)


def test_intervals_move_and_stretch_with_the_scores() -> None:
    values = np.random.default_rng(3).random((3, 9))
    low, high = interval(values)
    moved_low, moved_high = interval(2.0 * values + 5.0)
    np.testing.assert_allclose(moved_low, 2.0 * low + 5.0, rtol=1e-12)
    np.testing.assert_allclose(moved_high, 2.0 * high + 5.0, rtol=1e-12)
    turned_low, turned_high = interval(-values)
    np.testing.assert_allclose(turned_low, -high, rtol=1e-12)
    np.testing.assert_allclose(turned_high, -low, rtol=1e-12)
    np.testing.assert_allclose(interval(np.full((1, 7), 2.5)), [[2.5], [2.5]], rtol=1e-14)


def test_order_of_rows_and_other_displays_change_nothing() -> None:
    table = scores(example())
    expected = methods_ranked(table, "rgb_stripe")
    both = pa.concat_tables([scores(example(5), "rgbg"), table])
    shuffled = both.take(np.random.default_rng(4).permutation(len(both)))
    assert methods_ranked(shuffled, "rgb_stripe").equals(expected)
    assert not methods_ranked(shuffled, "rgbg").equals(expected)


def test_equal_methods_share_a_rank() -> None:
    values = example()
    values = {"optimal": values["optimal"], "box": values["optimal"], "none": values["optimal"] - 1.0, "mitchell": values["box"]}
    found = by_name(methods_ranked(scores(values), "rgb_stripe"))
    assert [found[name]["rank"] for name in ("none", "box", "optimal", "mitchell")] == [1, 2, 2, 4]
    assert (found["box"]["difference"], found["box"]["verdict"], found["box"]["wins"]) == (0.0, "not told apart", 0.0)
    assert [found[name]["stability"] for name in values] == [1.0] * 4


def test_differences_of_rounding_are_none() -> None:
    """A method that gives the same picture, but for the last digits of its scores, neither wins nor is better."""
    optimal = example()["optimal"]
    found = by_name(methods_ranked(scores({"optimal": optimal, "below": optimal - 1e-13, "above": optimal + 1e-13}), "rgb_stripe"))
    for name in ("below", "above"):
        assert (found[name]["rank"], found[name]["verdict"], found[name]["wins"], found[name]["stability"]) == (1, "not told apart", 0.0, 1.0)


def test_few_images_give_no_verdict() -> None:
    few = {name: values[: FEWEST_IMAGES - 1] for name, values in example().items()}
    found = by_name(methods_ranked(scores(few), "rgb_stripe"))
    assert found["box"]["verdict"] == "too few images"
    assert found["box"]["low"] is None
    assert found["box"]["difference_high"] is None
    assert found["box"]["difference"] > 0.4
    enough = {name: values[:FEWEST_IMAGES] for name, values in example().items()}
    assert by_name(methods_ranked(scores(enough), "rgb_stripe"))["box"]["verdict"] == "worse"


def test_displays_are_compared_by_one_method() -> None:
    """As in Fig. 4.13: two alike, and one that is worse than both."""
    a, b, c = example(6), example(7), example(8)
    base = a["optimal"]
    b["optimal"], c["optimal"] = base + 2.0 + 0.1 * np.sin(np.arange(8)), base + 0.1 * np.cos(3.0 * np.arange(8))
    table = pa.concat_tables([scores(c, "rgbw"), scores(b, "rgbg"), scores(a, "rgb_stripe")])
    found = by_name(layouts_ranked(table), "layout")
    assert (found["rgb_stripe"]["verdict"], found["rgbg"]["verdict"], found["rgbw"]["verdict"]) == ("reference", "worse", "not told apart")
    assert found["rgbg"]["rank"] == 3
    assert by_name(layouts_ranked(table, against="rgbg"), "layout")["rgbw"]["verdict"] == "better"


def test_scores_that_cannot_be_compared_are_refused() -> None:
    table = scores(example())
    with pytest.raises(QueryError, match="no scores of the layout `rgbg`"):
        methods_ranked(table, "rgbg")
    with pytest.raises(QueryError, match="no score of the method `none`"):
        methods_ranked(table, "rgb_stripe", against="none")
    with pytest.raises(QueryError, match="two scores"):
        methods_ranked(pa.concat_tables([table, table.slice(0, 1)]), "rgb_stripe")
    with pytest.raises(QueryError, match="`image 0` has no score of the method `optimal`"):
        methods_ranked(table.slice(1), "rgb_stripe")


# --- reasons ------------------------------------------------------------------------------------------------------


def row(method: str, scielab: float, **more: float) -> dict[str, Any]:
    """A row of scores in which nothing is remarkable but what is given."""
    rest = {"lightness": 0.6 * scielab, "chroma": 0.6 * scielab, "clipped": 0.0, "scielab_unclipped": scielab, "weighted_error": 0.05}
    return {"layout": "rgb_stripe", "image": "text", "method": method, "scielab": scielab} | rest | more


def said(*rows: dict[str, Any]) -> str:
    (reason,) = reasons(pa.Table.from_pylist(list(rows)))
    assert (reason.layout, reason.image) == ("rgb_stripe", "text")
    return reason.text


def test_nothing_is_said_where_the_optimal_filter_wins_or_ties() -> None:
    assert reasons(pa.Table.from_pylist([row("optimal", 1.0), row("box", 1.1)])) == ()
    assert reasons(pa.Table.from_pylist([row("optimal", 1.0), row("box", 1.0)])) == ()
    assert reasons(pa.Table.from_pylist([row("mitchell", 1.0), row("box", 1.1)])) == ()


def test_who_wins_and_by_how_much() -> None:
    sentence = said(row("optimal", 2.0), row("mitchell", 1.8), row("box", 1.5))
    assert sentence.startswith("Box per subpixel beats optimal, analytic by 25 % (S-CIELAB 1.50 against 2.00).")
    assert "clipping" not in sentence


def test_clipping_is_the_cause_or_a_part_or_none() -> None:
    whole = said(row("optimal", 2.0, clipped=0.2, scielab_unclipped=1.0), row("box", 1.5))
    assert "The cause is clipping (20 % of its subpixels, 0 % of the other's): on a display without limits it would win, 1.00 against 1.50." in whole
    part = said(row("optimal", 2.0, clipped=0.2, scielab_unclipped=1.8), row("box", 1.5))
    assert "Of the loss 40 % comes from clipping" in part
    assert "1.80 against 1.50" in part
    reverse = said(row("optimal", 2.0, clipped=0.01, scielab_unclipped=2.0), row("box", 1.5, clipped=0.3, scielab_unclipped=1.0))
    assert "it would lose by more, 2.00 against 1.00" in reverse
    assert "clipping" not in said(row("optimal", 2.0, clipped=0.2, scielab_unclipped=1.99), row("box", 1.5))


def test_what_the_analytic_filter_omits() -> None:
    assert "What it omits costs it that" in said(row("optimal", 2.0), row("kernels", 1.5), row("box", 1.7))
    assert "would win back 80 % of the loss" in said(row("optimal", 2.0), row("kernels", 1.6), row("box", 1.5))
    assert "All solved kernels would lose by more (2.40)" in said(row("optimal", 2.0), row("kernels", 2.4), row("box", 1.5))


def test_measures_that_disagree() -> None:
    ahead = said(row("optimal", 2.0, weighted_error=0.03), row("box", 1.5, weighted_error=0.04))
    assert "it is ahead, 0.0300 against 0.0400: the two measures disagree" in ahead
    behind = said(row("optimal", 2.0, weighted_error=0.05), row("kernels", 2.1, weighted_error=0.01), row("box", 1.5, weighted_error=0.04))
    assert "it is behind too, 0.0500 against 0.0400, but the kernels that it approximates are ahead, 0.0100" in behind
    assert "Eq. 4.4" not in said(row("optimal", 2.0), row("box", 1.5))


def test_blur_and_fringes_are_told_apart() -> None:
    fringes = said(row("optimal", 2.0, lightness=1.0, chroma=1.7), row("box", 1.5, lightness=1.1, chroma=0.9))
    assert "It loses in color (fringes: 1.70 against 0.900); it wins in lightness (blur, ringing: 1.00 against 1.10)." in fringes
    blur = said(row("optimal", 2.0, lightness=1.8, chroma=0.5), row("box", 1.5, lightness=1.2, chroma=0.5))
    assert "It loses in lightness (blur, ringing: 1.80 against 1.20)." in blur
    assert "color" not in blur
    both = said(row("optimal", 2.0, lightness=1.2, chroma=1.6), row("box", 1.5, lightness=1.0, chroma=1.1))
    assert both.index("color (fringes") < both.index("lightness (blur")  # the greater part first
