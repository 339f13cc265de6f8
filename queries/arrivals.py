"""Light on its way: at which vertices of walks light arrives that a selection holds.

The vertex plays the other end of the path. Light that arrives at a vertex of a light walk has a word as if the camera were there: `C L`
comes straight from an emitter, `C D L` by one diffuse bounce, `C S+ L` through mirrors and glass. Importance that arrives at a vertex of a
camera walk is read as if a light were there: `C D L` has come from the camera by one diffuse bounce.
"""

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from queries.by_vertices import sensor_origin
from queries.errors import QueryError
from queries.horizon import Horizon
from queries.kernels.arrivals import WalkAutomaton, fold_arrivals, keep_reached
from queries.kernels.vertices import Vertices
from queries.lpe import Expression
from queries.lpe.dfa import read_backward
from queries.lpe.limits import Work
from queries.lpe.nfa import bits as members
from queries.regions import Polygon, Region
from queries.run import Run
from queries.selection import FilmArea, Selection
from queries.shards import Piece
from queries.symbols import Symbols
from renderer.tables import ESCAPED, NO_OBJECT

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
Chosen = npt.NDArray[np.bool_]
Side = Literal["light", "camera"]
_FAR = 4.0  # extents of the scene: regions may lie outside it
_XYZ = ("x", "y", "z")
_OF_WHOLE_PATHS = ("technique", "s", "t", "blocker")


class Arrivals:
    """A selection made ready for the walks of one run. Threads may share it.

    ``side``: whose walks. ``table``: among whose rows it chooses; ``tables``: those that pieces must have; ``per_walk``: the factor that makes
    sums of throughputs over a run estimates of flux (of camera walks: of shares of all importance).

    Raises ``QueryError`` for an expression that asks for what only whole paths have.
    """

    def __init__(self, run: Run, selection: Selection, side: str = "light") -> None:
        if side not in ("light", "camera"):
            raise QueryError(f"expected walks from the `light` or from the `camera`, found `{side}`")
        self.table = f"{side}_vertices"
        if self.table not in run.tables or run.settings["keep"] <= 0:
            raise QueryError(f"`{run.path}` has no {side} walks: `queries.inspection.walks_of` finds those that it may have elsewhere")
        self.tables: tuple[str, ...] = (self.table,)
        settings = run.settings
        self.per_walk = 1.0 / (settings["passes"] * settings["width"] * settings["height"] * settings["keep"])
        self._walks = Walks(run, side)
        self._word = _Word(run, selection.expression, side, self._walks) if selection.expression is not None else None
        self._film = selection.film if side == "camera" else None
        self._regions = [region for region in (selection.region, _seen_in(selection.film) if side == "light" else None) if region is not None]
        for region in self._regions:
            region.check(run.geometry)

    def select(self, piece: Piece) -> Chosen:
        """Whether each row of ``table`` is an arrival that the selection holds: bool (rows).

        Arrivals are all rows but those of depth 0: wherever light met a surface, also where its walk ended, and where it left the scene.
        A selection's region holds what interacts there on its way, or arrives there; its film area, what does so where the camera sees it in that
        area (of camera walks: what began in a pixel there).
        """
        depth = piece.column(self.table, "depth")
        chosen = np.empty(len(depth), np.bool_)
        if self._word is None:
            np.greater(depth, 0, out=chosen)
        else:
            self._word.fold(piece, chosen)
        for region in self._regions:
            keep_reached(depth, self._walks.inside(piece, region), chosen)
        if self._film is not None:
            chosen &= self._walks.began_in(piece, self._film)
        return chosen

    def segments(self, piece: Piece, rows: I64) -> tuple[F32, F32]:
        """The segments that lead to these rows (depth 1 and more): start and end, float32 (k, 3) each, world units.

        A row that escaped ends at the scene's ``Horizon``. A walk from an infinite emitter begins on a disk beside the scene.
        """
        return self._walks.segments(piece, rows)

    def reach(self) -> tuple[F64, float]:
        """Where all light is known: in the ball of this center (3,) and radius, world units; beyond it, meters would show too little.

        Emitters at infinity send their walks into the ball around the surfaces, and others are followed as far as ``segments`` says.
        """
        return self._walks.reach()


