"""BSDFs, textures and emitters of a description: defaults and named constants are Mitsuba's, rows are what kernels expect."""

import math
import pathlib
from typing import Any

import numpy as np
import pytest

from renderer.bsdfs.base import (
    ALPHA_U,
    ALPHA_V,
    BECKMANN,
    DISTRIBUTION,
    ETA,
    GGX,
    KINDS,
    NONLINEAR,
    SPECULAR_PROBABILITY,
    TABLE,
    TEXTURE_A,
    TEXTURE_ALPHA_U,
)
from renderer.emitters.base import AREA, AREA_CYLINDER, AREA_DISK, AREA_MESH, AREA_RECTANGLE, AREA_SPHERE, BEAM, CDF_FIRST, CUTOFF
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.scene.metals import METALS
from renderer.scene.optics import INDICES
from tests.scenes.files import gradient_png, sky_exr

SENSOR = {"type": "perspective"}


def with_bsdf(bsdf: Any, **more: Any) -> Scene:
    """A scene of one sphere."""
    return load_scene({"type": "scene", "sensor": SENSOR, "light": {"type": "constant"}, "ball": {"type": "sphere", "bsdf": bsdf}, **more})


def with_light(**lights: Any) -> Scene:
    """A scene of one rectangle and some lights."""
    return load_scene({"type": "scene", "sensor": SENSOR, "ground": {"type": "rectangle"}, **lights})


@pytest.fixture(scope="module")
def mi() -> Any:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def test_metals_are_mitsubas(mi: Any) -> None:
    for name, constants in METALS.items():
        theirs = mi.traverse(mi.load_dict({"type": "conductor", "material": name}))
        for key, value in zip(("eta", "k"), constants, strict=True):
            assert np.allclose(np.broadcast_to(np.array(theirs[f"{key}.value"]).ravel(), 3), value, rtol=1e-5, atol=1e-9), (name, key)


def test_indices_of_refraction_are_mitsubas(mi: Any) -> None:
    for name, value in INDICES.items():
        theirs = mi.traverse(mi.load_dict({"type": "dielectric", "int_ior": name, "ext_ior": 1.0}))
        assert theirs["eta"] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_defaults_are_mitsubas(kind: str, mi: Any) -> None:
    materials = with_bsdf({"type": kind}).arrays.materials
    theirs = mi.traverse(mi.load_dict({"type": kind}))
    given = {key: np.array(theirs[key]).ravel().tolist() for key in theirs.keys()}  # noqa: SIM118 (not a mapping)
    assert KINDS[materials.kind[0]] == kind
    mine = {"reflectance.value": materials.rgb[0, 0], "diffuse_reflectance.value": materials.rgb[0, 0], "eta": materials.scalar[0, ETA]}
    mine |= {"alpha_u.value": materials.scalar[0, ALPHA_U], "alpha_v.value": materials.scalar[0, ALPHA_V]}
    mine |= {"alpha.value": materials.scalar[0, ALPHA_U]}
    mine |= {"eta.value": materials.rgb[0, 1], "k.value": materials.rgb[0, 2], "specular_reflectance.value": materials.rgb[0, 0]}
    if kind in ("plastic", "roughplastic"):
        mine |= {"specular_reflectance.value": materials.rgb[0, 1], "alpha": materials.scalar[0, ALPHA_U]}
        assert materials.scalar[0, SPECULAR_PROBABILITY] == pytest.approx(2 / 3)
    compared = [key for key in mine if key in given]
    assert compared
    for key in compared:
        assert np.allclose(mine[key], given[key], rtol=1e-6), key


def test_rough_plastics_bring_their_table() -> None:
    scene = with_bsdf({"type": "twosided", "a": {"type": "roughplastic", "alpha": 0.2, "distribution": "ggx", "nonlinear": True}})
    materials = scene.arrays.materials
    assert materials.tables is not None
    assert materials.tables.shape == (1, 64)
    assert materials.index[0, TABLE] == 0
    assert (materials.index[0, DISTRIBUTION], materials.index[0, NONLINEAR]) == (GGX, 1)
    assert scene.arrays.families.plastic
    assert scene.arrays.families.specular is None


def test_two_sided_with_two_bsdfs() -> None:
    scene = with_bsdf({"type": "twosided", "a": {"type": "diffuse"}, "b": {"type": "conductor", "material": "Au"}})
    objects = scene.arrays.objects
    assert (objects.front[0], objects.back[0], objects.two_sided[0]) == (0, 1, 1)


def test_a_shape_without_bsdf_is_gray_unless_it_shines() -> None:
    scene = with_light(lamp={"type": "disk", "emitter": {"type": "area"}})
    assert scene.arrays.objects.front.tolist() == [0, -1]
    assert np.allclose(scene.arrays.materials.rgb[0, 0], 0.5)
    assert scene.arrays.emitters.rgb.tolist() == [[1, 1, 1]]


def test_shared_bsdf_is_one_row() -> None:
    description = {"type": "scene", "sensor": SENSOR, "light": {"type": "constant"}, "gray": {"type": "diffuse"}}
    description |= {name: {"type": "sphere", "bsdf": {"type": "ref", "id": "gray"}} for name in "abc"}
    scene = load_scene(description)
    assert scene.arrays.objects.front.tolist() == [0, 0, 0]
    assert {info.material for info in scene.objects} == {"gray"}


