import numba
import numpy as np
import pytest
from scipy import ndimage

from echotruth.config.tracking import AffineDic
from echotruth.imaging import spline
from echotruth.tracking import subset, track

SPACING = 3e-5
SIZE = 160


def texture(random=0):
    """A smooth image that a cubic spline holds exactly, as its coefficients with their margin."""
    noise = np.random.default_rng(random).normal(size=(SIZE, SIZE))
    return spline.coefficients(ndimage.gaussian_filter(noise, 2.5, mode="mirror").astype(np.float32))


def answer(frames, points, **settings):
    mask = np.ones(frames.shape[1:], bool)
    return track(frames, points, mask, SPACING, np.arange(len(frames)) * 3e-3, 0, AffineDic(**settings))


@pytest.fixture
def inner():
    lateral, axial = np.meshgrid(np.arange(45.0, 116, 9.3), np.arange(45.0, 116, 9.3))
    return np.stack([lateral, axial], -1).reshape(-1, 2)


def aligned(first, second, points, start, half=12, faintest=1e-3):
    motion, alike = np.array(start, float), np.zeros(len(points))
    subset.align(first, second, points, half, faintest, motion, alike)
    return motion, alike


def test_affine_motion_is_found_to_the_thousandth_of_a_pixel(inner):
    """The second image is the first as a spline of its own at the places from which tissue came."""
    first = texture()
    motion = np.array([1.7, 0.03, -0.02, -0.8, 0.015, -0.04])
    matrix = np.array([[1.03, -0.02], [0.015, 0.96]])
    middle = inner[20]
    row, column = np.indices((SIZE, SIZE), float)
    to = np.stack([column, row], -1) - middle
    came = (to - motion[[0, 3]]) @ np.linalg.inv(matrix).T + middle
    values = ndimage.map_coordinates(first[1:-2, 1:-2], [came[..., 1], came[..., 0]], order=3, prefilter=False)
    second = spline.coefficients(values.astype(np.float32))
    found, alike = aligned(first, second, middle[None], np.zeros((1, 6)))
    np.testing.assert_allclose(found[0, [0, 3]], motion[[0, 3]], atol=2e-3)
    np.testing.assert_allclose(found[0, [1, 2, 4, 5]], motion[[1, 2, 4, 5]], atol=5e-4)
    assert alike[0] > 0.9999


def test_slopes_of_a_template_are_those_of_its_spline():
    padded, half, e = texture(), 3, 1e-3
    values, *slopes = np.empty((3, 7, 7), np.float32)
    norm = subset.template(padded, np.array([40.3, 51.7]), half, values, *slopes)
    for axis in (0, 1):
        there = []
        for sign in (-1, 1):
            place = np.array([40.3, 51.7])
            place[axis] += sign * e
            offset = np.arange(-half, half + 1)
            there.append(
                ndimage.map_coordinates(
                    padded.astype(float),
                    np.meshgrid(place[1] + 1 + offset, place[0] + 1 + offset, indexing="ij"),
                    order=3,
                    prefilter=False,
                )
            )
        np.testing.assert_allclose(slopes[axis], (there[1] - there[0]) / 2 / e, atol=1e-6)
        middle = np.mean(there, axis=0)
    assert norm == pytest.approx(np.linalg.norm(middle - middle.mean()), rel=1e-4)
    np.testing.assert_allclose(values, middle - middle.mean(), atol=1e-6)


def test_factor_and_solution_are_those_of_the_normal_equations():
    random = np.random.default_rng(1)
    slopes, values = random.normal(size=(2, 7, 7)).astype(np.float32), random.normal(size=(7, 7)).astype(np.float32)
    rows = rows_of(*slopes.astype(float))
    matrix, right = subset.hessian(*slopes), subset.force(*slopes, values)
    np.testing.assert_allclose(matrix, rows.T @ rows, atol=1e-10)
    np.testing.assert_allclose(right, rows.T @ values.ravel().astype(float), atol=1e-10)
    lower, solution = matrix.copy(), right.copy()
    subset.factor(lower)
    subset.solve(lower, solution)
    np.testing.assert_allclose(np.tril(lower), np.linalg.cholesky(matrix), atol=1e-12)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), atol=1e-12)


def rows_of(along, deep):
    """Change of each pixel of a subset (side, side) with the six numbers of its motion, by its slopes."""
    offset = np.arange(len(along)) - len(along) // 2
    dx, dy = np.meshgrid(offset, offset)
    return np.stack([slope * factor for slope in (along, deep) for factor in (1, dx, dy)], -1).reshape(-1, 6)


def test_singular_hessian_is_told():
    along = np.random.default_rng(1).normal(size=(7, 7)).astype(np.float32)
    matrix = subset.hessian(along, 2 * along)
    subset.factor(matrix)
    assert (matrix == 0).all()


def matrix_of(motion):
    u, ux, uy, v, vx, vy = motion
    return np.array([[1 + ux, uy, u], [vx, 1 + vy, v], [0, 0, 1]])


def test_step_of_the_template_is_undone_before_the_motion():
    motion = np.array([1.0, 0.1, -0.2, 2.0, 0.05, -0.1])
    step = np.array([0.3, -0.05, 0.02, -0.4, 0.03, 0.07])
    expected = matrix_of(motion) @ np.linalg.inv(matrix_of(step))
    assert subset.undo(motion, step)
    np.testing.assert_allclose(matrix_of(motion), expected, atol=1e-12)


@pytest.mark.parametrize("shift", [0.1, 0.25, 0.5, 0.75, 2.3, 9.4])
def test_bias_of_rigid_shifts_of_speckle_is_below_a_hundredth_of_a_pixel(shifted, inner, shift):
    frames = np.stack([shifted(SIZE, 0, 0), shifted(SIZE, shift, -shift)])
    error = answer(frames, inner)[0][1] - [shift, -shift]
    assert np.abs(error.mean(0)).max() < 0.01
    assert error.std() < 0.02


def test_where_the_alignment_strays_the_start_stands(inner):
    start = np.zeros((len(inner), 6))
    start[:, 0], start[:, 3] = 0.7, -0.4
    found, alike = aligned(texture(0), texture(1), inner, start)
    stayed = (found == start).all(1)
    assert stayed.any() and np.hypot(*(found - start)[:, [0, 3]].T).max() <= 3
    assert np.isfinite(alike).all() and alike[stayed].max() < 0.9


def test_bytes_do_not_depend_on_the_number_of_threads(clip, inner):
    frames = clip(lambda place, t: place * (1 + 0.01 * t) + [t, -t], 3)
    answers, before = [], numba.get_num_threads()
    for threads in {1, numba.config.NUMBA_NUM_THREADS}:
        numba.set_num_threads(threads)
        answers.append(b"".join(each.tobytes() for each in answer(frames, inner)))
    numba.set_num_threads(before)
    assert len(set(answers)) == 1


def test_subset_has_seventeen_pixels_at_least(clip, inner):
    frames = clip(lambda place, t: place + [t, -t], 2)
    np.testing.assert_array_equal(*(answer(frames, inner, subset_mm=mm)[0] for mm in (0.01, 0.48)))
