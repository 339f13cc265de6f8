"""Image files as linear RGB, read through OpenImageIO."""

import os

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from renderer.errors import SceneError


def srgb_to_linear(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """sRGB-coded values, any shape, in [0, 1] as linear light (IEC 61966-2-1)."""
    linear = np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


def load_bitmap(path: str | os.PathLike[str], raw: bool) -> npt.NDArray[np.float32]:
    """The pixels of an image file, (height, width, 3) float32 in linear RGB, top row first.

    Integer formats (8 and 16 bits) are sRGB-coded and get decoded unless ``raw``; floating-point formats are linear
    already. Gray becomes RGB and alpha is dropped.

    Raises:
        OSError: the file cannot be opened.
        SceneError: it is no image that OpenImageIO reads, or has pixels that are not finite.

    """
    with open(path, "rb"):
        pass  # the operating system's own error, with the path, where there is no such file
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageInput.open(os.fspath(path), config)
    if image is None:
        raise SceneError(f"expected an image file, but OpenImageIO cannot read {os.fspath(path)!r}: {oiio.geterror()}")
    try:
        spec = image.spec()
        coded = spec.format.basetype not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE) and not raw
        values = image.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        if values is None:
            raise SceneError(f"the image {os.fspath(path)!r} is damaged: {image.geterror()}")
    finally:
        image.close()

    # Gray and alpha
    pixels = np.asarray(values, np.float32).reshape(spec.height, spec.width, spec.nchannels)
    pixels = np.repeat(pixels[:, :, :1], 3, axis=2) if spec.nchannels < 3 else pixels[:, :, :3]
    if not np.isfinite(pixels).all():
        raise SceneError(f"the image {os.fspath(path)!r} has pixels that are not finite numbers")
    return np.ascontiguousarray(srgb_to_linear(pixels) if coded else pixels)
