"""The three forms of a description, XML, YAML and a dictionary, and what a compiled scene writes back."""

import pathlib
from typing import Any

import numpy as np
import pytest

from renderer.errors import SceneError
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.scene.to_mitsuba import mitsuba_dict
from tests.scenes.files import write_mesh, write_obj

XML = """<scene version="3.0.0">
    <default name="spp" value="16"/>
    <default name="height" value="1.5"/>
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective" id="camera">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/><rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <bsdf type="twosided" id="paint"><bsdf type="diffuse"><rgb name="reflectance" value="0.2 0.4 0.6"/></bsdf></bsdf>
    <shape type="rectangle" id="floor">
        <transform name="to_world">
            <scale x="3" y="2"/><rotate x="1" angle="-90"/><translate y="$height"/>
        </transform>
        <ref id="paint"/>
    </shape>
    <shape type="cube">
        <transform name="to_world"><matrix value="1 0 0 4  0 2 0 5  0 0 1 6  0 0 0 1"/></transform>
        <bsdf type="roughconductor" name="metal">
            <string name="material" value="Au"/><float name="alpha" value="0.2"/>
            <spectrum name="specular_reflectance" value="0.9"/>
        </bsdf>
    </shape>
    <shape type="sphere" id="lamp">
        <point name="center" value="0 4 0"/><float name="radius" value="0.5"/><boolean name="flip_normals" value="false"/>
        <emitter type="area"><spectrum type="uniform" name="radiance"><float name="value" value="3"/></spectrum></emitter>
    </shape>
    <emitter type="point"><point name="position" x="1" y="2" z="0"/></emitter>
</scene>
"""

YAML = """
type: scene
integrator: {type: path, max_depth: 6}
camera:
  type: perspective
  fov: 4e1
  to_world: [{lookat: {origin: [0, 1, -5], target: [0, 1, 0], up: [0, 1, 0]}}]
  film: {type: hdrfilm, width: 32, height: 24, rfilter: {type: box}}
  sampler: {type: independent, sample_count: 16}
paint: {type: twosided, bsdf: {type: diffuse, reflectance: {type: rgb, value: [0.2, 0.4, 0.6]}}}
floor:
  type: rectangle
  to_world: [{scale: [3, 2, 1]}, {rotate: {axis: [1, 0, 0], angle: -90}}, {translate: [0, 1.5, 0]}]
  bsdf: {type: ref, id: paint}
cube:
  type: cube
  to_world: [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
  metal: {type: roughconductor, material: Au, alpha: 0.2, specular_reflectance: 0.9}
lamp:
  type: sphere
  center: [0, 4, 0]
  radius: 0.5
  emitter: {type: area, radiance: {type: uniform, value: 3}}
point: {type: point, position: [1, 2, 0]}
"""


def leaves(data: Any) -> list[Any]:
    """All arrays and numbers of nested tuples, with None where a piece is missing."""
    return [leaf for item in data for leaf in leaves(item)] if isinstance(data, tuple) else [data]


def assert_same(a: Scene, b: Scene) -> None:
    """Equal arrays and catalogues."""
    for x, y in zip(leaves(tuple(a.arrays)), leaves(tuple(b.arrays)), strict=True):
        assert (x is None) == (y is None)
        assert x is None or np.array_equal(x, y)
    assert a.objects == b.objects
    assert a.emitters == b.emitters
    assert a.defaults == b.defaults
    assert np.array_equal(a.triangles, b.triangles)


def write(folder: pathlib.Path, name: str, text: str) -> pathlib.Path:
    """A file in a folder."""
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    return folder / name


def test_xml_and_yaml_are_the_same_scene(tmp_path: pathlib.Path) -> None:
    from_xml, from_yaml = load_scene(write(tmp_path, "a.xml", XML)), load_scene(write(tmp_path, "a.yaml", YAML))
    assert_same(from_xml, from_yaml)
    assert [info.name for info in from_xml.objects] == ["floor", "cube", "lamp"]
    assert [info.material for info in from_xml.objects] == ["paint", "roughconductor", "none"]


def test_a_description_written_back_is_the_same_scene(tmp_path: pathlib.Path) -> None:
    for name, text in (("a.xml", XML), ("a.yaml", YAML)):
        scene = load_scene(write(tmp_path, name, text))
        again = load_scene(scene.description)
        assert_same(scene, again)
        assert again.description == scene.description


