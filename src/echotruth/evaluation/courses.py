"""Strain, rotation and their rates over the cycle, and the peaks of such curves."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.evaluation import statistics
from echotruth.evaluation.contours import Contours
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.evaluation.strain import engineering
from echotruth.repository.rounding import CURVE


def strain_courses(green_lagrange: Floats, wall: WallPoints) -> dict[str, Floats]:
    """Mean strain of regions and segments, in both measures.

    The mean is that of the strain of the points, also of engineering strain, which is not linear in Green-Lagrange
    strain.

    Parameters
    ----------
    green_lagrange : ndarray of shape (..., point, 3)
        Radial, tangential, shear; NaN where unknown.
    wall : WallPoints

    Returns
    -------
    dict of ndarray
        region_strain (..., measure, region, 3) and segment_strain (..., measure, 17, 3), over the points that are
        known; measures are engineering (its shear is an angle, rad) and Green-Lagrange, region 0 is the whole wall, the
        others are its layers.
    """
    measures = np.stack([engineering(green_lagrange), green_lagrange], axis=-3)
    return {
        "region_strain": statistics.mean(measures, wall.regions),
        "segment_strain": statistics.mean(measures, wall.segments),
    }


def motion_courses(
    displacement: Floats, line_displacement: Floats, wall: WallPoints, contours: Contours
) -> dict[str, Floats]:
    """Line strain and rotation.

    Parameters
    ----------
    displacement : ndarray of shape (frame, point, 2), m
        Since end-diastole: lateral, axial; NaN where unknown.
    line_displacement : ndarray of shape (frame, piece, 2, 2), m
        That of the ends of the pieces of the contours.
    wall : WallPoints
    contours : Contours

    Returns
    -------
    dict of ndarray
        line_strain (frame, 3) of the endocardial, middle and epicardial contour; rotation (frame,), rad, NaN in a long
        axis.
    """
    turned = rotation(wall.position, displacement)
    return {
        "line_strain": contours.line_strain(line_displacement),
        "rotation": turned if wall.plane == "short_axis" else np.full_like(turned, np.nan),
    }


def rotation(position: Floats, displacement: Floats) -> Floats:
    """Least-squares rotation of the wall about its centroid since end-diastole.

    With a and b the positions relative to their centroids at end-diastole and in a frame, it is the angle
    atan2(sum(a x b), sum(a . b)).

    Parameters
    ----------
    position : ndarray of shape (point, 2), m
        Lateral, axial.
    displacement : ndarray of shape (frame, point, 2), m
        NaN where unknown; in each frame the known points count.

    Returns
    -------
    ndarray of shape (frame,), rad
        Counter-clockwise in the image, in which the axial axis points down, and so seen from the apex (a short-axis
        view is seen from there); continuous beyond half a turn, NaN where fewer than two points are known.
    """
    known = np.asarray(np.isfinite(displacement).all(-1), bool)
    ed = np.broadcast_to(position, displacement.shape)
    first, now = (_about_centroid(place, known) for place in (ed, ed + displacement))
    dot = np.sum(first * now, axis=(1, 2))
    cross = np.sum(first[..., 0] * now[..., 1] - first[..., 1] * now[..., 0], axis=1)
    enough = known.sum(axis=1) > 1
    angle = np.full(len(displacement), np.nan)
    angle[enough] = np.unwrap(-np.arctan2(cross[enough], dot[enough]))
    return angle


def _about_centroid(position: Floats, known: NDArray[np.bool_]) -> Floats:
    """Positions (frame, point, 2) relative to the centroid of the known points, 0 for the others."""
    weight = known[..., None].astype(float)
    total = np.sum(np.where(known[..., None], position, 0), axis=1)
    centroid = total / np.maximum(weight.sum(axis=1), 1)
    return np.where(known[..., None], position - centroid[:, None], 0)


def rate(values: Floats, time: Floats) -> Floats:
    """Derivative in time, of second order: central differences, one-sided in the first and the last frame.

    Parameters
    ----------
    values : ndarray of shape (frame, ...)
    time : ndarray of shape (frame,), s

    Returns
    -------
    ndarray of the same shape
        In the unit of the values per second; NaN where a value that it takes is. With fewer than three frames all NaN.
    """
    if len(time) < 3:
        return np.full(np.shape(values), np.nan)
    return np.gradient(values, time, axis=0, edge_order=2)


def peak(values: Floats, time: Floats, sign: ArrayLike | None = None) -> tuple[Floats, Floats]:
    """Peak over the frames given: the value of largest magnitude, or the largest one in a direction, and its time.

    Parameters
    ----------
    values : ndarray of shape (frame, ...)
        NaN where unknown.
    time : ndarray of shape (frame,), s
    sign : array_like, optional
        1 for the largest, -1 for the smallest value, along the last axis.

    Returns
    -------
    value, time : ndarray of shape (...)
        In the unit of the values, and s: that of the frame. Both are NaN where a frame is unknown, and there is no time
        of a peak that is no more than the rounding of stored curves.
    """
    values = np.asarray(values)
    known = np.isfinite(values).all(axis=0)
    magnitude = np.abs(values) if sign is None else values * np.asarray(sign, float)
    frame = np.argmax(np.where(known, magnitude, 0), axis=0)
    found = np.where(known, np.take_along_axis(values, frame[None], axis=0)[0], np.nan)
    return found, np.where(np.abs(found) > CURVE, np.asarray(time)[frame], np.nan)


def systolic_rate(rates: Floats, at_es: Floats) -> Floats:
    """Largest rate in the direction of an end-systolic value: the most negative one of what shortens.

    A tracked rate is compared with the true one in the direction of the true value: of tissue that is stretched a
    little, one might else be that of stretch and the other that of shortening.

    Parameters
    ----------
    rates : ndarray of shape (frame, ...)
        From end-diastole to end-systole.
    at_es : ndarray of shape (...)
        Value at end-systole, of the same curve or of the true one.

    Returns
    -------
    ndarray of shape (...)
        In the unit of the rates; NaN where one is, and where the value is.
    """
    sign = np.where(np.isfinite(at_es), np.where(at_es < 0, -1.0, 1.0), np.nan)
    return sign * np.max(sign * rates, axis=0)
