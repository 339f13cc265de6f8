"""The scenes that are rendered by Mitsuba too. Between them they use every supported plugin; their variance is finite and small.

Each function takes a folder for its meshes and images and returns a scene; its name is the test's name.
"""

import pathlib
from collections.abc import Callable

from scenes.files import gradient_png, sky_exr, write_mesh, write_obj, write_ply
from scenes.parts import Dict, area, box, camera, diffuse, floor, lamp, move, rgb, scale, scene, shape, turn, two_sided

Folder = pathlib.Path


def diffuse_box(folder: Folder) -> Dict:
    """Rectangles, cubes, a shared two-sided material; unbounded depth and Russian roulette."""
    blocks = {
        "tall": shape("cube", scale(0.3, 0.6, 0.3), turn("y", 18), move(-0.35, 0.6, -0.3), bsdf={"type": "ref", "id": "gray"}),
        "short": shape("cube", scale(0.3), turn("y", -20), move(0.35, 0.3, 0.3), bsdf={"type": "ref", "id": "gray"}),
    }
    gray = two_sided(diffuse(0.7, 0.65, 0.6))
    return scene(camera((0, 1, 3.6), (0, 1, 0)), -1, gray=gray, **box(), **blocks, lamp=lamp(12, 10, 7, 0.3, 1.98))


def glass_and_mirror(folder: Folder) -> Dict:
    """Smooth specular lobes: dielectric sphere, thin pane, a metal by name and one by its constants, under a wide light."""
    return scene(
        camera((0, 1, 3.6), (0, 1, 0)),
        9,
        **box(),
        lamp=lamp(3, 2.8, 2.5, 0.9, 1.98),
        glass=shape("sphere", center=[-0.4, 0.45, 0.2], radius=0.4, bsdf={"type": "dielectric", "int_ior": "bk7", "ext_ior": "air"}),
        gold=shape("sphere", scale(0.35), move(0.5, 0.36, -0.3), bsdf={"type": "conductor", "material": "Au"}),
        metal=shape(
            "sphere",
            scale(0.2),
            move(0.45, 0.21, 0.55),
            bsdf=two_sided({"type": "conductor", "eta": rgb(0.2, 0.9, 1.1), "k": rgb(3.9, 2.4, 2.2), "specular_reflectance": rgb(0.9, 0.8, 1.0)}),
        ),
        pane=shape("rectangle", scale(0.4), turn("y", 30), move(0.1, 1.3, 0.2), bsdf={"type": "thindielectric", "int_ior": 1.5}),
    )


def rough_metals(folder: Folder) -> Dict:
    """Rough conductors of both distributions, isotropic and not, under a sphere, a disk and a square of different size."""
    tiles = {
        f"tile{i}": shape("rectangle", scale(0.45, 0.9, 1), turn("x", -70), move(-1.5 + i, 0.1, 0), bsdf=bsdf)
        for i, bsdf in enumerate(
            (
                {"type": "roughconductor", "material": "Cu", "alpha": 0.12, "distribution": "ggx"},
                {"type": "roughconductor", "material": "Al", "alpha": 0.3, "distribution": "beckmann"},
                {"type": "roughconductor", "alpha_u": 0.4, "alpha_v": 0.08, "distribution": "ggx", "specular_reflectance": rgb(0.8, 0.7, 0.6)},
                {"type": "roughconductor", "alpha_u": 0.1, "alpha_v": 0.35, "distribution": "beckmann", "eta": rgb(1.5, 1, 0.6), "k": rgb(3, 2, 4)},
            )
        )
    }
    return scene(
        camera((0, 2.2, 4), (0, 0.3, 0), fov=45.0),
        6,
        **tiles,
        ground=floor(diffuse(0.4, 0.4, 0.5), y=-0.9),
        ball=shape("sphere", scale(0.25), move(-1.2, 1.6, -1.5), emitter=area(9, 5, 3)),
        disk=shape("disk", scale(0.4), turn("y", 20), move(0.2, 1.4, -1.8), emitter=area(3, 8, 3)),
        square=shape("rectangle", scale(0.7), turn("x", 60), move(1.3, 2.2, -1.2), emitter=area(2, 3, 6)),
    )