class Walks:
    """The vertices of one side: where they are, what leads to them, how each walk began."""

    def __init__(self, run: Run, side: str) -> None:
        self.side = side
        self.table = f"{side}_vertices"
        self._run = run
        self._eye = sensor_origin(run) if side == "camera" else np.zeros(3, np.float32)
        self.beginnings = Beginnings(run) if side == "light" else None

    def points(self, piece: Piece) -> F32:
        """Positions, float32 (rows, 3); directions where walks escaped."""
        return piece.once(("points", self.table), lambda: np.stack([piece.column(self.table, axis) for axis in _XYZ], axis=1))

    def inside(self, piece: Piece, region: Region) -> Chosen:
        """Whether each row is a point in the region: bool (rows). Of depth 0, only emitters that are somewhere."""
        return piece.once(("inside", self.table, region), lambda: self._inside(piece, region))

    def crosses(self, piece: Piece, region: Region) -> Chosen:
        """Whether the segment that leads to each row crosses the region: bool (rows). Rays from and to infinity reach beyond the scene."""
        return piece.once(("crosses", self.table, region), lambda: self._crosses(piece, region))

    def segments(self, piece: Piece, rows: I64) -> tuple[F32, F32]:
        """See ``Arrivals.segments``."""
        start, way = self._ways(piece, rows)
        end = self.points(piece)[rows]
        gone = np.flatnonzero(piece.column(self.table, "event")[rows] == ESCAPED)
        if len(gone):
            end[gone] = self._horizon().leave(start[gone], way[gone])
        return start, end

    def reach(self) -> tuple[F64, float]:
        """See ``Arrivals.reach``."""
        horizon = self._horizon()
        if self.beginnings is None or self.beginnings.far not in self.beginnings.emitters:
            return horizon.center, horizon.radius
        try:
            low, high = self._run.geometry.caster.bounds
        except QueryError:  # surfaces that are not stored: any point may be among them
            return horizon.center, np.inf
        return horizon.center, float(np.linalg.norm(high - low)) / 2

    def _horizon(self) -> Horizon:
        geometry = self._run.geometry
        return geometry.once("horizon", lambda: Horizon.of(geometry))

    def began_in(self, piece: Piece, film: FilmArea) -> Chosen:
        """Whether the center of the pixel that each row's camera walk began in lies in an area of the film."""
        width, height = self._run.settings["width"], self._run.settings["height"]
        left, top, right, bottom = film
        x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
        there = ((y >= top) & (y < bottom))[:, None] & ((x >= left) & (x < right))
        found: Chosen = there.ravel()[piece.column(self.table, "walk") % (width * height)]
        return found

    def _inside(self, piece: Piece, region: Region) -> Chosen:
        there = piece.column(self.table, "event") != ESCAPED
        depth = piece.column(self.table, "depth")
        if self.beginnings is None:
            there &= depth > 0
        else:
            there &= (depth > 0) | ~self.beginnings.infinite(piece)
        rows = np.flatnonzero(there)
        inside = np.zeros(len(there), np.bool_)
        inside[rows] = region.contains(self._run.geometry, self.points(piece)[rows], piece.column(self.table, "object")[rows].astype(np.int32))
        return inside

    def _crosses(self, piece: Piece, region: Region) -> Chosen:
        rows = np.flatnonzero(piece.column(self.table, "depth") > 0)
        start, way = self._ways(piece, rows)
        escaped = piece.column(self.table, "event")[rows] == ESCAPED
        far = np.float32(_FAR * self._run.geometry.extent)
        end = np.where(escaped[:, None], start + far * way, self.points(piece)[rows])
        if self.beginnings is not None:
            # Light from infinity comes from beyond the disk that its walk began on
            first = np.flatnonzero((piece.column(self.table, "depth")[rows] == 1) & (rows > 0))
            first = first[self.beginnings.infinite(piece)[rows[first] - 1]]
            toward = start[first] - end[first]
            toward /= np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), np.float32(1e-30))
            start[first] = end[first] + far * toward
        crosses = np.zeros(piece.rows(self.table), np.bool_)
        crosses[rows] = region.crosses(self._run.geometry, start, end)
        return crosses

    def _ways(self, piece: Piece, rows: I64) -> tuple[F32, F32]:
        """Where the segments to rows start, and the rows' own places: directions where they escaped."""
        points, depth = self.points(piece), piece.column(self.table, "depth")
        before = np.maximum(rows - 1, 0)
        start = points[before]
        alone = (depth[rows] == 1) & ((rows == 0) | (depth[before] != 0))
        start[alone] = self._eye if self.side == "camera" else points[rows[alone]]
        return start, points[rows]


