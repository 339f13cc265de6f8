"""From a description's tree to a compiled scene: each kind's part is read by the file of that name, and put together here."""

from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene.arrays import ObjectInfo, Objects, RenderDefaults, Scene, SceneArrays
from renderer.scene.bsdfs import BSDFS, MaterialTable, Sides
from renderer.scene.checks import sound_surface, warn_of_inside
from renderer.scene.context import Context
from renderer.scene.description import Node, listing, nearest, plain, resolve
from renderer.scene.emitters import EMITTERS, Light, area_light, free_light, pack_emitters
from renderer.scene.geometry import Mesh, Surface, assemble
from renderer.scene.paths import Paths
from renderer.scene.reader import Reader
from renderer.scene.sensors import FILMS, SAMPLERS, SENSORS, read_sensor
from renderer.scene.shapes import SHAPES
from renderer.scene.spectra import COLORS
from renderer.scene.textures import TEXTURES
from renderer.tables import NO_OBJECT

MOST_SHAPES = NO_OBJECT  # object ids are uint16 in the tables, of which the last one means none
MOST_EMITTERS = 1 << 16  # emitter ids are uint16 too
INTEGRATORS = {"path": "path", "ptracer": "light"}
KNOWN = (*SHAPES, *BSDFS, *TEXTURES, *COLORS, *EMITTERS, *SENSORS, *FILMS, *SAMPLERS, *INTEGRATORS)


def compile_scene(root: Node, paths: Paths) -> Scene:
    """Compile a description's tree; references are resolved in place."""
    if root.plugin != "scene":
        raise SceneError(f"expected a scene ('type: scene'), found {root.plugin!r}", root.place)
    shared = resolve(root)
    context = Context(paths)
    parts = sort_parts(root)

    # Surfaces and what they are made of
    materials = MaterialTable(context)
    surfaces: list[Surface] = []
    sides: list[Sides] = []
    area_nodes: list[Node | None] = []
    for node in parts["shapes"]:
        reader = Reader(node)
        surfaces.append(SHAPES[node.plugin](reader, paths))
        bsdf, light = reader.children(BSDFS, "BSDFs"), reader.children(("area",), "emitters")
        reader.ignore("silhouette_sampling_weight")
        reader.finish((*BSDFS, "area"))
        surfaces[-1] = sound_surface(surfaces[-1], node, context)
        area_nodes.append(light[0] if light else None)
        sides.append(Sides(-1, -1, False, "none") if light and not bsdf else materials.sides(bsdf[0] if bsdf else None))
    if len(surfaces) > MOST_SHAPES:
        raise SceneError(f"the scene has {len(surfaces)} shapes; at most {MOST_SHAPES} can be told apart: merge some into one mesh", root.place)
    if not surfaces:
        raise SceneError(f"the scene has no shape; supported: {listing(SHAPES)}", root.place)

    # Textures decide what geometry must keep; emitters on surfaces need the primitives' numbers
    textured = bool(context.textures.rows) or any(m.anisotropic for m in materials.rows)
    textured = textured or any(node is not None and has_texture(node) for node in area_nodes)
    assembly = assemble(surfaces, textured)
    lights: list[Light] = []
    emitter_of = np.full(len(surfaces), -1, np.int32)
    for i, (shape, area) in enumerate(zip(parts["shapes"], area_nodes, strict=True)):
        if area is not None:
            emitter_of[i] = len(lights)
            lights.append(area_light(area, i, area.name if area.named else shape.name, surfaces[i], assembly, context))
    lights += [free_light(node, context) for node in parts["emitters"]]
    if len(lights) > MOST_EMITTERS:
        raise SceneError(f"the scene has {len(lights)} emitters; at most {MOST_EMITTERS} can be told apart", root.place)
    check_lights(lights, root, parts, context)

    sensor, film, sampling = read_sensor(one_sensor(parts["sensors"], root), context)
    warn_of_inside(sensor, parts["shapes"], surfaces, sides, materials, context)
    method, max_depth, rr_depth = read_integrator(parts["integrators"])
    infos = object_infos(parts["shapes"], surfaces, sides)
    objects = Objects(
        np.array([s.front for s in sides], np.int32),
        np.array([s.back for s in sides], np.int32),
        np.array([s.two_sided for s in sides], np.uint8),
        emitter_of,
    )
    low, high = np.min([info.bounds[0] for info in infos], axis=0), np.max([info.bounds[1] for info in infos], axis=0)
    emitters = pack_emitters(lights, (low, high))
    arrays = SceneArrays(assembly.geometry, objects, materials.pack(), materials.families(), context.textures.pack(), emitters, sensor)
    return Scene(
        arrays=arrays,
        objects=infos,
        emitters=tuple(light.info for light in lights),
        defaults=RenderDefaults(film.width, film.height, film.filter, sampling.samples, method, max_depth, rr_depth, sampling.sampler, sampling.seed),
        vertices=assembly.vertices,
        triangles=assembly.triangles,
        description=plain(root, shared),
        warnings=tuple(context.warnings),
    )


