"""The statistics that other tests rest on: they accept what is equal, find what is not, and say how much they could miss."""

import pathlib

import numpy as np
import pytest
from stats import assert_expected, assert_same_image, detectable, one_sample, sidak, welch


def noisy(seed: int, scale: float = 1.0, bias: float = 1.0, noise: float = 0.2) -> np.ndarray:
    """Replicated images (16, 32, 32, 3) of a gradient with skewed noise, as renders have."""
    rng = np.random.default_rng(seed)
    picture = scale * (1 + np.mgrid[0:32, 0:32][0] / 32)[..., None] * (1.0, 0.5, 0.2)
    return np.asarray(bias * picture * (1 + noise * (rng.exponential(size=(16, 32, 32, 3)) - 1)))


@pytest.mark.parametrize("noise", [0.0, 0.2, 1.0])
def test_equal_images_pass(noise: float, tmp_path: pathlib.Path) -> None:
    assert_same_image(noisy(1, noise=noise), noisy(2, noise=noise), tmp_path, tests=20)


def test_a_biased_mean_fails_and_is_written(tmp_path: pathlib.Path) -> None:
    """2 % of the mean drown in every block's noise, and are found on the mean."""
    with pytest.raises(AssertionError, match="image means differ"):
        assert_same_image(noisy(1, bias=1.02), noisy(2), tmp_path, tests=20)
    assert {path.name for path in tmp_path.iterdir()} == {"a.exr", "b.exr", "p.exr"}


def test_a_biased_block_fails(tmp_path: pathlib.Path) -> None:
    """One block that is off, where the mean stays as it is."""
    a = noisy(1)
    a[:, :8, :8] *= 1.1
    a[:, 8:16, :8] -= a[:, :8, :8] * 0.1 / 1.1
    with pytest.raises(AssertionError, match=r"of 48 blocks"):
        assert_same_image(a, noisy(2), tmp_path, tests=20)


def test_noise_that_hides_a_bias_fails(tmp_path: pathlib.Path) -> None:
    a, b = noisy(1, noise=20.0), noisy(2, noise=20.0)
    assert detectable(a, b, sidak(3)) > 0.02
    with pytest.raises(AssertionError, match="take more samples"):
        assert_same_image(a, b, tmp_path, bias=0.02)


def test_values_that_are_not_finite_fail(tmp_path: pathlib.Path) -> None:
    a = noisy(1)
    a[3, 4, 5, 1] = np.nan
    with pytest.raises(AssertionError, match="finite"):
        assert_same_image(a, noisy(2), tmp_path)


def test_known_values(tmp_path: pathlib.Path) -> None:
    values = np.random.default_rng(5).normal((3.0, 7.0), 0.5, (16, 2))
    assert_expected(values, (3.0, 7.0))
    with pytest.raises(AssertionError, match="rejected below"):
        assert_expected(values, (3.0, 8.0))


def test_p_values_are_uniform() -> None:
    """Under the null hypothesis a share x of p-values lies below x."""
    rng = np.random.default_rng(9)
    a, b = rng.normal(1, 0.1, (16, 20000)), rng.normal(1, 0.3, (16, 20000))
    for p in (welch(a, b), one_sample(b, 1.0)):
        for level in (0.5, 0.1, 0.01):
            assert abs((p < level).mean() - level) < 4.5 * np.sqrt(level / 20000)


def test_sidak() -> None:
    assert sidak(1) == pytest.approx(0.01)
    assert 1 - (1 - sidak(500)) ** 500 == pytest.approx(0.01)
