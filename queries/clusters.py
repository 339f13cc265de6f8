"""Light at a probe as a few arrows: grouped by where it interacted last before it came there, and by the interactions before that.

The arrows of reiner2012: each is one kind of last interaction, an event on an object or on a group of objects (a lamp and its shade), or an
emitter. Further levels of ``history`` branch each arrow by the interaction before, as a tree.
"""

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals, Beginnings
from queries.errors import QueryError
from queries.inspection import walks_of
from queries.probes import Passing, Probe, passing, require_reach
from queries.run import Run
from queries.selection import Selection
from queries.shards import Piece, map_shards
from queries.statistics import Units
from renderer.tables import EMITTER, EVENTS, LENS

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
MOST_HISTORY = 3
_TYPES = {"R": "reflection", "T": "transmission"}
_SCATTERINGS = {"D": "diffuse", "G": "glossy", "S": "specular", "s": "straight"}
_WORDS = {e.key: f"{_SCATTERINGS[e.scattering]} {_TYPES[e.type]}" if e.scattering else e.lobe for e in EVENTS}
_EVENTS = max(_WORDS) + 1


@dataclass(frozen=True, eq=False)
class Arrow:
    """One cluster of light on its way to the probe.

    ``label``: in words; ``objects``: names, all members of a group; ``event``: "emitter", "diffuse reflection", …, "" for a group. ``level``: 1
    leads to the probe, 2 to the start of a level 1, …; ``parent``: the index of that one among ``Clusters.arrows``, -1 at level 1. ``start``:
    the real start that is nearest to ``mean_start``; ``end``: the mean end; means are weighted by flux; float64 (3), world. ``value``: float64
    (3), flux / world unit² at the probe, ``error`` of its luminance, ``share`` of all that comes there, by luminance; ``count``: segments.
    """

    label: str
    objects: tuple[str, ...]
    event: str
    level: int
    parent: int
    start: F64
    mean_start: F64
    end: F64
    value: F64
    share: float
    error: float
    count: int


@dataclass(frozen=True, eq=False)
class Clusters:
    """The arrows at a probe, parents before their children, else the strongest first.

    ``value``: float64 (3), fluence or irradiance at the probe, flux / world unit², and ``value_error`` of its luminance; ``dropped``: the share
    of it whose arrows at level 1 were below the threshold; ``count``: segments.
    """

    arrows: tuple[Arrow, ...]
    value: F64
    value_error: float
    dropped: float
    count: int


def clusters(
    run: Run,
    selection: Selection,
    probe: Probe,
    groups: Mapping[str, Sequence[str]] | None = None,
    threshold: float = 0.01,
    history: int = 1,
    side: str = "light",
    threads: int | None = None,
) -> Clusters:
    """Selected light at a probe as arrows.

    ``groups``: names of objects that count as one, by the group's name; ``threshold``: the least share of an arrow; ``history``: how many
    levels. Goes over the walks twice, once for sums and once for the starts nearest to the means. The sums have the same bits on any number of
    threads. Raises ``QueryError`` where the run has no such walks, for unknown objects, for objects in two groups, and for a probe beyond where
    light is known.
    """
    if not 0 <= threshold < 1 or not 1 <= history <= MOST_HISTORY:
        raise QueryError(f"expected a threshold of 0 or more and below 1, and a history of 1 to {MOST_HISTORY}, found {threshold} and {history}")
    with walks_of(run, side) as found:
        arrivals, units = Arrivals(found, selection, side), Units.of_run(found)
        require_reach(arrivals, probe)
        kinds = _Kinds(found, side, groups or {}, history)
        files, threads = found.files(*arrivals.tables), threads or found.threads
        trees = list(map_shards(files, functools.partial(_sum_shard, arrivals, units, probe, kinds, history), threads))
        levels = [_merged([tree[level] for tree in trees], units.count) for level in range(history)]
        total = levels[0].units.sum(axis=0)
        kept = _kept(levels, threshold)
        starts = [(level.keys[rows], level.starts[rows] / level.weight[rows, None]) for level, rows in zip(levels, kept)]
        nearest = _nearest(list(map_shards(files, functools.partial(_nearest_in_shard, arrivals, units, probe, kinds, starts), threads)))
    whole = units.jackknife(lambda sums: sums * arrivals.per_walk, total)
    arrows = _arrows(levels, kept, nearest, kinds, units, arrivals.per_walk)
    below = np.delete(levels[0].weight, kept[0]).sum()
    value = levels[0].flux.sum(axis=0) * arrivals.per_walk
    dropped = float(below / levels[0].weight.sum()) if below > 0 else 0.0
    return Clusters(tuple(arrows), value, float(whole.error), dropped, int(levels[0].count.sum()))


# --- kinds of interactions ----------------------------------------------------------------------------------------


