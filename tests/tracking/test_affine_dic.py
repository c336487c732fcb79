"""The example of an affine correlation of subsets, which the benchmark has."""

import numba
import numpy as np
import pytest
from scipy import ndimage

from echotruth.config.tracking import External
from echotruth.imaging import spline
from echotruth.tracking import track
from examples import affine_dic

SPACING = 3e-5
SIZE = 160


def texture(random=0):
    """Spline coefficients, with their margin, of a smooth image that a cubic spline represents exactly."""
    noise = np.random.default_rng(random).normal(size=(SIZE, SIZE))
    return spline.coefficients(ndimage.gaussian_filter(noise, 2.5, mode="mirror").astype(np.float32))


def tracked(frames, points, **options):
    mask, settings = np.ones(frames.shape[1:], bool), External(track="examples.affine_dic:track", options=options)
    return track(frames, points, mask, SPACING, np.arange(len(frames)) * 3e-3, 0, settings)


@pytest.fixture
def inner():
    lateral, axial = np.meshgrid(np.arange(45.0, 116, 9.3), np.arange(45.0, 116, 9.3))
    return np.stack([lateral, axial], -1).reshape(-1, 2)


def aligned(first, second, points, start, half=12, min_std=1e-3):
    warps, ncc = np.array(start, float), np.zeros(len(points))
    affine_dic.align(first, second, points, half, min_std, warps, ncc)
    return warps, ncc


def test_affine_motion_is_found_to_the_thousandth_of_a_pixel(inner):
    """The second image is the spline of the first at the positions from which the tissue came."""
    first = texture()
    motion = np.array([1.7, 0.03, -0.02, -0.8, 0.015, -0.04])
    matrix = np.array([[1.03, -0.02], [0.015, 0.96]])
    middle = inner[20]
    row, column = np.indices((SIZE, SIZE), float)
    to = np.stack([column, row], -1) - middle
    came = (to - motion[[0, 3]]) @ np.linalg.inv(matrix).T + middle
    values = ndimage.map_coordinates(first[1:-2, 1:-2], [came[..., 1], came[..., 0]], order=3, prefilter=False)
    second = spline.coefficients(values.astype(np.float32))
    found, ncc = aligned(first, second, middle[None], np.zeros((1, 6)))
    np.testing.assert_allclose(found[0, [0, 3]], motion[[0, 3]], atol=2e-3)
    np.testing.assert_allclose(found[0, [1, 2, 4, 5]], motion[[1, 2, 4, 5]], atol=5e-4)
    assert ncc[0] > 0.9999


def test_factor_of_a_singular_hessian_is_zero():
    gradient = np.random.default_rng(1).normal(size=(7, 7)).astype(np.float32)
    matrix = affine_dic.hessian(gradient, 2 * gradient)
    affine_dic.cholesky(matrix)
    assert (matrix == 0).all()


@pytest.mark.parametrize("shift", [0.25, 0.5, 9.4])
def test_bias_of_rigid_shifts_of_speckle_is_below_a_hundredth_of_a_pixel(shifted, inner, shift):
    frames = np.stack([shifted(SIZE, 0, 0), shifted(SIZE, shift, -shift)])
    error = tracked(frames, inner)[0][1] - [shift, -shift]
    assert np.abs(error.mean(0)).max() < 0.01
    assert error.std() < 0.02


def test_alignment_that_strays_leaves_the_initial_estimate(inner):
    start = np.zeros((len(inner), 6))
    start[:, 0], start[:, 3] = 0.7, -0.4
    found, ncc = aligned(texture(0), texture(1), inner, start)
    stayed = (found == start).all(1)
    assert stayed.any() and np.hypot(*(found - start)[:, [0, 3]].T).max() <= 3
    assert np.isfinite(ncc).all() and ncc[stayed].max() < 0.9


def test_bytes_do_not_depend_on_the_number_of_threads(clip, inner):
    frames = clip(lambda position, t: position * (1 + 0.01 * t) + [t, -t], 3)
    results, before = [], numba.get_num_threads()
    for threads in {1, numba.config.NUMBA_NUM_THREADS}:
        numba.set_num_threads(threads)
        results.append(b"".join(array.tobytes() for array in tracked(frames, inner)))
    numba.set_num_threads(before)
    assert len(set(results)) == 1


def test_subset_has_seventeen_pixels_at_least(clip, inner):
    frames = clip(lambda position, t: position + [t, -t], 2)
    np.testing.assert_array_equal(*(tracked(frames, inner, subset_mm=mm)[0] for mm in (0.01, 0.48)))
