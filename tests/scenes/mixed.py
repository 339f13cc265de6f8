"""A scene in which everything happens: all events, all kinds of rows, escapes, shadows, several kinds of lights."""

from scenes.parts import Dict, area, camera, diffuse, floor, move, rgb, scale, scene, shape, turn, two_sided


def mixed(width: int = 16, height: int = 16, max_depth: int = 7) -> Dict:
    """Glass, metal and coated balls on a checkerboard under a square, a ball, a bulb and a dim sky."""
    checker = {"type": "checkerboard", "to_uv": [scale(8, 8, 1)], "color0": rgb(0.7, 0.6, 0.5), "color1": rgb(0.2, 0.2, 0.3)}
    return scene(
        camera((0, 1.3, 3.6), (0, 0.5, 0), width, height),
        max_depth,
        ground=floor({"type": "diffuse", "reflectance": checker}, 3),
        glass=shape("sphere", scale(0.4), move(-0.9, 0.45, 0.3), bsdf={"type": "dielectric"}),
        frosted=shape("sphere", scale(0.35), move(0.0, 0.4, 0.7), bsdf={"type": "roughdielectric", "alpha": 0.3}),
        metal=shape("cube", scale(0.3), turn("y", 25), move(0.8, 0.31, -0.2), bsdf={"type": "roughconductor", "alpha": 0.25, "distribution": "ggx"}),
        coated=shape("sphere", scale(0.3), move(0.9, 0.3, 0.8), bsdf={"type": "plastic", "diffuse_reflectance": rgb(0.6, 0.3, 0.2)}),
        satin=shape("cylinder", p0=[-0.2, 0, -0.8], p1=[-0.2, 0.9, -0.8], radius=0.3, bsdf=two_sided({"type": "roughplastic", "alpha": 0.2})),
        pane=shape("disk", scale(0.3), turn("y", 30), move(0.4, 1.1, 0.9), bsdf={"type": "thindielectric"}),
        lamp=shape("rectangle", scale(0.6), turn("x", 90), move(0, 2.4, 0), emitter=area(6, 6, 5), bsdf=diffuse(0.4, 0.4, 0.4)),
        ball=shape("sphere", scale(0.15), move(-1.3, 1.5, -0.4), emitter=area(6, 3, 2)),
        bulb={"type": "point", "position": [1.6, 1.8, 1.2], "intensity": rgb(1, 1, 2)},
        sky={"type": "constant", "radiance": rgb(0.1, 0.12, 0.2)},
    )
