"""Rankings against figures computed by loops over single paths, on synthetic and on rendered runs."""

import collections
import math
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from enumeration import OnePath, Point, paths_of_run, paths_of_synthetic, scatter
from running import run_job
from scipy import stats
from synthetic import make_run

from queries import Run, open_run, rank
from queries.errors import QueryError
from queries.images import aov_image
from queries.lpe.descriptors import DESCRIPTORS, class_expression, describe_class, descriptor
from queries.ranking import orders
from queries.ranking.rank import _order
from queries.statistics import Units

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"
Question = dict[str, Any]
Kind = tuple[tuple[str, ...], tuple[str | None, ...]]  # a class: letters, objects


def ball(center: Point, radius: float) -> Callable[[Point], bool]:
    return lambda point: math.dist(point, center) <= radius


# --- the same by loops --------------------------------------------------------------------------------------------


class Expected:
    """All figures of one question, path by path."""

    def __init__(self, run: Run, paths: list[OnePath], center: Point | None, radius: float, asked: Question) -> None:
        self.settings, self.asked = run.settings, asked
        self.units = Units.of_run(run)
        outer = asked.get("outer", 1.5)
        self.samples: dict[str, dict[Any, dict[int, list[float]]]] = {"inside": {}, "ring": {}}
        for path in paths:
            place = self._place(path, center, radius, outer)
            if place:
                self.samples[place].setdefault(self._kind(path), {}).setdefault(path.walk, []).append(path.luminance)
        self.total = {place: self._units(walks for kinds in [self.samples[place]] for walks in kinds.values()) for place in self.samples}

    def _place(self, path: OnePath, center: Point | None, radius: float, outer: float) -> str | None:
        if center is None:
            return "inside"
        points = path.places if self.asked.get("at") == "any" else path.places[:1]
        if any(ball(center, radius)(point) for point in points):
            return "inside"
        return "ring" if any(ball(center, outer * radius)(point) for point in points) else None

    def _kind(self, path: OnePath) -> Any:
        if self.asked.get("merge"):
            return descriptor(path.letters)
        return path.letters, path.objects if self.asked.get("with_objects") else (None,) * len(path.letters)

    def _units(self, groups: Any) -> list[float]:
        """Sums by unit."""
        sums = [0.0] * self.units.count
        for walks in groups:
            for walk, values in walks.items():
                sums[self._unit(walk)] += sum(values)
        return sums

    def _unit(self, walk: int) -> int:
        number = walk // (self.settings["width"] * self.settings["height"])
        if self.units.kind == "replicates":
            return number % self.settings["replicates"]
        return number % min(64, self.settings["passes"]) if self.units.kind == "passes" else int(self.units.of_walks(np.array([walk], np.uint64))[0])

    def of(self, place: str, kind: Any) -> list[float]:
        return self._units([self.samples[place].get(kind, {})])

    def jackknife(self, function: Callable[..., float], *sums: list[float]) -> tuple[float, float]:
        """Value and standard error, leaving out each unit by hand."""
        shares, count = self.units.sizes.tolist(), self.units.count
        value = function(*(math.fsum(part) for part in sums))
        without = []
        for u in range(count):
            try:
                rest = (max(0.0, math.fsum(x for v, x in enumerate(part) if v != u)) / (1 - shares[u]) for part in sums)
                without.append(function(*rest))
            except (ZeroDivisionError, ValueError):
                return value, math.nan
        center = count * value - sum((1 - w) * t for w, t in zip(shares, without))
        pseudo = [value / w - (1 / w - 1) * t for w, t in zip(shares, without)]
        return value, math.sqrt(sum((p - center) ** 2 / (1 / w - 1) for p, w in zip(pseudo, shares)) / count)

    def row(self, kind: Any) -> dict[str, Any]:
        """What the ranking should say of a class."""
        inside, ring = self.of("inside", kind), self.of("ring", kind)
        walks, ring_walks = self.samples["inside"][kind], self.samples["ring"].get(kind, {})
        x = [sum(values) for values in walks.values()]
        scale = 1 / (self.settings["keep"] * self.settings["passes"])
        found: dict[str, Any] = {"paths": sum(map(len, walks.values())), "samples": len(walks), "units": self.units.count}
        found["effective_samples"] = sum(x) ** 2 / sum(v * v for v in x)
        found["flux"], found["flux_error"] = self.jackknife(lambda s: s * scale, inside)
        found["share"], found["share_error"] = self.jackknife(lambda a, b: a / b, inside, self.total["inside"])
        found["trusted"] = max(x) ** 2 <= 0.1 * sum(v * v for v in x) and sum(v**2 for v in x) ** 2 >= 20 * sum(v**4 for v in x)
        by = self.asked.get("by", "contribution")
        if by == "contribution":
            return found | {"key": found["flux"]}
        outer = [a + b for a, b in zip(inside, ring)]
        found["outer_flux"], found["outer_flux_error"] = self.jackknife(lambda s: s * scale, outer)
        found["ring_share"], found["ring_share_error"] = self.jackknife(lambda a, b: a / b, ring, self.total["ring"])
        found["ring_samples"] = len(ring_walks)
        if by in ("ratio", "literal"):
            top, bottom = (inside, outer) if by == "ratio" else (outer, inside)
            found["ratio"], found["ratio_error"] = self.jackknife(lambda a, b: a / b, top, bottom)
            return found | {"key": found["ratio"]}
        totals = self.total["inside"], self.total["ring"]
        found["ratio"], found["ratio_error"] = (
            self.jackknife(lambda i, r, ti, tr: (i / ti) / (r / tr), inside, ring, *totals) if sum(ring) else (math.nan, math.nan)
        )
        cautious = ring
        if len(ring_walks) < 30:
            mean = (sum(inside) + sum(ring)) / (len(walks) + len(ring_walks))
            bound = max(stats.chi2.ppf(0.95, 2 * len(ring_walks) + 2) / 2 * mean, sum(ring))
            cautious = [bound * size for size in self.units.sizes]
        value, error = self.jackknife(lambda i, r, ti, tr: math.log((i / ti) / (r / tr)), inside, cautious, *totals)
        found["lower"] = math.exp(value - stats.t.ppf(0.95, self.units.count - 1) * error)
        found["supported"] = len(walks) >= self.asked.get("minimum_support", 30)
        return found | {"key": found["lower"]}

    def table(self) -> list[dict[str, Any]]:
        rows = [self.row(kind) | self._texts(kind) for kind in self.samples["inside"]]
        tier = {row["expression"]: 0 if row.get("supported", True) else 1 + (row["samples"] == 1) for row in rows}
        rows.sort(key=lambda r: (tier[r["expression"]], -r["key"] if not math.isnan(r["key"]) else math.inf, -r["flux"], r["expression"]))
        running = 0.0
        for number, row in enumerate(rows, start=1):
            running += row["share"]
            row |= {"rank": number, "cumulative": running}
            del row["key"]
        return rows

    def _texts(self, kind: Any) -> dict[str, str]:
        if self.asked.get("merge"):
            known = next(row for row in DESCRIPTORS if row.name == kind)
            return {"expression": known.expression, "description": known.meaning, "descriptor": kind}
        return {"expression": class_expression(*kind), "description": describe_class(*kind), "descriptor": descriptor(kind[0])}