def rough_glass(folder: Folder) -> Dict:
    """Rough dielectrics of both distributions, tinted, entered and left, before a bright sky and a checkerboard."""
    checker = {"type": "checkerboard", "color0": rgb(0.1, 0.2, 0.5), "color1": rgb(0.8, 0.7, 0.3), "to_uv": [scale(6, 6, 1)]}
    return scene(
        camera((0, 1.2, 3.5), (0, 0.6, 0)),
        10,
        ground=floor({"type": "diffuse", "reflectance": checker}),
        sky={"type": "constant", "radiance": rgb(0.6, 0.7, 0.9)},
        ball=shape("sphere", scale(0.5), move(-0.6, 0.6, 0), bsdf={"type": "roughdielectric", "alpha": 0.25, "distribution": "ggx", "int_ior": 1.5}),
        block=shape(
            "cube",
            scale(0.4),
            turn("y", 25),
            move(0.6, 0.5, 0),
            bsdf={
                "type": "roughdielectric",
                "alpha": 0.4,
                "distribution": "beckmann",
                "int_ior": "water",
                "ext_ior": 1.0,
                "specular_transmittance": rgb(0.9, 0.95, 0.8),
                "specular_reflectance": rgb(0.8, 0.9, 1.0),
            },
        ),
    )


def plastics(folder: Folder) -> Dict:
    """Plastics, smooth and rough, nonlinear and textured, under a square light."""
    checker = {"type": "checkerboard", "to_uv": [scale(3, 5, 1)], "color0": rgb(0.7, 0.2, 0.1), "color1": rgb(0.2, 0.3, 0.7)}
    bsdfs = (
        {"type": "plastic", "diffuse_reflectance": rgb(0.6, 0.2, 0.1), "int_ior": 1.6},
        {"type": "plastic", "diffuse_reflectance": checker, "nonlinear": True},
        {"type": "roughplastic", "diffuse_reflectance": rgb(0.1, 0.4, 0.5), "alpha": 0.15, "distribution": "ggx"},
        {"type": "roughplastic", "diffuse_reflectance": checker, "alpha": 0.3, "distribution": "beckmann", "nonlinear": True},
        {"type": "roughplastic", "diffuse_reflectance": 0.7, "specular_reflectance": 0.4, "alpha": 0.08, "int_ior": "diamond"},
    )
    balls = {f"ball{i}": shape("sphere", scale(0.36), move(-1.5 + 0.75 * i, 0.37, 0.4 * (i % 2)), bsdf=bsdf) for i, bsdf in enumerate(bsdfs)}
    return scene(camera((0, 1.6, 4), (0, 0.4, 0), fov=48.0), 6, ground=floor(diffuse(0.5, 0.5, 0.5)), lamp=lamp(6, 6, 5, 0.9, 2.4), **balls)


def two_different_sides(folder: Folder) -> Dict:
    """Two-sided surfaces whose sides differ, seen from both; absorbing backs; flipped normals."""
    sides = two_sided(diffuse(0.7, 0.2, 0.2), {"type": "roughconductor", "alpha": 0.3, "distribution": "ggx"})
    coated = two_sided({"type": "plastic", "diffuse_reflectance": rgb(0.2, 0.6, 0.3)}, diffuse(0.2, 0.2, 0.7))
    return scene(
        camera((0.3, 1.4, 3.8), (0, 0.7, 0)),
        6,
        ground=floor(two_sided(diffuse(0.5, 0.5, 0.5))),
        lamp=shape("rectangle", scale(0.8), turn("x", 90), move(0, 2.5, 0.5), emitter=area(7, 7, 7), bsdf=diffuse(0.3, 0.3, 0.3)),
        sheet=shape("rectangle", scale(0.4), turn("y", 40), move(-0.9, 0.5, 0), bsdf=sides),
        turned=shape("rectangle", scale(0.4), turn("y", 220), move(0, 0.5, 0), bsdf=sides),
        flipped=shape("disk", scale(0.4), turn("y", -30), move(0.9, 0.5, 0), bsdf=coated, flip_normals=True),
        tube=shape("cylinder", scale(0.35), turn("x", -60), move(0.1, 0.9, 0.9), bsdf=coated, p0=[0, 0, -0.4], p1=[0, 0.2, 0.6], radius=0.6),
        black_back=shape("disk", scale(0.3), turn("y", 180), move(0.5, 1.4, -0.5), bsdf=diffuse(0.9, 0.9, 0.9)),
    )


