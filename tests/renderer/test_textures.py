"""Textures: the same colors as Mitsuba's, from arrays and from files."""

import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
import pytest

from renderer.errors import SceneError
from renderer.textures.base import BILINEAR, BITMAP, CHECKERBOARD, CLAMP, MIRROR, NEAREST, REPEAT, Textures
from renderer.textures.bitmap import load_bitmap
from renderer.textures.lookup import texture_rgb

F32 = np.float32
PIXELS = np.random.default_rng(1).random((5, 7, 3)).astype(F32)
TO_UV = np.array([[1.3, 0.2, 0.1], [-0.3, 0.8, -0.2]])
COLORS = np.array([[0.1, 0.2, 0.3], [0.6, 0.5, 0.4]])
BLACK = (F32(0), F32(0), F32(0))
FILTERS = {"nearest": NEAREST, "bilinear": BILINEAR}
WRAPS = {"repeat": REPEAT, "mirror": MIRROR, "clamp": CLAMP}


@pytest.fixture(autouse=True)
def _scalar_variant():
    mi.set_variant("scalar_rgb")


def textures(kind, mode=(NEAREST, REPEAT), to_uv=TO_UV) -> Textures:
    """Two textures, the first a decoy, so that offsets into the pixels show."""
    pixels = np.concatenate([np.full((3, 3), 9, F32), PIXELS.reshape(-1, 3)])
    return Textures(
        np.array([BITMAP, kind], np.int32), np.array([to_uv, to_uv], F32), np.array([COLORS, COLORS], F32), np.array([0, 3]),
        np.array([[3, 1], [7, 5]], np.int32), np.array([mode, mode], np.int32), pixels,
    )  # fmt: skip


def matrix():
    return mi.ScalarTransform3f(np.vstack([TO_UV, [0, 0, 1]]))


def compare(ours, theirs, seed):
    for u, v in np.random.default_rng(seed).uniform(-2.5, 2.5, (300, 2)).astype(F32):
        si = mi.SurfaceInteraction3f()
        si.uv = [u, v]
        assert np.allclose(texture_rgb(ours, 1, BLACK, u, v), theirs.eval(si), atol=2e-5)


@pytest.mark.parametrize("filter_type", FILTERS)
@pytest.mark.parametrize("wrap_mode", WRAPS)
def test_bitmap_is_mitsubas(filter_type, wrap_mode):
    theirs = mi.load_dict({
        "type": "bitmap", "bitmap": mi.Bitmap(PIXELS), "raw": True, "filter_type": filter_type, "wrap_mode": wrap_mode, "to_uv": matrix(),
    })  # fmt: skip
    compare(textures(BITMAP, (FILTERS[filter_type], WRAPS[wrap_mode])), theirs, seed=2)


def test_checkerboard_is_mitsubas():
    theirs = mi.load_dict({
        "type": "checkerboard", "to_uv": matrix(),
        "color0": {"type": "rgb", "value": list(COLORS[0])}, "color1": {"type": "rgb", "value": list(COLORS[1])},
    })  # fmt: skip
    compare(textures(CHECKERBOARD), theirs, seed=3)


def test_no_texture_gives_the_constant():
    color = (F32(0.1), F32(0.2), F32(0.3))
    assert texture_rgb(None, -1, color, F32(0.5), F32(0.5)) == color
    assert texture_rgb(textures(BITMAP), -1, color, F32(0.5), F32(0.5)) == color


def write(path, values, kind):
    height, width, channels = values.shape
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert out.write_image(values)
    out.close()


@pytest.mark.parametrize("raw", [False, True])
@pytest.mark.parametrize(
    ("name", "channels", "kind"),
    [("rgb.png", 3, "uint8"), ("rgba.png", 4, "uint8"), ("gray.png", 1, "uint8"), ("deep.png", 3, "uint16"), ("linear.exr", 3, "float"),
     ("half.exr", 3, "half"), ("gray.exr", 1, "float")],
)  # fmt: skip
def test_files_load_as_mitsuba_loads_them(tmp_path, name, channels, kind, raw):
    values = np.random.default_rng(4).random((4, 6, channels)).astype(F32)
    write(tmp_path / name, values, kind)
    ours = load_bitmap(tmp_path / name, raw)
    assert ours.shape == (4, 6, 3)
    assert ours.dtype == F32
    theirs = mi.load_dict({"type": "bitmap", "filename": str(tmp_path / name), "raw": raw, "filter_type": "nearest", "format": "variant"})
    for y in range(4):
        for x in range(6):
            si = mi.SurfaceInteraction3f()
            si.uv = [(x + 0.5) / 6, (y + 0.5) / 4]
            assert np.allclose(ours[y, x], theirs.eval(si), atol=2e-4)


def test_bad_files_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing\.png"):
        load_bitmap(tmp_path / "missing.png", False)
    (tmp_path / "junk.png").write_bytes(b"this is no image" * 20)
    with pytest.raises(SceneError, match="expected an image"):
        load_bitmap(tmp_path / "junk.png", False)
    write(tmp_path / "good.png", np.random.default_rng(5).random((40, 60, 3)).astype(F32), "uint8")
    (tmp_path / "cut.png").write_bytes((tmp_path / "good.png").read_bytes()[:2000])
    with pytest.raises(SceneError, match=r"damaged|expected an image"):
        load_bitmap(tmp_path / "cut.png", False)
    write(tmp_path / "nan.exr", np.full((2, 2, 3), np.nan, F32), "float")
    with pytest.raises(SceneError, match="finite"):
        load_bitmap(tmp_path / "nan.exr", False)
