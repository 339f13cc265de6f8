"""Images as files: linear float EXR for computing, tone-mapped PNG for looking."""

import os
import pathlib
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from pipeline.errors import RunFolderError

F32 = npt.NDArray[np.float32]


def write_exr(path: pathlib.Path, image: F32, metadata: Mapping[str, str]) -> None:
    """Write linear radiance, float32 (height, width, 3), as channels R, G, B; metadata keys get the prefix ``pathspace:``."""
    write_layers(path, {"": image}, metadata)


def write_layers(path: pathlib.Path, layers: Mapping[str, F32], metadata: Mapping[str, str]) -> None:
    """Write images of one size, float32 (height, width, 3), as layers of one EXR: channels ``name.R``, ``name.G``, ``name.B``; R, G, B for ``""``."""
    channels = [f"{name}.{channel}" if name else channel for name in layers for channel in "RGB"]
    _write_exr(path, channels, np.concatenate([np.asarray(image, np.float32) for image in layers.values()], axis=2), metadata)


def write_plane(path: pathlib.Path, plane: F32, metadata: Mapping[str, str]) -> None:
    """Write numbers, float32 (rows, columns), as the only channel, Y, of an EXR."""
    _write_exr(path, ["Y"], np.ascontiguousarray(plane[:, :, None], np.float32), metadata)


def _write_exr(path: pathlib.Path, channels: Sequence[str], pixels: F32, metadata: Mapping[str, str]) -> None:
    height, width, _ = pixels.shape
    spec = oiio.ImageSpec(width, height, len(channels), oiio.FLOAT)
    spec.channelnames = tuple(channels)
    spec.attribute("compression", "zip")
    spec.attribute("DateTime", "")  # otherwise the time of day is written, and equal images are unequal files
    spec.attribute("Software", f"pathspace {metadata.get('version', '')}".strip())
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    for key, value in metadata.items():
        spec.attribute(f"pathspace:{key}", value)
    _write(path, spec, pixels)


def write_png(path: pathlib.Path, image: F32, exposure: float = 0.0) -> None:
    """Write a picture of linear radiance, float32 (height, width, 3): `tone_map`, then 8 bits a channel."""
    height, width, _ = image.shape
    spec = oiio.ImageSpec(width, height, 3, oiio.UINT8)
    spec.attribute("oiio:ColorSpace", "sRGB")
    _write(path, spec, tone_map(image, exposure))


def tone_map(image: F32, exposure: float = 0.0) -> npt.NDArray[np.uint8]:
    """Multiply by 2^exposure, clip to 0 … 1, apply the sRGB curve (IEC 61966-2-1), round to 8 bits.

    The curve is 12.92 x below 0.0031308 and 1.055 x^(1/2.4) - 0.055 above; there is no shoulder, so that a value can be read back.
    """
    x = np.clip(np.nan_to_num(image.astype(np.float64), posinf=np.inf, neginf=-np.inf) * 2.0**exposure, 0.0, 1.0)
    curve = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)
    rounded: npt.NDArray[np.uint8] = np.round(curve * 255.0).astype(np.uint8)
    return rounded


def read_exr(path: pathlib.Path) -> F32:
    """The R, G, B channels of an EXR file, float32 (height, width, 3)."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise RunFolderError(f"`{path}` cannot be read as an image: {oiio.geterror()}")
    image = np.asarray(source.read_image(oiio.FLOAT), np.float32)
    source.close()
    return image[..., :3]


def _write(path: pathlib.Path, spec: oiio.ImageSpec, pixels: npt.NDArray[np.generic]) -> None:
    """Write under a temporary name (of the same kind, which names the format), then rename."""
    temporary = path.with_name(f".{path.stem}.tmp{path.suffix}")
    out = oiio.ImageOutput.create(str(temporary))
    if out is None or not (out.open(str(temporary), spec) and out.write_image(pixels) and out.close()):
        temporary.unlink(missing_ok=True)
        raise RunFolderError(f"`{path}` cannot be written: {out.geterror() if out else oiio.geterror()}")
    os.replace(temporary, path)