def assert_same(table: pa.Table, expected: list[dict[str, Any]]) -> None:
    found = table.to_pylist()
    assert len(found) == len(expected) >= 3
    for row, truth in zip(found, expected):
        for name, value in truth.items():
            if isinstance(value, float) and not math.isfinite(value):
                assert row[name] is None, (row, name)
            elif isinstance(value, float):
                # Errors that are zero but for rounding are compared with their figure's scale
                scale = abs(truth.get(name.removesuffix("_error"), 0.0))
                assert row[name] == pytest.approx(value, rel=1e-6, abs=1e-7 * scale), (row, name)
            else:
                assert row[name] == value, (row, name, truth)


# --- synthetic runs -----------------------------------------------------------------------------------------------

RUNS = {
    "camera walks": ("path", {"passes": 12}),
    "light walks": ("light", {"passes": 12}),
    "two walks": ("both", {"passes": 20}),
    "replicates": ("path", {"passes": 10, "sampler": "sobol", "replicates": 4}),
    "groups of walks": ("path", {"passes": 6, "width": 11}),
    "a share recorded": ("path", {"passes": 12, "keep": 0.5}),
}
QUESTIONS: dict[str, Question] = {
    "contribution": {},
    "with objects": {"with_objects": True},
    "discrimination": {"by": "discrimination", "minimum_support": 6},
    "discrimination, any": {"by": "discrimination", "at": "any"},
    "ratio": {"by": "ratio", "outer": 2.0},
    "literal": {"by": "literal", "at": "any"},
    "merged": {"merge": True},
    "merged discrimination": {"merge": True, "by": "discrimination"},
}
CENTER, RADIUS = (0.4, 0.5, 0.6), 0.4
REGIONS = {"spot": {"sphere": {"center": list(CENTER), "radius": RADIUS}}}