def delta_lights(folder: Folder) -> Dict:
    """Point, spot and directional lights; the film's center is shifted."""
    return scene(
        camera((0, 1.8, 4), (0, 0.5, 0), principal_point_offset_x=0.06, principal_point_offset_y=-0.04),
        5,
        ground=floor(diffuse(0.5, 0.45, 0.4)),
        bulb={"type": "point", "position": [-1.0, 1.8, 1.0], "intensity": rgb(3, 2, 1)},
        sun={"type": "directional", "direction": [0.4, -1.0, -0.6], "irradiance": rgb(0.8, 0.9, 1.2)},
        beam={
            "type": "spot",
            "to_world": [{"lookat": {"origin": [1.5, 2.5, 1.0], "target": [0.4, 0, 0.2], "up": [0, 0, 1]}}],
            "intensity": rgb(8, 9, 10),
            "cutoff_angle": 24.0,
            "beam_width": 10.0,
        },
        ball=shape("sphere", scale(0.4), move(-0.8, 0.4, 0), bsdf=diffuse(0.7, 0.3, 0.3)),
        can=shape("cylinder", p0=[0.2, 0, -0.2], p1=[0.2, 0.9, -0.2], radius=0.3, bsdf=two_sided(diffuse(0.3, 0.7, 0.3))),
        lid=shape("disk", scale(0.35), turn("x", -70), move(0.9, 0.5, 0.5), bsdf=diffuse(0.3, 0.3, 0.7)),
        cube=shape("cube", scale(0.25), turn("y", 35), move(-0.2, 0.25, 0.9), bsdf=diffuse(0.6, 0.6, 0.2)),
    )


def environment_map(folder: Folder) -> Dict:
    """An importance-sampled image of the sky, turned and scaled, on a smooth OBJ mesh, plastic and metal."""
    return scene(
        camera((0, 1.2, 3.6), (0, 0.6, 0)),
        5,
        sky={"type": "envmap", "filename": sky_exr(folder), "scale": 0.7, "to_world": [turn("x", 12), turn("y", 100)]},
        ground=floor({"type": "roughplastic", "diffuse_reflectance": rgb(0.4, 0.4, 0.3), "alpha": 0.2}),
        mesh=shape("obj", scale(0.5), move(-0.6, 0.6, 0), filename=write_obj(folder), bsdf=diffuse(0.8, 0.6, 0.4)),
        ball=shape("sphere", scale(0.45), move(0.6, 0.5, 0), bsdf={"type": "roughconductor", "alpha": 0.2, "distribution": "ggx", "material": "Ag"}),
    )


def mesh_files(folder: Folder) -> Dict:
    """The four mesh formats, with smooth and flat normals, and a bitmap by texture coordinates."""
    image = {"type": "bitmap", "filename": gradient_png(folder), "filter_type": "bilinear", "to_uv": [scale(2, 2, 1)]}
    coated = {"type": "plastic", "diffuse_reflectance": image}
    return scene(
        camera((0, 1.4, 4.2), (0, 0.5, 0), fov=45.0),
        5,
        ground=floor(diffuse(0.4, 0.4, 0.4)),
        lamp=lamp(9, 9, 9, 1.0, 3.0),
        obj=shape("obj", scale(0.45), move(-1.2, 0.5, 0), filename=write_obj(folder), bsdf={"type": "diffuse", "reflectance": image}),
        flat=shape(
            "obj", scale(0.3), move(-0.6, 0.35, 1), filename=write_obj(folder, False, "flat.obj"), face_normals=True, bsdf=diffuse(0.7, 0.3, 0.5)
        ),
        ply=shape("ply", scale(0.45), turn("y", 60), move(-0.2, 0.5, 0), filename=write_ply(folder), bsdf=coated),
        stl=shape("mesh", scale(0.4), move(0.75, 0.5, 0), filename=write_mesh(folder, "stl"), bsdf=diffuse(0.3, 0.6, 0.5)),
        glb=shape("mesh", scale(0.4), move(0.5, 0.45, 1.1), filename=write_mesh(folder, "glb"), bsdf={"type": "diffuse", "reflectance": image}),
    )


def thin_lens(folder: Folder) -> Dict:
    """Depth of field, clipping planes that cut through objects, a field of view along y, a film that is not square."""
    sensor = camera(
        (0.3, 1.0, 3.4),
        (0, 0.6, 0),
        width=48,
        height=32,
        type="thinlens",
        aperture_radius=0.12,
        focus_distance=3.2,
        near_clip=2.2,
        far_clip=4.8,
        fov=42.0,
        fov_axis="y",
    )
    balls = {
        f"ball{i}": shape("sphere", scale(0.35), move(-0.9 + 0.6 * i, 0.4, 1.2 - 0.8 * i), bsdf=diffuse(0.3 + 0.2 * i, 0.5, 0.7)) for i in range(4)
    }
    return scene(sensor, 5, ground=floor(two_sided(diffuse(0.5, 0.5, 0.5))), lamp=lamp(5, 5, 5, 1.0, 3.0), **balls)


