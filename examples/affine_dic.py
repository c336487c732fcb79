"""Affine correlation of a square subset about every point, both ways around the cycle, as a tracker of one's own.

    echotruth evaluate out/demo --tracker examples.affine_dic:track

The benchmark has it. It builds on parts of echotruth: window deformation gives the first estimate, since on clips of a
heart it was more accurate than a dense inverse search where speckle decorrelates most, and `follow` takes the points
around the cycle. Where an alignment strays too far from that estimate, the estimate is kept.

A subset is aligned by inverse compositional Gauss-Newton (IC-GN). The warp minimises the zero-normalised sum of squared
differences, sum ((f - mean f) / |f - mean f| - (g - mean g) / |g - mean g|)^2, where f is a subset of the first image
and g the second image at the warped positions (Pan, Li and Tong 2013, Exp Mech 53:1277; Baker and Matthews 2004, Int J
Comput Vis 56:221). The Hessian is that of f, computed once.

A warp is (u, u_x, u_y, v, v_x, v_y): the offset dx, dy from the centre becomes dx + u + u_x dx + u_y dy, dy + v +
v_x dx + v_y dy. Grey values and gradients of a subset are images (side, side) in single precision. Sums over them are
gathered column by column, so that the processor adds several at once, though always in the same order.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy import ndimage

from echotruth.config.tracking import WindowDeformation
from echotruth.imaging import spline
from echotruth.tracking.accumulation import follow
from echotruth.tracking.alignment import sum_axially
from echotruth.tracking.cubic import bspline_weights, first_derivatives
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import MIN_STD, grey_levels
from echotruth.tracking.quality import ErrorModel
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.trackers.window_deformation import PreparedImage, WindowDeformationTracker, window_passes

MIN_HALF = 8
"""Smallest half side of a subset, px: six unknowns need more texture than two."""
BLUR = 0.8
"""Standard deviation of a Gaussian on the images, px: it removes what a spline cannot represent, and with it most of
the bias between pixels (Pan 2013, Opt Lasers Eng 51:1161)."""
SPREAD = 5
"""Pixels over which blur and spline spread a pixel without a value."""
INITIAL_WINDOWS = (1.5, 0.75)
"""Windows of the initial estimate, over the side of a subset."""
ERROR = ErrorModel(1.19, 0.572, 0.22, 0.26, 0.0484)
"""Distribution of the error, of which docs/tracking.md tells how it was fitted."""
MAX_ITERATIONS = 30
CONVERGENCE = 1e-2
"""Size of the last iteration's step, see :func:`step_size`, px. Steps shrink severalfold from one to the next, so that
what is left is far below the error of speckle; Pan, Li and Tong 2013 take 1e-3, for surfaces that do not change."""
MAX_DEPARTURE = 0.25
"""Distance from the initial estimate, over half the side of a subset, at which an alignment is rejected."""
ZERO, ONE, TWO, THREE = np.float32(0), np.uintp(1), np.uintp(2), np.uintp(3)


def track(frames, points, mask, spacing, frame_time, seed, subset_mm=1.0, reference="bidirectional"):
    """Displacement of points (frame, n, 2) in px since the first frame, and its quality; see docs/trackers.md.

    ValueError if an image has no room for the windows of the first estimate.
    """
    half = max(MIN_HALF, round(1e-3 * subset_mm / spacing / 2))
    windows = WindowDeformation(windows_mm=[ratio * 2e3 * half * spacing for ratio in INITIAL_WINDOWS], final_passes=1)
    initial = WindowDeformationTracker(window_passes(windows, mask.shape, spacing))
    path = follow(AffineTracker(half, initial), grey_levels(frames), points, reference)
    return path.displacement, ERROR.probability(path, speckle_length(frames[0], mask), mask.shape)


@dataclass(frozen=True)
class AffineTracker:
    """Affine correlation of two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    half : int
        A subset has 2 half + 1 pixels a side.
    initial : WindowDeformationTracker
        Tracker that gives the initial estimate.
    """

    half: int
    initial: WindowDeformationTracker

    def prepare(self, image: np.ndarray) -> tuple[PreparedImage, np.ndarray, np.ndarray]:
        """Image for the initial estimate, spline of the blurred image, and centres of subsets with unknown pixels."""
        unknown = np.isnan(image)
        blurred = ndimage.gaussian_filter(np.where(unknown, np.float32(0), image), BLUR)
        affected = ndimage.maximum_filter(unknown, 2 * (self.half + SPREAD) + 1)
        return self.initial.prepare(image), spline.coefficients(blurred), affected

    def match(self, first: tuple, second: tuple, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        step, ncc = np.full((len(points), 2), np.nan), np.full(len(points), np.nan)
        initial = self.initial.field(first[0], second[0])[0].at(points)
        inside = np.isfinite(initial).all(1)
        warps, inside_ncc = np.zeros((inside.sum(), 6)), ncc[inside]
        warps[:, [0, 3]] = initial[inside]
        align(first[1], second[1], points[inside], self.half, MIN_STD, warps, inside_ncc)
        step[inside], ncc[inside] = warps[:, [0, 3]], inside_ncc
        for affected, position in ((first[2], points), (second[2], points + step)):
            ncc[interpolate_field(affected[..., None].astype(float), position)[:, 0] != 0] = np.nan
        step[np.isnan(ncc)] = np.nan
        return step, np.maximum(ncc, 0)


@numba.njit(cache=True, nogil=True)
def axis_weights(centre, half, size):
    """First of the four coefficients at each pixel of a subset along an axis, their weights, and derivatives of these.

    Outside the image its border is taken.
    """
    side = 2 * half + 1
    first, weight, derivative = np.empty(side, np.int64), np.empty((side, 4)), np.empty((side, 4))
    for k in range(side):
        position = min(max(centre + k - half, 0.0), size - 4.0)
        first[k] = min(int(position), size - 5)
        values, slopes = bspline_weights(position - first[k]), first_derivatives(position - first[k])
        for a in range(4):
            weight[k, a], derivative[k, a] = values[a], slopes[a]
    return first, weight, derivative


@numba.njit(cache=True, nogil=True)
def template(padded, centre, half, values, gradient_x, gradient_y):
    """Write the zero-mean values f - mean f of a subset and the gradient of f per px; return |f - mean f|."""
    column, weight_x, derivative_x = axis_weights(centre[0], half, padded.shape[1])
    row, weight_y, derivative_y = axis_weights(centre[1], half, padded.shape[0])
    width = column[-1] + 4 - column[0]
    value_row, slope_row = np.empty(width), np.empty(width)
    for i in range(len(row)):
        for j in range(width):
            value_row[j], slope_row[j] = 0.0, 0.0
        for a in range(4):
            weight, derivative, line = weight_y[i, a], derivative_y[i, a], padded[row[i] + a, column[0] :]
            for j in range(width):
                value_row[j] += weight * line[j]
                slope_row[j] += derivative * line[j]
        for k in range(len(column)):
            value, lateral, axial = 0.0, 0.0, 0.0
            for b in range(4):
                j = column[k] - column[0] + b
                value += weight_x[k, b] * value_row[j]
                lateral += derivative_x[k, b] * value_row[j]
                axial += weight_x[k, b] * slope_row[j]
            values[i, k], gradient_x[i, k], gradient_y[i, k] = value, lateral, axial
    return subtract_mean(values)


@numba.njit(cache=True, nogil=True)
def warped_subset(padded, centre, half, warp, values):
    """Write the zero-mean values g - mean g at the warped positions of a subset; return |g - mean g|."""
    side, columns = 2 * half + 1, np.int32(padded.shape[1])
    right, bottom = np.float32(padded.shape[1] - 4.001), np.float32(padded.shape[0] - 4.001)
    step_x, step_y = np.float32(1 + warp[1]), np.float32(warp[4])
    first, lateral, axial = np.empty(side, np.int32), np.empty(side, np.float32), np.empty((4, side), np.float32)
    sums = np.empty(4 * side, np.float32)
    for row in range(side):
        dy = row - half
        x = np.float32(centre[0] + warp[0] + warp[2] * dy)
        y = np.float32(centre[1] + warp[3] + warp[5] * dy + dy)
        for k in range(side):
            dx = np.float32(k - half)
            u, v = min(max(x + step_x * dx, ZERO), right), min(max(y + step_y * dx, ZERO), bottom)
            j, i = np.int32(u), np.int32(v)
            first[k], lateral[k] = i * columns + j, u - np.float32(j)
            axial[0, k], axial[1, k], axial[2, k], axial[3, k] = spline.bspline_weights(v - np.float32(i))
        sum_axially(padded.reshape(-1), np.uintp(columns), first, axial, sums)
        for k in range(side):
            a = np.uintp(4) * np.uintp(k)
            e, f, g, h = spline.bspline_weights(lateral[k])
            values[row, k] = e * sums[a] + f * sums[a + ONE] + g * sums[a + TWO] + h * sums[a + THREE]
    return subtract_mean(values)


@numba.njit(cache=True, nogil=True)
def subtract_mean(values):
    """Subtract the mean from values, in place; return the root of the sum of their squares."""
    columns = np.zeros(values.shape[1])
    for row in range(len(values)):
        for k in range(len(columns)):
            columns[k] += values[row, k]
    mean, square = 0.0, 0.0
    for k in range(len(columns)):
        mean += columns[k] / values.size
        columns[k] = 0
    for row in range(len(values)):
        for k in range(len(columns)):
            values[row, k] -= np.float32(mean)
            columns[k] += values[row, k] * values[row, k]
    for k in range(len(columns)):
        square += columns[k]
    return np.sqrt(square)


@numba.njit(cache=True, nogil=True)
def moments(first, second):
    """Sums over a subset of the product p of two images: p, p dx, p dy, p dx dx, p dx dy, p dy dy."""
    half, side = len(first) // 2, len(first)
    columns = np.zeros((3, side))
    for row in range(side):
        dy = row - half
        for k in range(side):
            product = np.float64(first[row, k]) * second[row, k]
            columns[0, k] += product
            columns[1, k] += dy * product
            columns[2, k] += dy * dy * product
    sums = np.zeros(6)
    for k in range(side):
        dx = k - half
        sums[0] += columns[0, k]
        sums[1] += dx * columns[0, k]
        sums[2] += columns[1, k]
        sums[3] += dx * dx * columns[0, k]
        sums[4] += dx * columns[1, k]
        sums[5] += columns[2, k]
    return sums


@numba.njit(cache=True, nogil=True)
def hessian(gradient_x, gradient_y):
    """Gauss-Newton Hessian sum (df/dp)^T (df/dp) (6, 6), where df/dp is the derivative of f by the warp."""
    result = np.empty((6, 6))
    xx, xy = moments(gradient_x, gradient_x), moments(gradient_x, gradient_y)
    yy = moments(gradient_y, gradient_y)
    for i in range(3):
        for j in range(3):
            k = i + j + (i > 0 and j > 0)
            result[i, j], result[i + 3, j + 3] = xx[k], yy[k]
            result[i, j + 3], result[i + 3, j] = xy[k], xy[k]
    return result


@numba.njit(cache=True, nogil=True)
def project(gradient_x, gradient_y, values):
    """sum (df/dp)^T values, (6,)."""
    half, side = len(values) // 2, len(values)
    columns, result = np.zeros((4, side)), np.zeros(6)
    for row in range(side):
        dy = row - half
        for k in range(side):
            value = np.float64(values[row, k])
            lateral, axial = gradient_x[row, k] * value, gradient_y[row, k] * value
            columns[0, k] += lateral
            columns[1, k] += dy * lateral
            columns[2, k] += axial
            columns[3, k] += dy * axial
    for k in range(side):
        dx = k - half
        for c in range(2):
            result[3 * c] += columns[2 * c, k]
            result[3 * c + 1] += dx * columns[2 * c, k]
            result[3 * c + 2] += columns[2 * c + 1, k]
    return result


@numba.njit(cache=True, nogil=True)
def cholesky(lower):
    """Replace a Hessian by its lower Cholesky factor; all 0 where it is singular."""
    floor = 1e-9 * max(lower[0, 0], lower[3, 3])
    for j in range(6):
        for k in range(j):
            for i in range(j, 6):
                lower[i, j] -= lower[i, k] * lower[j, k]
        if lower[j, j] <= floor:
            lower.fill(0)
            return
        pivot = np.sqrt(lower[j, j])
        for i in range(j, 6):
            lower[i, j] /= pivot


@numba.njit(cache=True, nogil=True)
def solve_cholesky(lower, rhs):
    """Solve with a lower Cholesky factor, in place of the right-hand side."""
    for i in range(6):
        for j in range(i):
            rhs[i] -= lower[i, j] * rhs[j]
        rhs[i] /= lower[i, i]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            rhs[i] -= lower[j, i] * rhs[j]
        rhs[i] /= lower[i, i]


@numba.njit(cache=True, nogil=True)
def compose_inverse(warp, step):
    """Replace a warp W by W o S^-1, with S the step; return False if S has no inverse."""
    a, b, c, d = 1 + step[1], step[2], step[4], 1 + step[5]
    det = a * d - b * c
    if not det > 0:
        return False
    inverse = (d / det, -b / det, -c / det, a / det)
    x, y = -(inverse[0] * step[0] + inverse[1] * step[3]), -(inverse[2] * step[0] + inverse[3] * step[3])
    for k in range(2):
        p, q = warp[3 * k + 1] + (k == 0), warp[3 * k + 2] + (k == 1)
        warp[3 * k] += p * x + q * y
        warp[3 * k + 1] = p * inverse[0] + q * inverse[2] - (k == 0)
        warp[3 * k + 2] = p * inverse[1] + q * inverse[3] - (k == 1)
    return True


@numba.njit(cache=True, nogil=True)
def step_size(step, half):
    """Norm of a warp whose gradients are multiplied by half a side, px (Pan, Li and Tong 2013)."""
    gradients = step[1] * step[1] + step[2] * step[2] + step[4] * step[4] + step[5] * step[5]
    return np.sqrt(step[0] * step[0] + step[3] * step[3] + half * half * gradients)


@numba.njit(cache=True, nogil=True)
def refine(padded, centre, half, template_terms, warp, warped):
    """Refine one warp in place.

    Parameters
    ----------
    padded
        Spline coefficients of the second image.
    centre
        Centre of the subset: x, y, px.
    half
        A subset has 2 half + 1 pixels a side.
    template_terms
        f - mean f, df/dx, df/dy, each (side, side), |f - mean f|, and the Cholesky factor of the Hessian (6, 6).
    warp
        Initial estimate, replaced by the result.
    warped
        Output: g - mean g (side, side) before the last step, which is too small to matter.

    Returns
    -------
    |g - mean g|; 0 if the alignment is rejected.
    """
    values, gradient_x, gradient_y, norm, lower = template_terms
    template_projection = project(gradient_x, gradient_y, values)
    start_x, start_y = warp[0], warp[3]
    warped_norm = 0.0
    for _ in range(MAX_ITERATIONS):
        warped_norm = warped_subset(padded, centre, half, warp, warped)
        if warped_norm == 0:
            return 0.0
        step = project(gradient_x, gradient_y, warped)
        for i in range(6):
            step[i] = norm / warped_norm * step[i] - template_projection[i]
        solve_cholesky(lower, step)
        if not compose_inverse(warp, step):
            return 0.0
        if np.hypot(warp[0] - start_x, warp[3] - start_y) > MAX_DEPARTURE * half:
            return 0.0
        if step_size(step, half) < CONVERGENCE:
            break
    return warped_norm


@numba.njit(cache=True, nogil=True)
def align(first, second, points, half, min_std, warps, ncc):
    """Refine the warps of subsets; a rejected alignment leaves the initial estimate.

    Parameters
    ----------
    first, second
        Spline coefficients of the images with their margin, see :func:`echotruth.imaging.spline.coefficients`.
    points
        Centres of the subsets: x, y, px, shape (n, 2).
    half
        A subset has 2 half + 1 pixels a side.
    min_std
        Standard deviation below which a subset has no texture.
    warps
        Initial estimates, replaced by the result, shape (n, 6), float64.
    ncc
        Output: zero-normalised cross-correlation at the warp, shape (n,); NaN where a subset has no texture.
    """
    side = 2 * half + 1
    values, warped = np.empty((side, side), np.float32), np.empty((side, side), np.float32)
    gradient_x, gradient_y = np.empty((side, side), np.float32), np.empty((side, side), np.float32)
    for point in range(len(points)):
        centre = points[point]
        norm = template(first, centre, half, values, gradient_x, gradient_y)
        lower = hessian(gradient_x, gradient_y)
        cholesky(lower)
        refined, warped_norm = warps[point].copy(), 0.0
        if lower[0, 0] > 0:
            template_terms = (values, gradient_x, gradient_y, norm, lower)
            warped_norm = refine(second, centre, half, template_terms, refined, warped)
        if warped_norm > 0:
            for i in range(6):
                warps[point, i] = refined[i]
        else:
            warped_norm = warped_subset(second, centre, half, warps[point], warped)
        if min(norm, warped_norm) > min_std * side:
            ncc[point] = moments(values, warped)[0] / (norm * warped_norm)
        else:
            ncc[point] = np.nan
