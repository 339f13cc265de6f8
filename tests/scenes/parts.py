"""What the test scenes are put together from: dictionaries as ``mi.load_dict`` and ``load_scene`` take them."""

from typing import Any

Dict = dict[str, Any]
Triple = tuple[float, float, float]


def rgb(r: float, g: float, b: float) -> Dict:
    return {"type": "rgb", "value": [r, g, b]}


def scale(*factors: float) -> Dict:
    return {"scale": list(factors) if len(factors) == 3 else [factors[0]] * 3}


def move(x: float, y: float, z: float) -> Dict:
    return {"translate": [x, y, z]}


def turn(axis: str, angle: float) -> Dict:
    return {"rotate": {"axis": [float(axis == name) for name in "xyz"], "angle": angle}}


def camera(origin: Triple, target: Triple, width: int = 32, height: int = 32, type: str = "perspective", **properties: Any) -> Dict:
    """A sensor with a box filter."""
    up = [0.0, 1.0, 0.0] if origin[0] != target[0] or origin[2] != target[2] else [0.0, 0.0, 1.0]
    return {
        "type": type,
        "fov": 40.0,
        "to_world": [{"lookat": {"origin": list(origin), "target": list(target), "up": up}}],
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
        "sampler": {"type": "independent"},
        **properties,
    }


def diffuse(r: float, g: float, b: float) -> Dict:
    return {"type": "diffuse", "reflectance": rgb(r, g, b)}


def two_sided(*bsdfs: Dict) -> Dict:
    return {"type": "twosided", **{f"side{i}": bsdf for i, bsdf in enumerate(bsdfs)}}


def area(r: float, g: float, b: float) -> Dict:
    return {"type": "area", "radiance": rgb(r, g, b)}


def shape(type: str, *to_world: Dict, bsdf: Dict | None = None, emitter: Dict | None = None, **properties: Any) -> Dict:
    """A shape; ``to_world`` lists operations, the first applied first."""
    made = {"type": type, **properties}
    if to_world:
        made["to_world"] = list(to_world)
    if bsdf is not None:
        made["bsdf"] = bsdf
    if emitter is not None:
        made["emitter"] = emitter
    return made


def floor(bsdf: Dict, size: float = 4.0, y: float = 0.0) -> Dict:
    """A square that faces up."""
    return shape("rectangle", scale(size), turn("x", -90), move(0, y, 0), bsdf=bsdf)


def lamp(r: float, g: float, b: float, size: float = 0.5, y: float = 2.0) -> Dict:
    """A square light that faces down."""
    return shape("rectangle", scale(size), turn("x", 90), move(0, y, 0), emitter=area(r, g, b))


def box(size: float = 1.0, red: Dict | None = None, green: Dict | None = None, white: Dict | None = None) -> Dict:
    """Five walls of a cube that is open to +z, from (-size, 0, -size) to (size, 2 size, size); left red, right green."""
    white = white or diffuse(0.7, 0.7, 0.7)
    return {
        "floor": shape("rectangle", scale(size), turn("x", -90), bsdf=white),
        "ceiling": shape("rectangle", scale(size), turn("x", 90), move(0, 2 * size, 0), bsdf=white),
        "back": shape("rectangle", scale(size), move(0, size, -size), bsdf=white),
        "left": shape("rectangle", scale(size), turn("y", 90), move(-size, size, 0), bsdf=red or diffuse(0.6, 0.1, 0.1)),
        "right": shape("rectangle", scale(size), turn("y", -90), move(size, size, 0), bsdf=green or diffuse(0.1, 0.5, 0.1)),
    }


def scene(sensor: Dict, max_depth: int = 8, **shapes: Dict) -> Dict:
    """A whole scene for the path tracer."""
    return {"type": "scene", "integrator": {"type": "path", "max_depth": max_depth}, "sensor": sensor, **shapes}