def glowing_shapes(folder: Folder) -> Dict:
    """Every shape as an area light, one textured and one a smooth mesh; a dim room around them."""
    image = {"type": "bitmap", "filename": gradient_png(folder), "filter_type": "nearest", "raw": True}
    return scene(
        camera((0, 1.4, 4.2), (0, 0.6, 0), fov=45.0),
        5,
        ground=floor(two_sided(diffuse(0.5, 0.5, 0.5))),
        wall=shape("rectangle", scale(4), move(0, 0, -2), bsdf=diffuse(0.6, 0.6, 0.6)),
        mesh=shape("obj", scale(0.35), move(-1.2, 0.6, 0), filename=write_obj(folder), emitter=area(3, 2, 1)),
        tube=shape("cylinder", p0=[-0.5, 0.2, 0.3], p1=[-0.1, 1.1, 0.1], radius=0.12, emitter=area(2, 4, 3)),
        disk=shape("disk", scale(0.35), turn("y", -20), turn("x", -30), move(0.6, 0.5, 0), emitter=area(4, 4, 6)),
        ball=shape("sphere", scale(0.2), move(1.3, 0.3, 0.4), emitter=area(6, 3, 3)),
        panel=shape("rectangle", scale(0.5), turn("x", 50), move(0, 1.9, -0.8), emitter={"type": "area", "radiance": image}),
        cube=shape("cube", scale(0.15), turn("y", 30), move(0.25, 0.16, 1.0), emitter=area(3, 5, 2)),
    )


def textured_surfaces(folder: Folder) -> Dict:
    """Bitmaps: both filters, the three ways to continue them, raw values, moved texture coordinates; a textured roughness."""
    image = gradient_png(folder)

    def bitmap(**properties: object) -> Dict:
        return {"type": "bitmap", "filename": image, **properties}

    looks = (
        {"type": "diffuse", "reflectance": bitmap(filter_type="nearest", wrap_mode="mirror", to_uv=[scale(2.5, 1.5, 1)])},
        {"type": "diffuse", "reflectance": bitmap(wrap_mode="clamp", raw=True, to_uv=[scale(1.6, 1.6, 1), move(-0.3, -0.2, 0)])},
        {"type": "roughconductor", "distribution": "ggx", "alpha": bitmap(raw=True), "specular_reflectance": bitmap()},
        {"type": "diffuse", "reflectance": {"type": "checkerboard", "to_uv": [turn("z", 30), scale(4, 4, 1)]}},
    )
    tiles = {
        f"tile{i}": shape("rectangle", scale(0.42), turn("x", -20), move(-0.45 + 0.9 * (i % 2), 0.5 + 0.95 * (i // 2), 0), bsdf=bsdf)
        for i, bsdf in enumerate(looks)
    }
    ball = shape("sphere", scale(0.3), turn("x", 40), move(0, 0.3, 0.9), bsdf={"type": "diffuse", "reflectance": bitmap()})
    can = shape("cylinder", scale(0.25), turn("x", -90), move(-0.9, 0, 0.8), bsdf={"type": "diffuse", "reflectance": bitmap()})
    plate = shape("disk", scale(0.3), turn("x", -50), move(0.9, 0.3, 0.8), bsdf={"type": "diffuse", "reflectance": bitmap(filter_type="nearest")})
    ground = floor(diffuse(0.3, 0.3, 0.3))
    light = shape("rectangle", turn("x", 180), turn("x", -30), move(0, 1.5, 3.5), emitter=area(4, 4, 4))
    return scene(camera((0, 1.2, 3.4), (0, 0.8, 0), fov=46.0), 4, **tiles, ball=ball, can=can, plate=plate, ground=ground, light=light)


def colored_glass_in_a_furnace(folder: Folder) -> Dict:
    """A constant sky seen through smooth glass, thin glass and a hollow, unbounded."""
    tinted = {"type": "dielectric", "int_ior": 1.6, "specular_transmittance": rgb(0.9, 0.7, 0.8)}
    return scene(
        camera((0, 0.3, 3.2), (0, 0, 0)),
        -1,
        sky={"type": "constant", "radiance": 0.8},
        outer=shape("sphere", scale(0.6), move(-0.5, 0, 0), bsdf=tinted),
        inner=shape("sphere", scale(0.45), move(-0.5, 0, 0), bsdf={"type": "dielectric", "int_ior": 1.0, "ext_ior": 1.6}),
        pane=shape("disk", scale(0.5), turn("y", 60), move(0.7, 0, 0), bsdf={"type": "thindielectric", "specular_reflectance": rgb(1, 0.8, 0.6)}),
        matte=shape("sphere", scale(0.25), move(0.3, -0.5, 0.5), bsdf=diffuse(0.8, 0.5, 0.3)),
    )


CATALOGUE: dict[str, Callable[[Folder], Dict]] = {
    f.__name__: f
    for f in (
        diffuse_box,
        glass_and_mirror,
        rough_metals,
        rough_glass,
        plastics,
        two_different_sides,
        delta_lights,
        environment_map,
        mesh_files,
        thin_lens,
        glowing_shapes,
        textured_surfaces,
        colored_glass_in_a_furnace,
    )
}