def test_our_xml_is_mitsubas_xml(tmp_path: pathlib.Path) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    path = write(tmp_path, "a.xml", XML)
    theirs, ours = mi.load_file(str(path)), mi.load_dict(mitsuba_dict(load_scene(path).description))
    assert len(theirs.shapes()) == len(ours.shapes()) == 3
    assert np.allclose(theirs.bbox().min, ours.bbox().min, atol=1e-6)
    assert np.allclose(theirs.bbox().max, ours.bbox().max, atol=1e-6)
    images = [np.array(mi.render(scene, spp=4, seed=1)) for scene in (theirs, ours)]
    assert np.allclose(images[0], images[1], rtol=1e-4, atol=1e-6)


def test_parameters(tmp_path: pathlib.Path) -> None:
    path = write(tmp_path, "a.xml", XML)
    assert load_scene(path, {"spp": "99"}).defaults.samples == 99
    assert load_scene(path, {"height": "7"}).objects[0].bounds[0][1] == 7
    with pytest.raises(SceneError, match=r"no parameter 'ssp'; did you mean 'spp'"):
        load_scene(path, {"ssp": "99"})
    with pytest.raises(SceneError, match="XML"):
        load_scene(write(tmp_path, "a.yaml", YAML), {"spp": "99"})


def test_includes_aliases_and_paths(tmp_path: pathlib.Path) -> None:
    (tmp_path / "models").mkdir()
    write_obj(tmp_path / "models")
    write(tmp_path, "parts/paint.xml", '<scene version="3.0.0"><bsdf type="diffuse" id="paint"/><alias id="paint" as="varnish"/></scene>')
    write(tmp_path, "parts/lamp.xml", '<emitter type="constant" id="sky"/>')
    text = """<scene version="3.0.0">
        <path value="models"/>
        <include filename="parts/paint.xml"/>
        <include filename="parts/lamp.xml"/>
        <sensor type="perspective"/>
        <shape type="obj" id="blob"><string name="filename" value="blob.obj"/><ref id="varnish"/></shape>
    </scene>"""
    scene = load_scene(write(tmp_path, "a.xml", text))
    assert [(info.name, info.material) for info in scene.objects] == [("blob", "paint")]
    assert [info.name for info in scene.emitters] == ["sky"]
    assert scene.description["blob"]["filename"] == str(tmp_path / "models" / "blob.obj")
    assert_same(scene, load_scene(scene.description))


def test_unnamed_shapes_get_names_of_their_own(tmp_path: pathlib.Path) -> None:
    text = """<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
        <shape type="cube"/><shape type="cube"/><shape type="sphere" id="cube"/></scene>"""
    scene = load_scene(write(tmp_path, "a.xml", text))
    names = [info.name for info in scene.objects]
    assert names[2] == "cube"
    assert len(set(names)) == 3
    assert_same(scene, load_scene(scene.description))


def test_shapes_without_a_bsdf_share_the_default() -> None:
    shapes = {f"cube{i}": {"type": "cube"} for i in range(40)}
    shapes |= {f"red{i}": {"type": "cube", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [i / 40, 0, 0]}}} for i in range(40)}
    scene = load_scene({"type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "constant"}} | shapes)
    assert len(scene.arrays.materials.kind) == 1 + 40


def test_dictionary_of_load_dict_with_transform_objects() -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    description = {"type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "constant"}}
    description["box"] = {"type": "cube", "to_world": mi.ScalarTransform4f().translate([1, 2, 3]).rotate([0, 1, 0], 90)}
    assert np.allclose(load_scene(description).objects[0].bounds, [[0, 1, 2], [2, 3, 4]], atol=1e-6)


def test_files_are_found_beside_the_description(tmp_path: pathlib.Path) -> None:
    write_obj(tmp_path)
    text = "{type: scene, s: {type: perspective}, e: {type: constant}, blob: {type: obj, filename: blob.obj}}"
    scene = load_scene(write(tmp_path, "a.yaml", text))
    description = {"type": "scene", "s": {"type": "perspective"}, "e": {"type": "constant"}, "blob": {"type": "obj", "filename": "blob.obj"}}
    assert_same(scene, load_scene(description, base=tmp_path))


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_other_mesh_formats_render_in_mitsuba_too(suffix: str, session_folder: pathlib.Path) -> None:
    from tests.renderer.scene_parity import compare

    mesh = {"type": "mesh", "filename": write_mesh(session_folder, suffix), "bsdf": {"type": "ref", "id": "paint"}}
    description = {"type": "scene", "s": {"type": "perspective"}, "e": {"type": "constant"}, "blob": mesh}
    description["paint"] = {"type": "diffuse", "reflectance": {"type": "checkerboard"}}
    compare(load_scene(description), 200, 3, tangents=False)