@pytest.fixture(scope="module", params=RUNS.values(), ids=RUNS.keys())
def synthetic(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, list[OnePath]]:
    method, settings = request.param
    made = make_run(tmp_path_factory.mktemp("rank") / "run", method, seed=11, **settings)
    return made.folder, paths_of_synthetic(made, scatter(made))


@pytest.mark.parametrize("asked", QUESTIONS.values(), ids=QUESTIONS.keys())
def test_every_figure(synthetic: tuple[pathlib.Path, list[OnePath]], asked: Question) -> None:
    folder, paths = synthetic
    with open_run(folder, regions=REGIONS) as run:
        assert_same(rank(run, "spot", **asked), Expected(run, paths, CENTER, RADIUS, asked).table())


@pytest.mark.parametrize("asked", [{}, {"with_objects": True}, {"merge": True}], ids=str)
def test_whole_images(synthetic: tuple[pathlib.Path, list[OnePath]], asked: Question) -> None:
    folder, paths = synthetic
    with open_run(folder) as run:
        found = rank(run, **asked)
        assert_same(found, Expected(run, paths, None, 0.0, asked).table())
    assert sum(found["paths"].to_pylist()) == len(paths)
    assert found["cumulative"][-1].as_py() == pytest.approx(1)


def test_threads_change_no_bit(synthetic: tuple[pathlib.Path, list[OnePath]]) -> None:
    with open_run(synthetic[0], regions=REGIONS) as run:
        for asked in QUESTIONS.values():
            assert rank(run, "spot", threads=1, **asked).equals(rank(run, "spot", threads=3, **asked))


def test_merged_classes_are_sums(synthetic: tuple[pathlib.Path, list[OnePath]]) -> None:
    with open_run(synthetic[0], regions=REGIONS) as run:
        merged, single = rank(run, "spot", merge=True).to_pylist(), rank(run, "spot").to_pylist()
    sums: dict[str, list[float]] = collections.defaultdict(lambda: [0.0, 0, 0.0])
    for row in single:
        for k, name in enumerate(("flux", "paths")):
            sums[row["descriptor"]][k] += row[name]
        sums[row["descriptor"]][2] += row["flux_error"] ** 2
    assert {row["descriptor"]: (pytest.approx(row["flux"]), row["paths"]) for row in merged} == {k: tuple(v[:2]) for k, v in sums.items()}
    assert max(map(len, (merged, single))) > len(merged)
    # Errors are the merged sums' own, not sums of errors
    assert any(row["flux_error"] != pytest.approx(math.sqrt(sums[row["descriptor"]][2]), rel=1e-3) for row in merged)


# --- orders -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    made = make_run(tmp_path_factory.mktemp("orders") / "run", "path", seed=12, passes=16)
    scatter(made)
    with open_run(
        made.folder, regions=REGIONS | {"far": {"sphere": {"center": [9, 9, 9], "radius": 1}}, "all": {"sphere": {"center": [0, 0, 0], "radius": 9}}}
    ) as run:
        yield run


def test_supported_classes_come_first(run: Run) -> None:
    table = rank(run, "spot", by="discrimination", minimum_support=4)
    supported = table["supported"].to_pylist()
    assert supported == sorted(supported, reverse=True)
    assert 3 < sum(supported) < len(supported) - 3
    assert [row["samples"] >= 4 for row in table.to_pylist()] == supported
    lower = [row["lower"] or 0.0 for row in table.to_pylist() if row["supported"]]
    assert lower == sorted(lower, reverse=True)


def test_classes_without_walks_in_the_ring_have_a_bound(run: Run) -> None:
    table = rank(run, "spot", by="discrimination", with_objects=True, minimum_support=1)
    lonely = [row for row in table.to_pylist() if row["ring_samples"] == 0]
    assert lonely
    assert all(row["ratio"] is None and row["ring_share"] == 0 for row in lonely)
    bounded = [row["lower"] for row in lonely if row["lower"] is not None]
    assert bounded
    assert min(bounded) > 0