class Beginnings:
    """What the first vertices of light walks, of depth 0, tell of their emitters: the object, and whether the emitter is at infinity.

    A kind of beginning is a number: an object, or ``near`` or ``far``, of emitters that are no objects.
    """

    def __init__(self, run: Run) -> None:
        self._objects = run.tables["objects"].num_rows
        self.near, self.far = self._objects, self._objects + 1
        self.kinds = self._objects + 2
        self.emitters: dict[int, list[dict[str, Any]]] = {}
        for row in sorted(run.tables["emitters"].to_pylist(), key=lambda row: row["emitter"]):
            at_infinity = self.far if row.get("infinite") else self.near
            self.emitters.setdefault(at_infinity if row["object"] is None else row["object"], []).append(row)

    def of(self, piece: Piece) -> I32:
        """The kind of beginning of each row of depth 0: int32 (rows), meaningless elsewhere."""
        return piece.once("beginnings", lambda: self._of(piece))

    def infinite(self, piece: Piece) -> Chosen:
        """Whether each row is of depth 0, of an emitter at infinity: bool (rows)."""
        return piece.once("infinite beginnings", lambda: (self.of(piece) == self.far) & (piece.column("light_vertices", "depth") == 0))

    def _of(self, piece: Piece) -> I32:
        thing = piece.column("light_vertices", "object")
        kind: I32 = np.minimum(thing, self.near).astype(np.int32)
        if self.far in self.emitters:
            # A point at infinity shows no radiance to the lens, whatever the ray that leaves it carries
            dark = np.ones(len(kind), np.bool_)
            for channel in "rgb":
                dark &= piece.column("light_vertices", f"throughput_{channel}") == 0
            kind[(kind == self.near) & (dark if self.near in self.emitters else True)] = self.far
        return kind