class _Kinds:
    """Interactions as numbers: event x objects' kinds, in which groups come after objects, then what is no object."""

    def __init__(self, run: Run, side: str, groups: Mapping[str, Sequence[str]], history: int) -> None:
        self.side = side
        rows = run.tables["objects"].to_pylist()
        self._names: dict[int, str] = {row["object"]: row["name"] for row in rows}
        self._groups = list(groups.items())
        self._nothing = max(self._names, default=-1) + 1  # also where groups begin
        self.beginnings = Beginnings(run) if side == "light" else None
        self._kind = np.arange(self._nothing + 1)
        for number, (name, members) in enumerate(self._groups):
            for member in members:
                key = run.geometry.object_id(member)
                if self._kind[key] != key:
                    other = self._groups[self._kind[key] - self._nothing - 1][0]
                    raise QueryError(f"expected objects in one group each, found `{member}` in `{other}` and in `{name}`: leave it out of one")
                self._kind[key] = self._nothing + 1 + number
        self._far = self._nothing + 1 + len(self._groups)
        self.base = 1 + _EVENTS * (self._far + 1)  # of keys, whose digits are numbers + 1, 0 where there is no interaction
        self.lens = LENS * (self._far + 1) + self._nothing
        if self.base**history >= 2**63:
            raise QueryError(f"a history of {history} is too long for the {len(rows):,} objects of the scene: expected {history - 1} or less")

    def of(self, piece: Piece, rows: I64) -> I64:
        """The kind of the vertex in each row."""
        table = f"{self.side}_vertices"
        event, thing = piece.column(table, "event")[rows].astype(np.int64), piece.column(table, "object")[rows].astype(np.int64)
        kind = self._kind[np.minimum(thing, self._nothing)]
        if self.beginnings is not None:
            kind = np.where(self.beginnings.infinite(piece)[rows], self._far, kind)
        grouped = (kind > self._nothing) & (kind < self._far)
        return np.where(grouped, 0, event) * (self._far + 1) + kind

    def words(self, number: int) -> tuple[str, tuple[str, ...], str]:
        """A kind's label, objects and event."""
        event, kind = divmod(number, self._far + 1)
        if self._nothing < kind < self._far:
            name, members = self._groups[kind - self._nothing - 1]
            return name, tuple(members), ""
        if event == LENS:
            return "camera", (), "lens"
        if event == EMITTER:
            if kind < self._nothing:
                return f"emitter {self._names[kind]}", (self._names[kind],), "emitter"
            known = self.beginnings
            rows = known.emitters.get(known.far if kind == self._far else known.near, []) if known else []
            names = [row["name"] or row.get("kind") or "unnamed" for row in rows]
            return ("emitters " if len(names) > 1 else "emitter ") + ", ".join(names), (), "emitter"
        said = _WORDS[event]
        return (f"{said} by {self._names[kind]}", (self._names[kind],), said) if kind < self._nothing else (said, (), said)


# --- sums ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Level:
    """Sums by key, in the keys' order: ``units`` (n, units) of luminance, ``flux`` (n, 3), ``weight`` (n), its luminance, ``starts`` and ``ends``
    (n, 3), positions times that, ``count`` (n).
    """

    keys: I64
    units: F64
    flux: F64
    weight: F64
    starts: F64
    ends: F64
    count: I64


@dataclass(frozen=True, eq=False)
class _Steps:
    """One level's segments of what passes the probe: ``chosen`` (k) among these, their ``keys``, ``start`` and ``end`` (k, 3)."""

    chosen: I64
    keys: I64
    start: F64
    end: F64


def _steps(arrivals: Arrivals, kinds: _Kinds, light: Passing, piece: Piece, history: int) -> Iterator[_Steps]:
    """The segments of each level. A key holds the kinds of interactions from the probe backward, the last one in its lowest digits."""
    table = arrivals.table
    walk, depth = piece.column(table, "walk"), piece.column(table, "depth")
    chosen, rows = np.arange(len(light.rows)), light.rows
    keys, scale = np.zeros(len(rows), np.int64), 1
    start, end = light.start.astype(np.float64), light.at
    for level in range(history):
        before = rows - 1
        there = (before >= 0) & (walk[np.maximum(before, 0)] == walk[rows])
        kind = np.full(len(rows), kinds.lens, np.int64)
        kind[there] = kinds.of(piece, before[there])
        keys = keys + (kind + 1) * scale
        scale *= kinds.base
        yield _Steps(chosen, keys, start, end)
        # Those whose segment began at a walk's first vertex have no history beyond
        if level + 1 < history:
            deeper = there & (depth[np.maximum(before, 0)] > 0)
            chosen, keys, rows = chosen[deeper], keys[deeper], before[deeper]
            starts, _ = arrivals.segments(piece, rows)
            start, end = starts.astype(np.float64), start[deeper]


def _sum_shard(arrivals: Arrivals, units: Units, probe: Probe, kinds: _Kinds, history: int, found: Iterator[Piece]) -> list[_Level]:
    parts: list[list[_Level]] = [[] for _ in range(history)]
    for piece in found:
        light = passing(arrivals, units, probe, piece)
        for level, steps in enumerate(_steps(arrivals, kinds, light, piece, history)):
            parts[level].append(_summed(light, steps, units.count))
        piece.forget()
    return [_merged(part, units.count) for part in parts]