def test_a_walk_more_in_the_ring_lowers_the_bound() -> None:
    """The bound of few walks in the ring goes on where none ends, up to the support that needs no bound."""
    most = [stats.chi2.ppf(orders.LEVEL, 2 * (n + 1)) / 2 for n in range(31)]
    assert most[0] == pytest.approx(-math.log(1 - orders.LEVEL))  # the rule of three
    assert all(np.diff(most) > 0)
    assert all(stats.poisson.cdf(n, mean) == pytest.approx(1 - orders.LEVEL) for n, mean in enumerate(most))


@pytest.mark.parametrize("replicates", [1, 4])
def test_a_class_seen_once_is_never_first(tmp_path: pathlib.Path, replicates: int) -> None:
    """Where no class has the support, and even where no error is known and the ring has none of the class."""
    made = make_run(tmp_path / "run", "path", seed=3, passes=8, sampler="sobol", replicates=replicates)
    scatter(made)
    with open_run(made.folder, regions=REGIONS) as run:
        rows = rank(run, "spot", by="discrimination", minimum_support=10**6).to_pylist()
    once = [row["samples"] == 1 for row in rows]
    assert 3 < sum(once) < len(once)
    assert once == sorted(once)


def test_few_walks_in_the_ring_are_said(run: Run) -> None:
    """The error of a ratio rests on the ring, too: one walk there tells nothing of its error, however many are inside."""
    rows = rank(run, "spot", by="discrimination", with_objects=True, minimum_support=1).to_pylist()
    few = [row for row in rows if row["ring_samples"] < 20]
    assert len(few) > 3
    assert all(row["ring_verdict"] for row in few)
    assert {row["ring_verdict"] for row in few if row["ring_samples"] == 0} == {"no walks"}


def test_the_expression_to_copy_comes_last(run: Run) -> None:
    for by in orders.ORDERS:
        assert rank(run, "spot", by=by).column_names[-2:] == ["expression", "selection"]
    assert rank(run).column_names[-1] == "expression"


def test_literal_is_the_inverse_of_ratio(run: Run) -> None:
    ratio = {row["expression"]: row["ratio"] for row in rank(run, "spot", by="ratio").to_pylist()}
    literal = {row["expression"]: row["ratio"] for row in rank(run, "spot", by="literal").to_pylist()}
    assert ratio.keys() == literal.keys()
    assert all(ratio[key] * literal[key] == pytest.approx(1) for key in ratio)
    assert all(value >= 1 for value in literal.values())


def test_ties_go_by_flux_then_by_expression() -> None:
    names = ["d", "b", "a", "c", "e"]
    key, flux = np.array([1.0, 2.0, 2.0, 2.0, -np.inf]), np.array([9.0, 4.0, 4.0, 5.0, 1.0])
    order = _order(key, flux, np.zeros(5, int), lambda i: names[i], None)
    assert [names[i] for i in order] == ["c", "a", "b", "d", "e"]
    again = _order(key[::-1], flux[::-1], np.zeros(5, int), lambda i: names[::-1][i], None)
    assert [names[::-1][i] for i in again] == ["c", "a", "b", "d", "e"]


def test_top(run: Run) -> None:
    whole, short = rank(run, "spot", by="discrimination"), rank(run, "spot", by="discrimination", top=4)
    assert short.equals(whole.slice(0, 4).combine_chunks())


def test_one_replicate_has_no_errors(tmp_path: pathlib.Path) -> None:
    made = make_run(tmp_path / "run", "path", seed=3, passes=8, sampler="sobol", replicates=1)
    scatter(made)
    with open_run(made.folder, regions=REGIONS) as run:
        for by in orders.ORDERS:
            table = rank(run, "spot", by=by)
            assert table.num_rows > 10
            assert table["flux_error"].null_count == table["share_error"].null_count == table.num_rows
            assert not any(table["trusted"].to_pylist())
            assert all("replicate" in text for text in table["verdict"].to_pylist())
        # Without bounds, discrimination goes by the ratio; what the ring lacks comes first
        ratios = [math.inf if row["ratio"] is None else row["ratio"] for row in rank(run, "spot", by="discrimination", minimum_support=1).to_pylist()]
        assert ratios == sorted(ratios, reverse=True)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"region": "nowhere"}, "no region `nowhere`.*spot"),
        ({"region": "far"}, "no recorded path.*move or enlarge"),
        ({"region": "all", "by": "discrimination"}, "no recorded path.*around"),
        ({"region": "spot", "by": "beauty"}, "contribution, discrimination"),
        ({"region": "spot", "at": "nowhere"}, "seen or any"),
        ({"region": "spot", "top": 0}, "1 or more"),
        ({"by": "discrimination"}, "name a region"),
        ({"region": "spot", "merge": True, "with_objects": True}, "not for both"),
        ({"region": "spot", "by": "ratio", "outer": 0.5}, "factor of 1"),
    ],
)
def test_what_cannot_be_ranked(run: Run, asked: Question, said: str) -> None:
    with pytest.raises(QueryError, match=said):
        rank(run, **asked)


