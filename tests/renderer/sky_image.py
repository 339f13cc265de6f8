"""The sky of ``configs/scenes/sky.exr``: a clear gradient, a bright small sun, a dark ground. Run this file to write it."""

import pathlib

import numpy as np
import numpy.typing as npt

WIDTH, HEIGHT = 128, 65
PATH = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "sky.exr"
SUN = np.array([0.35, 0.5, -0.79]) / np.linalg.norm([0.35, 0.5, -0.79])


def sky_image() -> npt.NDArray[np.float32]:
    """Radiance by latitude (rows, zenith first) and longitude, (65, 128, 3) float32, y up."""
    theta = np.arange(HEIGHT)[:, None] * np.pi / (HEIGHT - 1)
    phi = (np.arange(WIDTH)[None, :] + 0.5) * 2 * np.pi / WIDTH
    d = np.stack(np.broadcast_arrays(np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)), axis=-1)
    up = np.clip(d[..., 1:2], 0, 1)
    sky = np.array([0.75, 0.85, 1.0]) * (1 - up) ** 2 + np.array([0.16, 0.32, 0.85]) * (1 - (1 - up) ** 2)
    sky = np.where(d[..., 1:2] >= 0, sky, [0.22, 0.2, 0.18])
    cosine = d @ SUN
    sun = np.array([1.0, 0.9, 0.75]) * (220 * np.exp((cosine - 1) * 900) + 2 * np.exp((cosine - 1) * 25))[..., None]
    return (sky + np.where(d[..., 1:2] > 0, sun, 0)).astype(np.float32)


def write(path: pathlib.Path = PATH) -> None:
    """Write the image as half floats."""
    import OpenImageIO as oiio

    out = oiio.ImageOutput.create(str(path))
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, oiio.HALF)
    spec.attribute("compression", "zip")
    assert out is not None
    assert out.open(str(path), spec)
    assert out.write_image(sky_image())
    out.close()


if __name__ == "__main__":
    write()
