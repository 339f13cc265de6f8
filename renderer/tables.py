"""The tables of a run, declared once: kernels fill these columns, files hold them, SQL reads them (DESIGN §4).

``VERTEX`` rows are the vertices of walks, key (walk, depth). ``PATH`` rows are the full paths, or lobes' shares of
one, that an estimator evaluated, key (owning walk, path). ``OCCLUDED`` rows are connections that were blocked. ``UNLIT``
rows are the camera walks that made no path: with the walks of ``PATHS`` they are all that were recorded. A column that a
run cannot fill is not stored; the views of ``queries`` supply NULL for it.
"""

from dataclasses import dataclass, field

import pyarrow as pa

# --- events: what happens to light at a vertex. Keys are the same in every run. -----------------------------------


@dataclass(frozen=True)
class Event:
    """One row of the ``events`` catalogue.

    ``type``: R reflect, T transmit, or how a walk begins or ends. ``scattering``: D diffuse, G glossy, S singular,
    s straight, None where light does not scatter. ``lobe``: the lobe's name, a label of light path expressions.
    """

    key: int
    type: str
    scattering: str | None
    lobe: str


ABSORBED, ESCAPED, ROULETTE, DEPTH_LIMIT, LENS, EMITTER = 0, 1, 2, 3, 4, 5
DIFFUSE_REFLECTION, GLOSSY_REFLECTION, SPECULAR_REFLECTION = 8, 9, 10
GLOSSY_TRANSMISSION, SPECULAR_TRANSMISSION, STRAIGHT_TRANSMISSION = 12, 13, 14
FIRST_SCATTERING = 8

EVENTS = (
    Event(ABSORBED, "absorbed", None, ""),
    Event(ESCAPED, "escaped", None, ""),
    Event(ROULETTE, "roulette", None, ""),
    Event(DEPTH_LIMIT, "depth limit", None, ""),
    Event(LENS, "lens", None, ""),
    Event(EMITTER, "emitter", None, ""),
    Event(DIFFUSE_REFLECTION, "R", "D", "diffuse"),
    Event(GLOSSY_REFLECTION, "R", "G", "glossy"),
    Event(SPECULAR_REFLECTION, "R", "S", "specular"),
    Event(GLOSSY_TRANSMISSION, "T", "G", "glossy_transmission"),
    Event(SPECULAR_TRANSMISSION, "T", "S", "specular_transmission"),
    Event(STRAIGHT_TRANSMISSION, "T", "s", "straight_transmission"),
)

# --- techniques: how a path's two ends were joined ----------------------------------------------------------------

EMITTER_HIT, EMITTER_SAMPLE, LENS_SAMPLE, CONNECTION, MERGE = 0, 1, 2, 3, 4
TECHNIQUES = ("emitter hit", "emitter sample", "lens sample", "connection", "merge")

# --- walk prefixes as words ---------------------------------------------------------------------------------------

CAMERA_ROOT = 0x9AE16A3B2F90404F  # the word of a camera walk that has met nothing yet
LIGHT_ROOT = 0xC3A5C85C97CB3127  # the word of a light walk that has just left its emitter
NO_OBJECT = 0xFFFF  # the object of an escaped walk


# --- columns ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Column:
    """One column: Arrow type name, meaning, and whether a job must ask for it (``record.columns``)."""

    name: str
    type: str
    meaning: str
    optional: bool = False


