"""The wavefront's working state: structures of arrays, pooled by each thread and reused by every tile.

Fresh arrays for each bounce cost more in page faults than the arithmetic on them, so nothing here is freed between
tiles; row buffers double when a scene outgrows them. These arrays *are* what gets recorded (DESIGN §3).
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]
U64 = npt.NDArray[np.uint64]


class Rays(NamedTuple):
    """One row for each walk that still goes on; rows keep the order of lanes."""

    lane: I32  # which walk of the tile
    o: F32  # (n, 3) origin
    d: F32  # (n, 3) unit direction
    beta: F32  # (n, 3) throughput on arrival
    pdf: F32  # p_l * pdf_l of the last scattering, per steradian; 0 after a delta lobe or the sensor
    eta: F32  # product of relative indices of refraction, for Russian roulette
    word: U64  # rolling hash of the events so far


class Lanes(NamedTuple):
    """One row for each walk of the tile."""

    walk: U64
    radiance: F32  # (n, 3) the sum of the walk's contributions, for the film
    raster: F32  # (n, 2) where on the film
    source: I32  # light walks: the emitter that they left
    recorded: U8  # 1: the walk's rows are kept


class ShadowRays(NamedTuple):
    """Connections to test; a direction is not unit: 1 is the other end."""

    o: F32
    d: F32
    far: F32


class VertexRows(NamedTuple):
    """Vertices in the order in which they were met."""

    lane: I32
    depth: U8
    event: U8
    object: U16
    position: F32
    beta: F32
    primitive: I32
    uv: F32


class PathRows(NamedTuple):
    """Full paths, in the order in which they were evaluated. ``ray`` is the connection to test, -1: none.

    A row whose connection is blocked belongs to no walk: its ``lane`` is NO_LANE.
    """

    lane: I32
    ray: I32
    technique: U8
    depth: U8
    event: U8
    word: U64
    emitter: U16
    endpoint: F32
    raster: F32
    contribution: F32
    weight: F32
    blocker: I32


class WordRows(NamedTuple):
    """Words as they turn up, with repeats; ``seen`` is a direct-mapped cache that drops most of these."""

    word: U64
    parent: U64
    event: U8
    object: U16
    seen: U64


class Counters(NamedTuple):
    """How many rows of each buffer are in use, as kernels hand them on."""

    rays: Any
    shadow: Any
    vertices: Any
    paths: Any
    words: Any


_COLUMNS: dict[str, tuple[type, int]] = {
    "lane": (np.int32, 1), "o": (np.float32, 3), "d": (np.float32, 3), "beta": (np.float32, 3), "pdf": (np.float32, 1),
    "eta": (np.float32, 1), "word": (np.uint64, 1), "walk": (np.uint64, 1), "radiance": (np.float32, 3), "raster": (np.float32, 2),
    "recorded": (np.uint8, 1), "far": (np.float32, 1), "depth": (np.uint8, 1), "event": (np.uint8, 1), "object": (np.uint16, 1),
    "position": (np.float32, 3), "primitive": (np.int32, 1), "uv": (np.float32, 2), "ray": (np.int32, 1), "technique": (np.uint8, 1),
    "endpoint": (np.float32, 3), "contribution": (np.float32, 3), "weight": (np.float32, 1), "blocker": (np.int32, 1),
    "emitter": (np.uint16, 1), "source": (np.int32, 1), "parent": (np.uint64, 1), "seen": (np.uint64, 1),
}  # fmt: skip
NO_LANE = -1
SEEN = 1 << 13  # slots of the word cache: 64 KiB, so that it stays near the core


def allocate(kind: type[NamedTuple], rows: int) -> Any:
    """A structure of ``rows`` rows of the named tuple ``kind``."""
    columns: dict[str, npt.NDArray[Any]] = {}
    for name in kind._fields:
        dtype, width = _COLUMNS[name]
        length = SEEN if name == "seen" else max(rows, 1)
        columns[name] = np.zeros(length if width == 1 else (length, width), dtype)
    return kind(**columns)  # type: ignore[call-overload]


def grow(rows: Any, used: int, needed: int) -> Any:
    """The same rows in buffers of at least ``needed`` rows: doubled where they are too short."""
    if needed <= len(rows[0]):
        return rows
    larger = allocate(type(rows), max(needed, 2 * len(rows[0])))
    for name in rows._fields:
        old, new = getattr(rows, name), getattr(larger, name)
        new[: used if name != "seen" else SEEN] = old[: used if name != "seen" else SEEN]
    return larger


class TileBuffers:
    """All buffers of one thread, for tiles of up to ``lanes`` walks."""

    def __init__(self, lanes: int) -> None:
        self.lanes: Lanes = allocate(Lanes, lanes)
        self.rays: Rays = allocate(Rays, lanes)
        self.next_rays: Rays = allocate(Rays, lanes)
        self.shadow: ShadowRays = allocate(ShadowRays, lanes)
        self.vertices: VertexRows = allocate(VertexRows, 4 * lanes)
        self.paths: PathRows = allocate(PathRows, 4 * lanes)
        self.occluded: PathRows = allocate(PathRows, 1)
        self.words: WordRows = allocate(WordRows, lanes)
        self.t: F32 = np.empty(lanes, np.float32)

    def reserve(self, counters: Counters, active: int) -> None:
        """Make room for one bounce of ``active`` walks: one vertex each, three paths (hit, two lobes), three words."""
        self.vertices = grow(self.vertices, counters.vertices, counters.vertices + active)
        self.paths = grow(self.paths, counters.paths, counters.paths + 3 * active)
        self.words = grow(self.words, counters.words, counters.words + 3 * active)

    def swap_rays(self) -> None:
        """The rays that a bounce made become those that the next one follows."""
        self.rays, self.next_rays = self.next_rays, self.rays