def sort_parts(root: Node) -> dict[str, list[Node]]:
    """The scene's children by kind; unknown ones are an error. Textures and BSDFs stand there to be referenced."""
    kinds: dict[str, Any] = {"shapes": SHAPES, "emitters": EMITTERS, "sensors": SENSORS, "integrators": INTEGRATORS}
    parts: dict[str, list[Node]] = {kind: [] for kind in kinds}
    seen: set[int] = set()
    for key, value in root.properties.items():
        node = value.data
        if not isinstance(node, Node):
            raise SceneError(f"scene: unknown property {key!r}; a scene holds objects only", value.place)
        if id(node) in seen:  # an alias
            continue
        seen.add(id(node))
        kind = next((kind for kind, plugins in kinds.items() if node.plugin in plugins), None)
        if kind is not None:
            parts[kind].append(node)
        elif node.plugin not in (*BSDFS, *TEXTURES, *COLORS):
            hint = nearest(node.plugin, KNOWN)
            supported = f"supported in a scene: {listing((*SHAPES, *EMITTERS, *BSDFS, *SENSORS, *INTEGRATORS))}"
            raise SceneError(f"{node.plugin!r} is not supported{hint}; {supported}", node.place)
    name_apart(parts["shapes"])
    return parts


def name_apart(nodes: list[Node]) -> None:
    """Give shapes that nobody named, and whose made-up names are taken, names of their own."""
    taken = {node.name for node in nodes if node.named}
    for node in nodes:
        if not node.named:
            name, n = node.name, 1
            while node.name in taken:
                n += 1
                node.name = f"{name}_{n}"
            taken.add(node.name)


def has_texture(node: Node) -> bool:
    """Whether a node's property is an image or a pattern."""
    return any(child.plugin in TEXTURES for _, child in node.children())


def one_sensor(sensors: list[Node], root: Node) -> Node:
    """The scene's camera."""
    if len(sensors) != 1:
        found = f"{len(sensors)} sensors ({listing(s.name for s in sensors)})" if sensors else "no sensor"
        raise SceneError(f"the scene has {found}; expected exactly one of {listing(SENSORS)}", sensors[1].place if sensors else root.place)
    return sensors[0]


def read_integrator(nodes: list[Node]) -> tuple[str, int, int]:
    """Method, maximum depth and depth of Russian roulette, as the job's defaults."""
    if len(nodes) > 1:
        raise SceneError("the scene has more than one integrator", nodes[1].place)
    reader = Reader(nodes[0] if nodes else Node("path", "integrator", ""))
    max_depth, rr_depth = reader.integer("max_depth", -1, -1), reader.integer("rr_depth", 5, 1)
    if max_depth == 0:
        raise reader.error("'max_depth' must be 1 or more, or -1 for no bound: no path has 0 segments", "max_depth")
    if reader.flag("hide_emitters", False):
        raise reader.error("'hide_emitters' is not supported; leave it out", "hide_emitters")
    reader.ignore("samples_per_pass", "block_size", "timeout")
    reader.finish()
    return INTEGRATORS[reader.node.plugin], max_depth, rr_depth


def object_infos(nodes: list[Node], surfaces: list[Surface], sides: list[Sides]) -> tuple[ObjectInfo, ...]:
    """The catalogue of objects."""
    infos = []
    for node, surface, side in zip(nodes, surfaces, sides, strict=True):
        area = float(surface.areas().sum()) if isinstance(surface, Mesh) else surface.area()
        infos.append(ObjectInfo(node.name, node.plugin, side.name, surface.bounds(), area))
    return tuple(infos)


def check_lights(lights: list[Light], root: Node, parts: dict[str, list[Node]], context: Context) -> None:
    """A scene needs an emitter, has at most one around it, and is warned of black ones."""
    if not lights:
        raise SceneError(f"the scene has no emitter, so every picture of it is black; supported: {listing(EMITTERS)}", root.place)
    around = [node for node in parts["emitters"] if node.plugin in ("constant", "envmap")]
    if len(around) > 1:
        raise SceneError("the scene has more than one environment; expected at most one 'constant' or 'envmap'", around[1].place)
    for light in lights:
        if light.texture < 0 and not any(light.rgb):
            context.warn(f"the emitter {light.info.name!r} gives no light: it is black", root.place)