class _Word:
    """An expression folded over walks from their beginnings."""

    def __init__(self, run: Run, expression: Expression, side: str, walks: Walks) -> None:
        _refuse(expression, side)
        symbols = Symbols(run, expression)
        self._places = symbols.places
        self._regions = [run.regions[name] for _, name in symbols.places]
        for region in self._regions:
            region.check(run.geometry)
        self._walks = walks
        self._at = sum(1 << k for k, (field, _) in enumerate(symbols.places) if field == "region")
        words = run.words
        table = symbols.interactions(words.event[2:], words.object[2:])
        make = self._from_light if side == "light" else self._from_camera
        self._automaton = make(run, expression, symbols, table)

    def fold(self, piece: Piece, chosen: Chosen) -> None:
        """Set ``chosen`` (rows)."""
        table = self._walks.table
        event, thing, depth = (piece.column(table, name) for name in ("event", "object", "depth"))
        bits = np.zeros(len(depth), np.uint8)
        for k, ((field, _), region) in enumerate(zip(self._places, self._regions)):
            bits |= getattr(self._walks, "inside" if field == "region" else "crosses")(piece, region).astype(np.uint8) << np.uint8(k)
        beginnings = self._walks.beginnings
        beginning = beginnings.of(piece) if beginnings is not None else np.zeros(1, np.int32)
        fold_arrivals(self._automaton, depth, Vertices(event, thing, bits), beginning, chosen)

    def _from_camera(self, run: Run, expression: Expression, symbols: Symbols, table: I32) -> WalkAutomaton:
        """Camera walks are read as expressions are, and end with a light."""
        transitions, nothing = expression.dfa.transitions, np.full(1, NO_OBJECT, np.int32)
        eye = sensor_origin(run).reshape(1, 3)
        place = 0
        for k, ((field, _), region) in enumerate(zip(self._places, self._regions)):
            place |= int(field == "region" and bool(region.contains(run.geometry, eye, nothing)[0])) << k
        starts = np.full((1, len(symbols.camera)), transitions[0, symbols.camera[place]], np.int32)
        light = np.array(symbols.row("L", None, (), ()), np.int32)
        accepted = expression.dfa.accepting[transitions[:, light]]
        return WalkAutomaton(table, starts, transitions, accepted, np.uint8(255), np.uint8(0), np.uint8(255))

    def _from_light(self, run: Run, expression: Expression, symbols: Symbols, table: I32) -> WalkAutomaton:
        """Light walks are read from the ends of words. A segment belongs to the event at its end away from the camera: where light comes from."""
        backward = read_backward(expression.dfa, Work())
        after = np.array(backward.after, np.int32)
        beginnings = self._walks.beginnings
        assert beginnings is not None
        starts = np.full((beginnings.kinds, len(symbols.camera)), -1, np.int32)
        for kind, rows in beginnings.emitters.items():
            found = [after[symbols.row(type, None, labels, facts)] for type, labels, facts in map(symbols.emitter, rows)]
            other = next((i for i, state in enumerate(found) if (state != found[0]).any()), 0)
            if other:
                raise _ambiguous(expression, rows[0], rows[other])
            starts[kind] = found[0]
        ends = expression.dfa.transitions[0, symbols.camera]
        accepted = np.zeros((len(backward.sets), expression.dfa.states), np.bool_)
        for number, states in enumerate(backward.sets):
            accepted[number, list(members(states))] = True
        at = np.uint8(self._at)
        return WalkAutomaton(table, starts, backward.transitions, accepted[:, ends], at, np.uint8(255 - self._at), at)


def _refuse(expression: Expression, side: str) -> None:
    """Raise ``QueryError`` for what light on its way does not have."""
    asked = [field for field in _OF_WHOLE_PATHS if field in expression.tests]
    if asked:
        raise QueryError(
            f"`{expression}` tests `{asked[0]}:`, which whole paths have and light on its way to a point has not: "
            "expected events, objects, materials, lights, regions and depths. Leave the test out"
        )
    if side == "camera" and "light" in expression.tests:
        raise QueryError(
            f"`{expression}` tests `light:`, and camera walks on their way have met no light: leave the test out, or ask for light walks"
        )
    prefixes = [prefix for prefix in expression.prefixes if prefix != "noclamp"]
    if prefixes:
        raise QueryError(f"`{expression}` has the prefix `{prefixes[0]};`, which is about images: expected an expression without it, found that")


def _ambiguous(expression: Expression, first: dict[str, Any], second: dict[str, Any]) -> QueryError:
    names = " and ".join(f"`{row['name'] or row['emitter']}` ({row['symbol']})" for row in (first, second))
    return QueryError(
        f"`{expression}` tells the emitters {names} apart, and light walks do not say which of them they left, as neither is an object: "
        "expected an expression that takes both, such as one that ends in `[LOB]`"
    )


def _seen_in(film: FilmArea | None) -> Polygon | None:
    """What the camera sees in an area of the film."""
    if film is None:
        return None
    left, top, right, bottom = film
    return Polygon((((left, top), (right, top), (right, bottom), (left, bottom)),))
