"""Affine alignment of square subsets of two images by inverse compositional Gauss-Newton.

Sought is the affine motion that makes the zero-normalised sum of squared differences smallest, sum ((f - mean f) / |f -
mean f| - (g - mean g) / |g - mean g|)^2, where f is a subset of the first image and g what the second has at the places
it moves to (Pan, Li and Tong 2013, Exp Mech 53:1277; Baker and Matthews 2004, Int J Comput Vis 56:221). Slopes and
Hessian are those of f, once and for all. One thread makes a point, so the bytes do not depend on the number of threads.

A motion is (u, u_x, u_y, v, v_x, v_y): what is dx, dy from the middle comes to dx + u + u_x dx + u_y dy, dy + v +
v_x dx + v_y dy from it.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.tracking.cubic import shares, slopes

STEPS = 30
"""Most iterations."""
STILL = 1e-3
"""Largest motion of a corner of the subset in the last iteration, px (Pan, Li and Tong 2013)."""
STRAY = 0.25
"""Distance from its start at which a motion is given up, over half the side of a subset."""


@numba.njit(cache=True)
def cell(place, size):
    """First of the four coefficients at a place (px) and the fraction between the middle two; inside the image."""
    place = min(max(place, 0.0), size - 4.0)
    first = min(int(place), size - 5)
    return first, place - first


@numba.njit(cache=True)
def blend(padded, i, j, down, across):
    """Sum of 4 x 4 coefficients from (i, j) on by their shares."""
    total = 0.0
    for a in range(4):
        line = padded[i + a]
        part = across[0] * line[j] + across[1] * line[j + 1] + across[2] * line[j + 2] + across[3] * line[j + 3]
        total += down[a] * part
    return total


@numba.njit(cache=True)
def centre(values):
    """Take the mean from values and divide them by the root of the sum of their squares, which is returned."""
    mean = 0.0
    for value in values:
        mean += value
    values -= mean / len(values)
    norm = 0.0
    for value in values:
        norm += value * value
    norm = np.sqrt(norm)
    values /= norm or 1.0
    return norm


@numba.njit(cache=True)
def template(padded, x, y, half, values, rows):
    """Centred values of a subset about a place and the slopes of each by the motion, (pixels, 6); their norm."""
    k = 0
    for dy in range(-half, half + 1):
        for dx in range(-half, half + 1):
            j, u = cell(x + dx, padded.shape[1])
            i, v = cell(y + dy, padded.shape[0])
            across, down = shares(u), shares(v)
            values[k] = blend(padded, i, j, down, across)
            along, deep = blend(padded, i, j, down, slopes(u)), blend(padded, i, j, slopes(v), across)
            rows[k, 0], rows[k, 1], rows[k, 2] = along, along * dx, along * dy
            rows[k, 3], rows[k, 4], rows[k, 5] = deep, deep * dx, deep * dy
            k += 1
    return centre(values)


@numba.njit(cache=True)
def carried(padded, x, y, half, motion, values):
    """Centred values of a subset after a motion; their norm."""
    k = 0
    for dy in range(-half, half + 1):
        for dx in range(-half, half + 1):
            j, u = cell(x + dx + motion[0] + motion[1] * dx + motion[2] * dy, padded.shape[1])
            i, v = cell(y + dy + motion[3] + motion[4] * dx + motion[5] * dy, padded.shape[0])
            values[k] = blend(padded, i, j, shares(v), shares(u))
            k += 1
    return centre(values)


@numba.njit(cache=True)
def factor(rows):
    """Lower Cholesky factor of the Hessian of rows (pixels, 6); 0 on its diagonal where that is singular."""
    lower = np.zeros((6, 6))
    for row in rows:
        for i in range(6):
            for j in range(i + 1):
                lower[i, j] += row[i] * row[j]
    floor = 1e-9 * max(lower[0, 0], lower[3, 3])
    for j in range(6):
        for k in range(j):
            for i in range(j, 6):
                lower[i, j] -= lower[i, k] * lower[j, k]
        if lower[j, j] <= floor:
            lower[:] = 0
            return lower
        lower[j:, j] /= np.sqrt(lower[j, j])
    return lower


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def undo(motion, step):
    """Put the inverse of a step of the template before a motion, in place; False where it has none."""
    a, b, c, d = 1 + step[1], step[2], step[4], 1 + step[5]
    whole = a * d - b * c
    if not whole > 0:
        return False
    back = (d / whole, -b / whole, -c / whole, a / whole)
    to_x, to_y = -(back[0] * step[0] + back[1] * step[3]), -(back[2] * step[0] + back[3] * step[3])
    for k, (unit_x, unit_y) in enumerate(((1.0, 0.0), (0.0, 1.0))):
        p, q = unit_x + motion[3 * k + 1], unit_y + motion[3 * k + 2]
        motion[3 * k] += p * to_x + q * to_y
        motion[3 * k + 1] = p * back[0] + q * back[2] - unit_x
        motion[3 * k + 2] = p * back[1] + q * back[3] - unit_y
    return True


@numba.njit(cache=True)
def reach(step, half):
    """Largest motion of a corner of a subset, px: no less than it."""
    return abs(step[0]) + abs(step[3]) + half * (abs(step[1]) + abs(step[2]) + abs(step[4]) + abs(step[5]))


@numba.njit(cache=True)
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
        Of the template: centred values (pixels,), norm, slopes (pixels, 6), factor of the Hessian (6, 6).
    motion
        Start, and then the result.
    """
    values, norm, rows, lower = known
    other = np.empty_like(values)
    start_x, start_y = motion[0], motion[3]
    for _ in range(STEPS):
        if carried(padded, place[0], place[1], half, motion, other) == 0:
            return False
        step = np.zeros(6)
        for k in range(len(values)):
            residual = norm * (other[k] - values[k])
            for i in range(6):
                step[i] += rows[k, i] * residual
        solve(lower, step)
        if not undo(motion, step):
            return False
        if np.hypot(motion[0] - start_x, motion[3] - start_y) > STRAY * half:
            return False
        if reach(step, half) < STILL:
            break
    return True


@numba.njit(parallel=True, cache=True)
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
    for point in numba.prange(len(points)):
        x, y = points[point]
        values, other, rows = np.empty(side * side), np.empty(side * side), np.empty((side * side, 6))
        norm = template(first, x, y, half, values, rows)
        lower = factor(rows)
        start = motion[point].copy()
        if lower[0, 0] > 0 and not iterate(second, points[point], half, (values, norm, rows, lower), motion[point]):
            motion[point] = start
        faint = min(norm, carried(second, x, y, half, motion[point], other)) <= faintest * side
        total = np.nan if faint else 0.0
        for k in range(len(values)):
            total += values[k] * other[k]
        alike[point] = total