@dataclass(frozen=True)
class Table:
    """One recorded table: its columns in stored order."""

    name: str
    columns: tuple[Column, ...]
    by_name: dict[str, Column] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Index the columns by name."""
        object.__setattr__(self, "by_name", {c.name: c for c in self.columns})

    def schema(self, names: tuple[str, ...]) -> pa.Schema:
        """The Arrow schema of the named columns, in stored order."""
        return pa.schema([pa.field(c.name, ARROW_TYPES[c.type], nullable=False) for c in self.columns if c.name in names])


ARROW_TYPES = {
    "walk": pa.uint32(),
    "uint8": pa.uint8(),
    "uint16": pa.uint16(),
    "uint32": pa.uint32(),
    "uint64": pa.uint64(),
    "float32": pa.float32(),
}
"""Arrow types by the names that ``Column.type`` uses; ``walk`` is widened to uint64 where a job has 2^32 walks or more."""

_VERTEX_COLUMNS = (
    Column("walk", "walk", "the walk's id"),
    Column("depth", "uint8", "1, 2, … along the walk; 0 where the endpoint itself was sampled (a lens, an emitter)"),
    Column("event", "uint8", "key into events: the lobe sampled to go on, or how the walk ended"),
    Column("object", "uint16", "key into objects; 65535 where the walk escaped"),
    Column("x", "float32", "world position, scene units (a unit direction where the walk escaped)"),
    Column("y", "float32", "see x"),
    Column("z", "float32", "see x"),
    Column("throughput_r", "float32", "We or Le over its density times f cos / pdf of each bounce, on arrival here"),
    Column("throughput_g", "float32", "see throughput_r"),
    Column("throughput_b", "float32", "see throughput_r"),
    Column("primitive", "uint32", "row of triangles (quadrics follow the triangles); 4294967295 where there is no surface", optional=True),
    Column("u", "float32", "weight of the triangle's second corner, or a quadric's first parameter", optional=True),
    Column("v", "float32", "weight of the triangle's third corner, or a quadric's second parameter", optional=True),
)

CAMERA_VERTICES = Table("camera_vertices", _VERTEX_COLUMNS)
LIGHT_VERTICES = Table("light_vertices", _VERTEX_COLUMNS)

_PATH_COLUMNS = (
    Column("camera_walk", "walk", "the camera walk that the path is made of"),
    Column("light_walk", "walk", "the light walk that the path is made of"),
    Column("path", "uint16", "ordinal within the owning walk"),
    Column("technique", "uint8", "how the two ends were joined: key into techniques"),
    Column("camera_depth", "uint8", "how many vertices of the camera walk the path uses"),
    Column("light_depth", "uint8", "how many vertices of the light walk the path uses"),
    Column("camera_event", "uint8", "the lobe evaluated at the camera walk's end of the connection"),
    Column("light_event", "uint8", "the lobe evaluated at the light walk's end of the connection"),
    Column("camera_word", "uint64", "key into words: events and objects from the camera up to the connection"),
    Column("light_word", "uint64", "key into words: events and objects from the light up to the connection"),
    Column("emitter", "uint16", "key into emitters"),
    Column("endpoint_x", "float32", "the vertex that belongs to no walk: light or lens point (a direction for infinite emitters)"),
    Column("endpoint_y", "float32", "see endpoint_x"),
    Column("endpoint_z", "float32", "see endpoint_x"),
    Column("raster_x", "float32", "where on the film, in pixels; strictly inside the film"),
    Column("raster_y", "float32", "see raster_x"),
    Column("contribution_r", "float32", "such that image = sum / passes"),
    Column("contribution_g", "float32", "see contribution_r"),
    Column("contribution_b", "float32", "see contribution_r"),
    Column("mis_weight", "float32", "the weight already inside the contribution"),
)

PATHS = Table("paths", _PATH_COLUMNS)
_BLOCKER = Column("blocker", "uint16", "the first object that blocked the connection; 65535 where a grazing ray met none the second time")
OCCLUDED = Table("occluded", (*_PATH_COLUMNS, _BLOCKER))
UNLIT = Table(
    "unlit",
    (
        Column("camera_walk", "walk", "the camera walk that carried nothing"),
        Column("raster_x", "float32", "where on the film, in pixels; strictly inside the film"),
        Column("raster_y", "float32", "see raster_x"),
    ),
)
WORDS = Table(
    "words",
    (
        Column("word", "uint64", "rolling hash of the prefix"),
        Column("parent", "uint64", "the prefix without its last event"),
        Column("event", "uint8", "key into events: the last event"),
        Column("object", "uint16", "key into objects: where it happened"),
    ),
)
RECORDED_TABLES = (CAMERA_VERTICES, LIGHT_VERTICES, PATHS, OCCLUDED, UNLIT, WORDS)
