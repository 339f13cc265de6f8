"""A scene with many kinds of light paths, each of which both tracers can find often enough to compare."""

from scenes.parts import Dict, area, box, camera, diffuse, lamp, move, rgb, scale, scene, shape, turn


def light_paths(width: int = 16, height: int = 16) -> Dict:
    """A diffuse box with balls of glass, metal and plastic under a wide lamp and a bulb: caustics, glossy and mixed paths."""
    return scene(
        camera((0, 1, 3.6), (0, 1, 0), width, height),
        5,
        **box(white=diffuse(0.7, 0.6, 0.5)),
        lamp=lamp(4, 4, 4, 0.8, 1.98),
        bulb={"type": "point", "position": [0.2, 1.2, 0.9], "intensity": rgb(0.4, 0.5, 0.6)},
        glass=shape("sphere", scale(0.35), move(-0.5, 0.4, 0.4), bsdf={"type": "dielectric"}),
        frosted=shape("sphere", scale(0.25), move(0.0, 0.3, 0.6), bsdf={"type": "roughdielectric", "alpha": 0.35, "distribution": "ggx"}),
        coated=shape("sphere", scale(0.3), move(0.5, 0.32, 0.3), bsdf={"type": "plastic", "diffuse_reflectance": rgb(0.5, 0.3, 0.2)}),
        satin=shape("cube", scale(0.25), turn("y", 30), move(-0.3, 0.9, -0.5), bsdf={"type": "roughplastic", "alpha": 0.3}),
        metal=shape("cylinder", p0=[0.6, 0, -0.6], p1=[0.6, 1.2, -0.6], radius=0.2, bsdf={"type": "roughconductor", "alpha": 0.3}),
        pane=shape("rectangle", scale(0.3), turn("y", 20), move(0.4, 1.3, 0.4), bsdf={"type": "thindielectric"}),
    )


def coated_scene(type: str, **colors: float) -> Dict:
    """Everything is of one coated material, lit by a lamp and a bulb."""
    bsdf = {"type": type, "int_ior": 1.9, "diffuse_reflectance": 0.6, "specular_reflectance": 0.9, **colors}
    if type == "roughplastic":
        bsdf["alpha"] = 0.3
    parts = box(white=bsdf, red=bsdf, green=bsdf)
    ball = shape("sphere", scale(0.4), move(0.2, 0.45, 0.2), bsdf=bsdf)
    bulb = {"type": "point", "position": [-0.4, 1.1, 0.8], "intensity": rgb(0.6, 0.5, 0.4)}
    light = shape("rectangle", scale(0.7), turn("x", 90), move(0, 1.97, 0), emitter=area(3, 4, 5), bsdf=diffuse(0, 0, 0))
    return scene(camera((0, 1, 3.6), (0, 1, 0), 16, 16), 4, **parts, ball=ball, bulb=bulb, light=light)