def test_roughness_along_both_tangents_keeps_texture_coordinates() -> None:
    isotropic = with_bsdf({"type": "roughconductor", "material": "Cu", "alpha": 0.2}, wall={"type": "rectangle"})
    anisotropic = with_bsdf({"type": "roughconductor", "material": "Cu", "alpha_u": 0.2, "alpha_v": 0.1}, wall={"type": "rectangle"})
    assert isotropic.arrays.geometry.uvs is None
    assert anisotropic.arrays.geometry.uvs is not None
    assert anisotropic.arrays.materials.scalar[0, [ALPHA_U, ALPHA_V]].tolist() == pytest.approx([0.2, 0.1])
    assert anisotropic.arrays.materials.index[0, DISTRIBUTION] == BECKMANN


def test_textures(session_folder: pathlib.Path) -> None:
    image = {"type": "bitmap", "filename": gradient_png(session_folder), "wrap_mode": "clamp", "filter_type": "nearest"}
    image["to_uv"] = [{"scale": [2, 3, 1]}, {"translate": [0.5, 0.25, 0]}]
    wall = {"type": "rectangle", "bsdf": {"type": "roughconductor", "alpha": {"type": "checkerboard"}}}
    scene = with_bsdf({"type": "diffuse", "reflectance": image}, wall=wall)
    textures = scene.arrays.textures
    assert textures is not None
    assert np.allclose(textures.to_uv[0], [[2, 0, 0.5], [0, 3, 0.25]])
    assert textures.size[0].tolist() == [9, 6]
    assert len(textures.pixels) == 54
    assert scene.arrays.materials.index[0, TEXTURE_A] == 0
    assert scene.arrays.materials.index[1, TEXTURE_ALPHA_U] == 1


def test_area_emitters_by_shape() -> None:
    glow = {"emitter": {"type": "area", "radiance": 2.0}}
    scene = with_light(
        a={"type": "rectangle", "to_world": [{"scale": [2, 3, 1]}], "flip_normals": True, **glow},
        b={"type": "cube", **glow},
        c={"type": "sphere", "radius": 0.5, **glow},
        d={"type": "disk", **glow},
        e={"type": "cylinder", "radius": 2.0, "p1": [0, 0, 3], **glow},
        f={"type": "cube", "to_world": [{"scale": [1, 1, 2]}], **glow},
    )
    emitters = scene.arrays.emitters
    assert emitters.kind.tolist() == [AREA_RECTANGLE, AREA_MESH, AREA_SPHERE, AREA_DISK, AREA_CYLINDER, AREA_MESH]
    assert emitters.scalar[:, AREA].tolist() == pytest.approx([24, 24, math.pi, math.pi, 12 * math.pi, 40])
    assert emitters.frame[0].tolist() == [-2, -3, 0, 4, 0, 0, 0, 6, 0, 0, 0, -1]
    assert emitters.object.tolist() == [1, 2, 3, 4, 5, 6]
    assert scene.arrays.objects.emitter.tolist() == [-1, 0, 1, 2, 3, 4, 5]
    assert emitters.cdf is not None
    first = int(emitters.primitive[5, CDF_FIRST])
    assert (emitters.cdf[0], emitters.cdf[12], emitters.cdf[first], emitters.cdf[-1]) == (0, 1, 0, 1)
    shares = np.diff(emitters.cdf[first : first + 13])
    p = scene.arrays.geometry
    rows = slice(*(np.array([0, 1]) * emitters.primitive[5, 1] + emitters.primitive[5, 0]))
    areas = np.linalg.norm(np.cross(p.e1[rows], p.e2[rows]), axis=1) / 2
    assert shares == pytest.approx(areas / areas.sum(), abs=1e-6)
    assert emitters.curved
    assert emitters.sky is None


def test_free_emitters(session_folder: pathlib.Path) -> None:
    scene = with_light(
        lamp={"type": "point", "position": [1, 2, 3], "intensity": {"type": "rgb", "value": [1, 2, 3]}},
        torch={"type": "spot", "to_world": [{"lookat": {"origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}], "cutoff_angle": 40},
        sun={"type": "directional", "direction": [0, -3, 0], "irradiance": 4.0},
        sky={"type": "envmap", "filename": sky_exr(session_folder), "scale": 0.5},
    )
    emitters = scene.arrays.emitters
    assert emitters.frame[0].reshape(3, 4)[:, 3].tolist() == [1, 2, 3]
    assert emitters.frame[1].reshape(3, 4)[:, 2].tolist() == pytest.approx([0, 0, -1])
    assert emitters.scalar[1, [CUTOFF, BEAM]].tolist() == pytest.approx([1 - math.cos(math.radians(40)), 1 - math.cos(math.radians(30))])
    assert emitters.frame[2].reshape(3, 4)[:, 2].tolist() == pytest.approx([0, -1, 0])
    assert emitters.rgb[3].tolist() == [0.5, 0.5, 0.5]
    assert emitters.infinite == 3
    assert emitters.environment is not None
    assert [(e.kind, e.infinite, e.symbol) for e in scene.emitters[2:]] == [("directional", True, "L"), ("envmap", True, "B")]


def test_scene_sphere_holds_everything() -> None:
    scene = with_light(lamp={"type": "point"}, ball={"type": "sphere", "center": [5, 0, 0], "radius": 2.0})
    x, y, z, radius = scene.arrays.emitters.bounds
    assert np.linalg.norm(np.array([7, 2, 2]) - (x, y, z)) <= radius
    assert np.linalg.norm(np.array([-1, -2, -2]) - (x, y, z)) <= radius


def test_the_shipped_sky_is_what_its_program_makes() -> None:
    from renderer.textures.bitmap import load_bitmap
    from tests.renderer.sky_image import PATH, sky_image

    assert np.allclose(load_bitmap(PATH, False), sky_image(), rtol=1e-3, atol=1e-3)
