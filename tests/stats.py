"""Statistics of noisy images: z-tests whose tolerance is the estimate's own variance, corrected for the number of tests.

An *estimate* is an array (replicates, …): independent estimates of the same thing, whose scatter gives the standard error. Two estimates
are compared by Welch's t-test (welch1947), block of pixels by block of pixels and on the image mean: blocks find local errors, the mean finds
a bias that drowns in each block's noise. A test that asks ``n`` questions rejects at ``sidak(n)``, so that all of them together fail by chance in
1 % of all seeds.
"""

import pathlib

import numpy as np
import numpy.typing as npt
import scipy.stats

F64 = npt.NDArray[np.float64]
LEVEL = 0.01
FLOAT32 = 1e-5  # relative error that float32 sums may have, beside the noise


def sidak(tests: int, level: float = LEVEL) -> float:
    """Level of each of ``tests`` independent tests such that all together fail by chance with probability ``level``."""
    return float(-np.expm1(np.log1p(-level) / tests))


def standard_error(estimate: F64) -> F64:
    """Standard error of the replicates' mean."""
    return np.asarray(estimate.std(axis=0, ddof=1) / np.sqrt(len(estimate)))


def two_sided(difference: F64, error: F64, scale: F64, freedom: F64) -> F64:
    """P-values of differences with these standard errors; where there is no noise, of float32's rounding."""
    error = np.sqrt(error**2 + (FLOAT32 * scale) ** 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(difference == 0, 0.0, np.abs(difference) / error)
    return np.asarray(2 * scipy.stats.t.sf(t, np.maximum(freedom, 1.0)))


def welch(a: F64, b: F64) -> F64:
    """P-values that two estimates (replicates, …) have the same mean (welch1947)."""
    va, vb = standard_error(a) ** 2, standard_error(b) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = (va + vb) ** 2 / (va**2 / (len(a) - 1) + vb**2 / (len(b) - 1))
    freedom = np.where(np.isfinite(freedom), freedom, len(a) + len(b) - 2)
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    return two_sided(mean_a - mean_b, np.sqrt(va + vb), np.maximum(np.abs(mean_a), np.abs(mean_b)), freedom)


def one_sample(estimate: F64, expected: npt.ArrayLike) -> F64:
    """P-values that an estimate (replicates, …) has the expected mean."""
    expected = np.asarray(expected, np.float64)
    return two_sided(estimate.mean(axis=0) - expected, standard_error(estimate), np.abs(expected), np.asarray(len(estimate) - 1.0))


def blocks(images: F64, size: int) -> F64:
    """Means over blocks of size x size pixels: (n, h, w, c) becomes (n, h / size, w / size, c)."""
    n, h, w, c = images.shape
    assert (h % size, w % size) == (0, 0), f"{w} x {h} pixels do not divide into blocks of {size}"
    return images.reshape(n, h // size, size, w // size, size, c).mean(axis=(2, 4))


def detectable(a: F64, b: F64, level: float) -> float:
    """The smallest relative bias of the image mean that these two estimates reject at ``level``, in the noisiest channel."""
    mean_a, mean_b = a.mean(axis=(1, 2)), b.mean(axis=(1, 2))
    error = np.sqrt(standard_error(mean_a) ** 2 + standard_error(mean_b) ** 2)
    freedom = len(a) + len(b) - 2
    return float((scipy.stats.t.isf(level / 2, freedom) * error / mean_b.mean(axis=0)).max())


def assert_same_image(a: F64, b: F64, folder: pathlib.Path, tests: int = 1, size: int = 8, bias: float | None = None) -> None:
    """Fail where two estimates (replicates, height, width, channels) differ by more than their noise.

    ``tests``: how many such comparisons the file makes. Half of the level goes to blocks, half to image means. ``bias``: fail too where
    the noise is so large that a relative bias of this size of the mean would pass. Images of both, and of p-values, are written to ``folder``.
    """
    assert a.shape[1:] == b.shape[1:], f"shapes differ: {a.shape} and {b.shape}"
    assert np.isfinite(a.sum() + b.sum()), "an image has values that are not finite"
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    p_blocks = welch(blocks(a, size), blocks(b, size))
    p_mean = welch(a.mean(axis=(1, 2)), b.mean(axis=(1, 2)))
    level_blocks, level_mean = sidak(tests * p_blocks.size, LEVEL / 2), sidak(tests * p_mean.size, LEVEL / 2)
    if bias is not None:
        found = detectable(a, b, level_mean)
        assert found <= bias, f"a bias of {bias:.1%} of the mean could pass (up to {found:.1%}): take more samples"
    means = f"means {a.mean(axis=(0, 1, 2))} and {b.mean(axis=(0, 1, 2))}"
    if p_blocks.min() >= level_blocks and p_mean.min() >= level_mean:
        return
    write_images(folder, a=a.mean(axis=0), b=b.mean(axis=0), p=p_blocks.repeat(size, 0).repeat(size, 1))
    raise AssertionError(
        f"image means differ with p = {p_mean.min():.2e} (rejected below {level_mean:.2e}), blocks with p = {p_blocks.min():.2e} "
        f"(below {level_blocks:.2e}; {(p_blocks < level_blocks).sum()} of {p_blocks.size} blocks); {means}; images are in {folder}"
    )


def assert_expected(estimate: F64, expected: npt.ArrayLike, tests: int = 1) -> None:
    """Fail where an estimate (replicates, …) differs from a known value by more than its noise."""
    p = one_sample(np.asarray(estimate, np.float64), expected)
    level = sidak(tests * p.size)
    assert p.min() >= level, f"p = {p.min():.2e} (rejected below {level:.2e}); {estimate.mean(axis=0)} is not {expected}"


def write_images(folder: pathlib.Path, **images: F64) -> None:
    """Write images (height, width, 3) as ``<name>.exr``."""
    import OpenImageIO as oiio

    for name, image in images.items():
        h, w, c = image.shape
        out = oiio.ImageOutput.create(str(folder / f"{name}.exr"))
        out.open(str(folder / f"{name}.exr"), oiio.ImageSpec(w, h, c, "float"))
        out.write_image(np.ascontiguousarray(image, np.float32))
        out.close()
