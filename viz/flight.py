"""When light is where: the segments of paths, each with the length that light has travelled at its two ends, and what lies between two such lengths.

Time of flight [jarabo2014]: time is told as travelled length, world units, that is, in units of the length over the speed of light. Tables keep no
indices of refraction, so that the optical length of a segment is taken to be its geometric length.

Light of a finite emitter leaves it at length 0. Light from infinity comes as plane waves, one for each direction, whose points are in phase on planes
perpendicular to it: length 0 is the plane that touches the sphere around the scene where the wave comes in.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.path_sample import PathSample

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True)
class Flight:
    """Segments in the order of their paths, as light travels. ``s`` of them, of ``n`` paths.

    ``begin``, ``end``: float64 (s, 3), world; ``leaves``, ``arrives``: float64 (s), the travelled length there; ``path``: int64 (s), the row of the
    sample; ``vertex``: int64 (s), the sample's vertex that the segment leaves; ``bounce``: int64 (s), how many interactions are behind it;
    ``arrival``: float64 (n), the travelled length at the camera.
    """

    begin: F64
    end: F64
    leaves: F64
    arrives: F64
    path: I64
    vertex: I64
    bounce: I64
    arrival: F64

    def __len__(self) -> int:
        """How many segments there are."""
        return len(self.path)

    @property
    def departure(self) -> F64:
        """The travelled length at which the light of each path leaves for the camera; of what the camera sees directly, at which it arrives."""
        last = np.searchsorted(self.path, np.arange(len(self.arrival)), side="right") - 1
        first = np.searchsorted(self.vertex, self.vertex[last])  # of the pieces that a bent segment has
        return np.where(self.bounce[last] > 0, self.leaves[first], self.arrival)

    def between(self, low: float, high: float) -> "tuple[I64, Flight]":
        """The part of each segment that light passes between two travelled lengths, cut exactly: which segments have one, and these parts."""
        first, last = np.maximum(self.leaves, low), np.minimum(self.arrives, high)
        rows = np.flatnonzero(first < last)
        first, last = first[rows], last[rows]
        way, length = self.end[rows] - self.begin[rows], self.arrives[rows] - self.leaves[rows]
        # Ends that are not cut stay as they are, bit for bit
        begin, end = self.begin[rows], self.end[rows]
        late, early = np.flatnonzero(first > self.leaves[rows]), np.flatnonzero(last < self.arrives[rows])
        shares = (first[late] - self.leaves[rows[late]]) / length[late], (last[early] - self.leaves[rows[early]]) / length[early]
        end[early] = begin[early] + shares[1][:, None] * way[early]
        begin[late] += shares[0][:, None] * way[late]
        return rows, Flight(begin, end, first, last, self.path[rows], self.vertex[rows], self.bounce[rows], self.arrival)


def windows(low: float, high: float, window: float, count: int) -> Iterator[tuple[float, float]]:
    """The lengths that each frame shows: the first from ``low`` on, the last up to ``high``; where count x window = high - low, each length once."""
    step = (high - low - window) / (count - 1) if count > 1 else 0.0
    return ((low + i * step, low + i * step + window) for i in range(count))


def flight(sample: PathSample, center: F64, radius: float) -> Flight:
    """The segments of sampled paths. ``center`` (3,) and ``radius``: the sphere around the scene and its camera, world units."""
    points, start = sample.points.astype(np.float64), sample.start
    first = start[:-1]
    vertex = np.delete(np.arange(len(points)), start[1:] - 1)  # all but the last of each path
    # Where a wave from infinity is in phase: the plane that touches the sphere
    far = first[sample.infinite]
    way = points[far + 1] - points[far]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), _TINY)
    phase = np.einsum("ij,ij->i", points[far + 1] - center, way) + radius
    points[far] = points[far + 1] - np.maximum(phase, 0.0)[:, None] * way
    # Travelled lengths, from 0 at each emitter (or below, where a camera looks away from the wave's plane)
    length = np.zeros(len(points))
    length[vertex] = np.linalg.norm(points[vertex + 1] - points[vertex], axis=1)
    travelled = np.cumsum(length) - length
    path = np.repeat(np.arange(len(sample)), np.diff(start))
    origin = -travelled[first]
    origin[sample.infinite] += np.minimum(phase, 0.0)
    travelled += origin[path]
    bounce = np.arange(len(points)) - first[path]
    arrival = travelled[start[1:] - 1]
    return Flight(points[vertex], points[vertex + 1], travelled[vertex], travelled[vertex + 1], path[vertex], vertex, bounce[vertex], arrival)


def bent(light: Flight, sample: PathSample, amount: float, points: int = 12) -> Flight:
    """The segments drawn into bundles by interaction and object (``viz.bundles``), as chains of ``points`` - 1 straight pieces.

    Light passes equal steps of a curve's parameter in equal times, so that it is at both ends when it is there on the straight way.
    """
    from viz.bundles import axes_of, curves_of, segments_of, targets, vertex_codes

    segments = segments_of(sample.start, vertex_codes(sample, ("event", "object"), np.empty(0, np.int64)))
    ends = light.begin.astype(np.float32), light.end.astype(np.float32)
    begin, end, kind = targets(segments, *ends, axes_of(*ends, segments.bundle, segments.bundles))
    curves = curves_of(ends, (begin, end), kind, amount, points).astype(np.float64)
    time = np.linspace(0, 1, points)
    at = (1 - time) * light.leaves[:, None] + time * light.arrives[:, None]
    path, vertex, bounce = (np.repeat(rows, points - 1) for rows in (light.path, light.vertex, light.bounce))
    first, last = curves[:, :-1].reshape(-1, 3), curves[:, 1:].reshape(-1, 3)
    return Flight(first, last, at[:, :-1].reshape(-1), at[:, 1:].reshape(-1), path, vertex, bounce, light.arrival)
