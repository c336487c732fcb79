"""Digital image correlation of the whole wall at once, its motion a B-spline.

The displacement since end-diastole is a cubic B-spline over the wall at end-diastole. Frame by frame it is sought so
that the image, read where the tissue has gone, is like a template: an earlier frame read in the same way (Gauss-Newton
with robust weights, Baker and Matthews 2004, Int J Comput Vis 56:221; B-splines as Rueckert et al. 1999, IEEE Trans Med
Imaging 18:712). A template is kept until the tissue no longer looks like it. As the cycle closes, the clip is followed
from end-diastole both forwards and backwards, and the two are averaged by their variances.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from echotruth.config.tracking import BsplineDic
from echotruth.imaging import spline
from echotruth.tracking import bidirectional
from echotruth.tracking.alignment import grey_at
from echotruth.tracking.flow import sample
from echotruth.tracking.grey import amplitudes, levels
from echotruth.tracking.ncc import Likeness
from echotruth.tracking.region import Region, region
from echotruth.tracking.trackers.dis import SMALLEST, flow

CLOSEST = 5.0
"""Least distance of knots, px: between closer ones there is less to see than there are unknowns."""
SEEN = 8
"""Pixels of the dense flow between knots at least, of which it takes the mean of several: it is smoothed anyway."""
RARER = 3
"""Power of the correlation in the variance of a step. The noise about one match asks for 2; where images are unlike, a
field may besides settle on what only looks like the template."""


@dataclass(frozen=True)
class Path:
    """The wall as followed from end-diastole in one direction of time.

    Attributes
    ----------
    coefficients : ndarray of shape (frame, knot, 2)
        Of the displacement, px.
    variance : ndarray of shape (frame,)
        Expected square of its error, px^2 up to a factor; infinite where there is nothing to follow.
    alike : ndarray of shape (frame, n)
        Correlation of image and template about the points; NaN where one of them has no texture.
    """

    coefficients: np.ndarray
    variance: np.ndarray
    alike: np.ndarray


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: BsplineDic,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame: see :func:`echotruth.tracking.tracker.track`.

    Points beyond the reach of the wall have none.
    """
    if not mask.any():
        return np.full((len(frames), len(points), 2), np.nan), np.full((len(frames), len(points)), np.nan)
    values = settings.si()
    blur = values.blur_px * np.sqrt(max(0.0, 1 - (values.resolved / spacing) ** 2))
    knots = max(values.knots / spacing, CLOSEST)
    body = region(mask, knots, values.margin / spacing, values.across)
    likeness = Likeness(body.places, body.inside, points, 2 * knots, values.range)
    times = max(1, min(int(knots / SEEN), min(mask.shape) // SMALLEST))

    def prepare(frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        bright = amplitudes(np.nan_to_num(frame), values.range)
        blurred = cv2.GaussianBlur(bright, (0, 0), blur, borderType=cv2.BORDER_REFLECT) if blur else bright
        return coarsened(bright, times), blurred

    with ThreadPoolExecutor(2) as threads:
        coarse, blurred = zip(*threads.map(prepare, levels(frames)), strict=True)
        images = [spline.coefficients(frame) for frame in blurred]
        coarse = np.array(coarse) / (np.max(coarse) or 1)
        follower = Follower(body, likeness, coarse, times, images, settings)
        paths = list(threads.map(follower.follow, bidirectional.ways(len(frames))))
    return blend(body, points, *paths)


def coarsened(image: np.ndarray, times: int) -> np.ndarray:
    """Means over squares of some pixels a side; what is left at the end of rows and columns is left out."""
    rows, columns = (length // times for length in image.shape)
    return image[: rows * times, : columns * times].reshape(rows, times, columns, times).mean((1, 3))


@dataclass(frozen=True)
class Follower:
    """What both directions of time have in common.

    Attributes
    ----------
    body : Region
    likeness : Likeness
        Of the pixels of the body, and about the points that are asked for.
    coarse : ndarray of shape (frame, rows, columns)
        Amplitudes over the greatest, for the dense flow.
    times : int
        Pixels of the clip along a side of one of these.
    images : list of ndarray
        Spline coefficients of the amplitudes, blurred.
    settings : BsplineDic
    """

    body: Region
    likeness: Likeness
    coarse: np.ndarray
    times: int
    images: list[np.ndarray]
    settings: BsplineDic

    def follow(self, order: Sequence[int]) -> Path:
        """The wall through the frames in an order that begins with end-diastole."""
        template = seen = grey_at(self.images[0], self.body.places)
        coefficients, variance = np.zeros((len(order), self.body.lattice.size, 2)), np.zeros(len(order))
        alike = [self.likeness.about_points(template[:, 0], template[:, 0])] * len(order)
        key = last = 0
        for before, now in pairwise(order):
            start = self._start(now, before, coefficients[before], template)
            found, moved = self._align(now, template, start, coefficients[before])
            if key != last and not self._overall(template, moved) > self.settings.renewal:
                key, template = last, seen
                start = self._nearest(now, template, start, found)
                found, moved = self._align(now, template, start, coefficients[before])
            coefficients[now], variance[now] = found, variance[key] + self._doubt(template, moved)
            alike[now] = self.likeness.about_points(template[:, 0], moved[:, 0])
            if np.isfinite(variance[now]):
                last, seen = now, moved
        return Path(coefficients, variance, np.array(alike))

    def _overall(self, template: np.ndarray, moved: np.ndarray) -> float:
        return self.likeness.overall(template[:, 0], moved[:, 0])

    def _doubt(self, template: np.ndarray, moved: np.ndarray) -> float:
        """Square of the shift that would explain what differs, px^2; the less alike the images, the more so."""
        alike, inside = self._overall(template, moved), self.body.inside
        if not alike > 0:
            return np.inf
        difference = np.mean((template[inside, 0] - moved[inside, 0]) ** 2)
        return difference / np.mean(moved[inside, 1:] ** 2) / alike**RARER

    def _align(self, frame: int, template: np.ndarray, start: np.ndarray, anchor: np.ndarray):
        stiffness = self.settings.smoothness, self.settings.tolerance
        return self.body.align(self.images[frame], template[:, 0], start, anchor, stiffness)

    def _start(self, now: int, before: int, coefficients: np.ndarray, template: np.ndarray) -> np.ndarray:
        """Coefficients after a step as the dense flow has it, or before it if that is nearer to the template."""
        places = self.body.places + self.body.cells.evaluate(coefficients)
        places = (places - (self.times - 1) / 2) / self.times
        step = self.times * sample(flow(self.coarse[before], self.coarse[now]), places)
        moved = coefficients + self.body.fit(np.nan_to_num(step))
        return self._nearest(now, template, coefficients, moved)

    def _nearest(self, frame: int, template: np.ndarray, *fields: np.ndarray) -> np.ndarray:
        """The field that leaves the least difference from the template."""

        def misfit(coefficients: np.ndarray) -> float:
            moved = grey_at(self.images[frame], self.body.places + self.body.cells.evaluate(coefficients))
            return float(np.abs(moved[:, 0] - template[:, 0]).mean())

        return min(fields, key=misfit)


def blend(body: Region, points: np.ndarray, forward: Path, backward: Path) -> tuple[np.ndarray, np.ndarray]:
    """Mean of two paths, each weighted by the variance of the other.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        px.
    quality : ndarray of shape (frame, n)
    """
    share = bidirectional.share(forward.variance, backward.variance)[:, None]
    coefficients = bidirectional.blend(share[..., None], forward.coefficients, backward.coefficients)
    flat = coefficients.transpose(1, 0, 2).reshape(body.lattice.size, -1)
    displacement = np.moveaxis(body.lattice.at(flat, points).reshape(len(points), len(share), 2), 0, 1).copy()
    quality = bidirectional.blend(share, np.maximum(forward.alike, 0), np.maximum(backward.alike, 0))
    quality[0] += 1 - quality[0]
    displacement[np.isnan(quality)] = np.nan
    return displacement, quality