def _summed(light: Passing, steps: _Steps, units: int) -> _Level:
    keys, group = np.unique(steps.keys, return_inverse=True)
    group, n = group.ravel(), len(keys)
    weight = light.luminance[steps.chosen]

    def sums(values: F64) -> F64:
        return np.stack([np.bincount(group, weights=values[:, i], minlength=n) for i in range(3)], axis=1)

    by_unit = np.bincount(group * units + light.unit[steps.chosen], weights=weight, minlength=n * units).astype(np.float64).reshape(n, units)
    flux = sums(light.flux[steps.chosen])
    total = np.bincount(group, weights=weight, minlength=n).astype(np.float64)
    return _Level(keys, by_unit, flux, total, sums(weight[:, None] * steps.start), sums(weight[:, None] * steps.end), np.bincount(group, minlength=n))


def _merged(parts: list[_Level], units: int) -> _Level:
    """Sums of several parts, added in their order."""
    keys = np.unique(np.concatenate([np.zeros(0, np.int64), *(part.keys for part in parts)]))
    n = len(keys)
    made = _Level(keys, np.zeros((n, units)), np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n, np.int64))
    for part in parts:
        at = np.searchsorted(keys, part.keys)
        for name in ("units", "flux", "weight", "starts", "ends", "count"):
            getattr(made, name)[at] += getattr(part, name)
    return made


# --- from sums to arrows ------------------------------------------------------------------------------------------


def _kept(levels: list[_Level], threshold: float) -> list[I64]:
    """The rows of each level that carry at least so large a share of all; a row's parent carries no less."""
    total = levels[0].weight.sum()
    return [np.flatnonzero((level.weight >= threshold * total) & (level.weight > 0)) for level in levels]


_Nearest = tuple[F64, F64]  # squared distances (n) and starts (n, 3)


def _nearest_in_shard(
    arrivals: Arrivals, units: Units, probe: Probe, kinds: _Kinds, wanted: list[tuple[I64, F64]], found: Iterator[Piece]
) -> list[_Nearest]:
    """For each level's keys and mean starts, the start that is nearest to the mean."""
    best = [(np.full(len(keys), np.inf), means.copy()) for keys, means in wanted]
    for piece in found:
        light = passing(arrivals, units, probe, piece)
        for level, steps in enumerate(_steps(arrivals, kinds, light, piece, len(wanted))):
            keys, means = wanted[level]
            at = np.searchsorted(keys, steps.keys)
            rows = np.flatnonzero((at < len(keys)) & (keys[np.minimum(at, len(keys) - 1)] == steps.keys)) if len(keys) else np.zeros(0, np.int64)
            at = at[rows]
            squared = np.sum((steps.start[rows] - means[at]) ** 2, axis=1)
            order = np.lexsort((*steps.start[rows].T, squared, at))
            first = order[np.diff(at[order], prepend=-1) > 0]
            _take_nearer(best[level], at[first], squared[first], steps.start[rows[first]])
        piece.forget()
    return best


def _nearest(parts: list[list[_Nearest]]) -> list[F64]:
    """The starts of each level that are nearest in any part."""
    best = parts[0]
    for part in parts[1:]:
        for mine, (squared, starts) in zip(best, part):
            _take_nearer(mine, np.arange(len(squared)), squared, starts)
    return [starts for _, starts in best]


def _take_nearer(best: _Nearest, at: I64, squared: F64, starts: F64) -> None:
    nearer = squared < best[0][at]
    best[0][at[nearer]], best[1][at[nearer]] = squared[nearer], starts[nearer]


def _arrows(levels: list[_Level], kept: list[I64], nearest: list[F64], kinds: _Kinds, units: Units, per_walk: float) -> list[Arrow]:
    arrows: list[Arrow] = []
    total, index, scale = levels[0].weight.sum(), {0: -1}, 1  # index: of the arrow of each key, 0 for the probe
    for number, (level, rows, starts) in enumerate(zip(levels, kept, nearest), start=1):
        errors = units.jackknife(lambda sums: sums * per_walk, level.units[rows]).error
        for k in sorted(range(len(rows)), key=lambda k: (-level.weight[rows[k]], level.keys[rows[k]])):
            row, weight = rows[k], level.weight[rows[k]]
            key = int(level.keys[row])
            parent, last = key % scale, key // scale
            label, objects, event = kinds.words(last - 1)
            index[key] = len(arrows)
            mean, end, value = level.starts[row] / weight, level.ends[row] / weight, level.flux[row] * per_walk
            share, count = float(weight / total), int(level.count[row])
            arrows.append(Arrow(label, objects, event, number, index[parent], starts[k], mean, end, value, share, float(errors[k]), count))
        scale *= kinds.base
    return arrows