def test_runs_without_paths_are_refused(tmp_path: pathlib.Path) -> None:
    make_run(tmp_path / "run", keep=0.0)
    with open_run(tmp_path / "run") as run, pytest.raises(QueryError, match="recorded no paths"):
        rank(run)


# --- rendered runs ------------------------------------------------------------------------------------------------


def render(place: pathlib.Path, text: str) -> pathlib.Path:
    place.mkdir(exist_ok=True)
    (place / "job.yaml").write_text(f"name: spheres\nscene: {SCENE}\nrender: {{{text}}}\n")
    return run_job(place / "job.yaml", out=place / "run", threads=1).path


PLACE: tuple[Point, float] = (0.4, 0.0, 0.2), 0.5
SAMPLERS = {"path": "sampler: sobol, replicates: 3", "light": "sampler: independent"}


@pytest.fixture(scope="module", params=["path", "light"])
def rendered(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    text = f"method: {request.param}, resolution: [24, 24], samples: 12, seed: 3, {SAMPLERS[request.param]}, max_depth: 6"
    folder = render(tmp_path_factory.mktemp("rendered") / request.param, text)
    with open_run(folder, regions={"spot": {"sphere": {"center": list(PLACE[0]), "radius": PLACE[1]}}}) as run:
        yield run


@pytest.mark.parametrize("asked", [*QUESTIONS.values(), {"with_objects": True, "by": "discrimination", "at": "any"}], ids=str)
def test_rendered_runs(rendered: Run, asked: Question) -> None:
    assert_same(rank(rendered, "spot", **asked), Expected(rendered, paths_of_run(rendered), *PLACE, asked).table())


def test_many_walks_in_the_ring_are_trusted(rendered: Run) -> None:
    verdicts = {row["ring_verdict"] is None for row in rank(rendered, "spot", by="ratio", at="any", outer=4.0).to_pylist()}
    assert verdicts == {True, False}


def test_selections_select_the_paths(rendered: Run) -> None:
    """The image of a class's selection sums to its flux."""
    for asked in ({"at": "seen"}, {"at": "any", "with_objects": True}, {"at": "seen", "merge": True}):
        for row in rank(rendered, "spot", top=3, **asked).to_pylist():
            image = aov_image(rendered, rendered.compile(row["selection"]))
            assert float((image.astype(np.float64) @ [0.2126, 0.7152, 0.0722]).sum()) == pytest.approx(row["flux"], rel=1e-5)


@pytest.mark.parametrize("sampler", ["independent", "sobol, replicates: 8"])
def test_errors_match_the_spread_of_renders(tmp_path: pathlib.Path, sampler: str) -> None:
    """Renders of many seeds: the variance between them is that which each of them tells (F test, Šidák over what is compared)."""
    renders, found = 24, collections.defaultdict(list)
    for seed in range(renders):
        folder = render(tmp_path / str(seed), f"method: path, resolution: [12, 12], samples: 16, seed: {seed}, sampler: {sampler}, max_depth: 4")
        with open_run(folder) as run:
            for row in rank(run, merge=True).to_pylist():
                if row["trusted"]:
                    found[row["descriptor"]].append((row["flux"], row["flux_error"], row["share"], row["share_error"]))
            dof = Units.of_run(run).dof
    trusted = {name: np.array(rows) for name, rows in found.items() if len(rows) == renders}
    assert len(trusted) >= 2
    for rows in trusted.values():
        for value, error in ((rows[:, 0], rows[:, 1]), (rows[:, 2], rows[:, 3])):
            p = stats.f.cdf(value.var(ddof=1) / np.mean(error**2), renders - 1, renders * dof)
            assert 2 * min(p, 1 - p) > 1 - 0.99 ** (1 / (2 * len(trusted)))
