"""Affine alignment of square subsets of two images by inverse compositional Gauss-Newton.

Sought is the affine motion that makes the zero-normalised sum of squared differences smallest, sum ((f - mean f) / |f -
mean f| - (g - mean g) / |g - mean g|)^2, where f is a subset of the first image and g what the second has at the places
it moves to (Pan, Li and Tong 2013, Exp Mech 53:1277; Baker and Matthews 2004, Int J Comput Vis 56:221). Slopes and
Hessian are those of f, once and for all.

A motion is (u, u_x, u_y, v, v_x, v_y): what is dx, dy from the middle comes to dx + u + u_x dx + u_y dy, dy + v +
v_x dx + v_y dy from it. Grey values and slopes of a subset are images (side, side) in single precision. Sums over them
are gathered column by column, so that the processor adds several at once, though always in the same order.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.imaging import spline
from echotruth.tracking.cubic import shares, slopes

STEPS = 30
"""Most iterations."""
STILL = 1e-3
"""Largest motion of a corner of the subset in the last iteration, px (Pan, Li and Tong 2013)."""
STRAY = 0.25
"""Distance from its start at which a motion is given up, over half the side of a subset."""
ZERO, ONE, TWO, THREE = np.float32(0), np.uintp(1), np.uintp(2), np.uintp(3)


@numba.njit(cache=True, nogil=True)
def cells(start, half, size):
    """First of the four coefficients at every pixel of a subset along an axis, and the shares and slopes of these.

    Beyond the image its border is taken.
    """
    side = 2 * half + 1
    first, value, slope = np.empty(side, np.int64), np.empty((side, 4)), np.empty((side, 4))
    for k in range(side):
        place = min(max(start + k - half, 0.0), size - 4.0)
        first[k] = min(int(place), size - 5)
        values, steep = shares(place - first[k]), slopes(place - first[k])
        for a in range(4):
            value[k, a], slope[k, a] = values[a], steep[a]
    return first, value, slope


@numba.njit(cache=True, nogil=True)
def template(padded, place, half, values, along, deep):
    """Write the centred values of a subset about a place and their slopes per px, lateral and axial; their norm."""
    column, across, right = cells(place[0], half, padded.shape[1])
    row, down, below = cells(place[1], half, padded.shape[0])
    width = column[-1] + 4 - column[0]
    middle, slope = np.empty(width), np.empty(width)
    for i in range(len(row)):
        for j in range(width):
            middle[j], slope[j] = 0.0, 0.0
        for a in range(4):
            share, steep, line = down[i, a], below[i, a], padded[row[i] + a, column[0] :]
            for j in range(width):
                middle[j] += share * line[j]
                slope[j] += steep * line[j]
        for k in range(len(column)):
            value, lateral, axial = 0.0, 0.0, 0.0
            for b in range(4):
                j = column[k] - column[0] + b
                value += across[k, b] * middle[j]
                lateral += right[k, b] * middle[j]
                axial += across[k, b] * slope[j]
            values[i, k], along[i, k], deep[i, k] = value, lateral, axial
    return centre(values)


@numba.njit(cache=True, nogil=True)
def carried(padded, place, half, motion, values):
    """Write the centred values of a subset after a motion; their norm."""
    side, columns = 2 * half + 1, np.int32(padded.shape[1])
    right, bottom = np.float32(padded.shape[1] - 4.001), np.float32(padded.shape[0] - 4.001)
    grey, below = padded.reshape(-1), np.uintp(columns)
    along, across = np.float32(1 + motion[1]), np.float32(motion[4])
    first, lateral, axial = np.empty(side, np.int32), np.empty(side, np.float32), np.empty(side, np.float32)
    for row in range(side):
        dy = row - half
        x = np.float32(place[0] + motion[0] + motion[2] * dy)
        y = np.float32(place[1] + motion[3] + motion[5] * dy + dy)
        for k in range(side):
            dx = np.float32(k - half)
            u, v = min(max(x + along * dx, ZERO), right), min(max(y + across * dx, ZERO), bottom)
            j, i = np.int32(u), np.int32(v)
            first[k], lateral[k], axial[k] = i * columns + j, u - np.float32(j), v - np.float32(i)
        # Numbers without a sign, for of others the compiler would ask whether they count from the end.
        for k in range(side):
            a = np.uintp(first[k])
            b, c, d = a + below, a + below + below, a + below + below + below
            p, q, r, s = spline.shares(axial[k])
            e, f, g, h = spline.shares(lateral[k])
            values[row, k] = (
                e * (p * grey[a] + q * grey[b] + r * grey[c] + s * grey[d])
                + f * (p * grey[a + ONE] + q * grey[b + ONE] + r * grey[c + ONE] + s * grey[d + ONE])
                + g * (p * grey[a + TWO] + q * grey[b + TWO] + r * grey[c + TWO] + s * grey[d + TWO])
                + h * (p * grey[a + THREE] + q * grey[b + THREE] + r * grey[c + THREE] + s * grey[d + THREE])
            )
    return centre(values)


@numba.njit(cache=True, nogil=True)
def centre(values):
    """Take the mean from values; the root of the sum of their squares."""
    columns = np.zeros(values.shape[1])
    for row in values:
        for k in range(len(columns)):
            columns[k] += row[k]
    mean, square = 0.0, 0.0
    for k in range(len(columns)):
        mean += columns[k] / values.size
        columns[k] = 0
    for row in values:
        for k in range(len(columns)):
            row[k] -= np.float32(mean)
            columns[k] += row[k] * row[k]
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
def hessian(along, deep):
    """Sums of the products of all pairs of slopes by the motion (6, 6), of a subset with these slopes per px."""
    result = np.empty((6, 6))
    xx, xy, yy = moments(along, along), moments(along, deep), moments(deep, deep)
    for i in range(3):
        for j in range(3):
            k = i + j + (i > 0 and j > 0)
            result[i, j], result[i + 3, j + 3] = xx[k], yy[k]
            result[i, j + 3], result[i + 3, j] = xy[k], xy[k]
    return result


@numba.njit(cache=True, nogil=True)
def force(along, deep, values):
    """Sums of the products of values and their slopes by the motion, (6,)."""
    result = np.empty(6)
    lateral, axial = moments(along, values), moments(deep, values)
    for i in range(3):
        result[i], result[i + 3] = lateral[i], axial[i]
    return result


@numba.njit(cache=True, nogil=True)
def factor(lower):
    """Make a Hessian its lower Cholesky factor, in place; all 0 where it is singular."""
    floor = 1e-9 * max(lower[0, 0], lower[3, 3])
    for j in range(6):
        for k in range(j):
            for i in range(j, 6):
                lower[i, j] -= lower[i, k] * lower[j, k]
        if lower[j, j] <= floor:
            lower[:] = 0
            return
        pivot = np.sqrt(lower[j, j])
        for i in range(j, 6):
            lower[i, j] /= pivot


@numba.njit(cache=True, nogil=True)
def solve(lower, right):
    """Solve with a lower Cholesky factor, in place of the right side."""
    for i in range(6):
        for j in range(i):
            right[i] -= lower[i, j] * right[j]
        right[i] /= lower[i, i]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            right[i] -= lower[j, i] * right[j]
        right[i] /= lower[i, i]


@numba.njit(cache=True, nogil=True)
def undo(motion, step):
    """Put the inverse of a step of the template before a motion, in place; False where it has none."""
    a, b, c, d = 1 + step[1], step[2], step[4], 1 + step[5]
    whole = a * d - b * c
    if not whole > 0:
        return False
    back = (d / whole, -b / whole, -c / whole, a / whole)
    to_x, to_y = -(back[0] * step[0] + back[1] * step[3]), -(back[2] * step[0] + back[3] * step[3])
    for k in range(2):
        p, q = motion[3 * k + 1] + (k == 0), motion[3 * k + 2] + (k == 1)
        motion[3 * k] += p * to_x + q * to_y
        motion[3 * k + 1] = p * back[0] + q * back[2] - (k == 0)
        motion[3 * k + 2] = p * back[1] + q * back[3] - (k == 1)
    return True


@numba.njit(cache=True, nogil=True)
def reach(step, half):
    """Largest motion of a corner of a subset, px: no less than it."""
    return abs(step[0]) + abs(step[3]) + half * (abs(step[1]) + abs(step[2]) + abs(step[4]) + abs(step[5]))


@numba.njit(cache=True, nogil=True)
def iterate(padded, place, half, known, motion):
    """Refine one motion in place; False if it is lost.

    Parameters
    ----------
    padded
        Coefficients of the second image.
    place
        Middle of the subset: x, y, px.
    half
        A subset has 2 half + 1 pixels a side.
    known
        Of the template: centred values and lateral and axial slopes, each (side, side), norm, and factor of the
        Hessian (6, 6).
    motion
        Start, and then the result.
    """
    values, along, deep, norm, lower = known
    other, still = np.empty_like(values), force(along, deep, values)
    start_x, start_y = motion[0], motion[3]
    for _ in range(STEPS):
        size = carried(padded, place, half, motion, other)
        if size == 0:
            return False
        step = force(along, deep, other)
        for i in range(6):
            step[i] = norm / size * step[i] - still[i]
        solve(lower, step)
        if not undo(motion, step):
            return False
        if np.hypot(motion[0] - start_x, motion[3] - start_y) > STRAY * half:
            return False
        if reach(step, half) < STILL:
            break
    return True


@numba.njit(cache=True, nogil=True)
def align(first, second, points, half, faintest, motion, alike):
    """Refine motions of subsets; where that leads astray, the start stands.

    Parameters
    ----------
    first, second
        Spline coefficients of the images with their margin, as of :func:`echotruth.imaging.spline.coefficients`.
    points
        Middles of the subsets: x, y, px, shape (n, 2).
    half
        A subset has 2 half + 1 pixels a side.
    faintest
        Standard deviation below which a subset has no texture.
    motion
        Start, and then the result, shape (n, 6), float64.
    alike
        Written: zero-normalised correlation after the motion, shape (n,); NaN where a subset has no texture.
    """
    side = 2 * half + 1
    values, other = np.empty((side, side), np.float32), np.empty((side, side), np.float32)
    along, deep = np.empty((side, side), np.float32), np.empty((side, side), np.float32)
    for point in range(len(points)):
        place = points[point]
        norm = template(first, place, half, values, along, deep)
        lower = hessian(along, deep)
        factor(lower)
        refined = motion[point].copy()
        if lower[0, 0] > 0 and iterate(second, place, half, (values, along, deep, norm, lower), refined):
            for i in range(6):
                motion[point, i] = refined[i]
        size = carried(second, place, half, motion[point], other)
        if min(norm, size) > faintest * side:
            alike[point] = moments(values, other)[0] / (norm * size)
        else:
            alike[point] = np.nan
