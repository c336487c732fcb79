"""Digital image correlation of the whole wall at once, its motion a B-spline.

The displacement since end-diastole is a cubic B-spline over the wall at end-diastole. Frame by frame it is sought so
that the image, read where the tissue has gone, is like a template: an earlier frame read in the same way (Gauss-Newton
with robust weights, Baker and Matthews 2004, Int J Comput Vis 56:221; B-splines as Rueckert et al. 1999, IEEE Trans Med
Imaging 18:712). A template is kept until the tissue no longer looks like it. As the cycle closes, the clip is followed
from end-diastole both forwards and backwards, and the two are averaged by their variances.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.config.tracking import BsplineDic
from echotruth.imaging import spline
from echotruth.tracking.alignment import grey_at
from echotruth.tracking.dis import flow
from echotruth.tracking.flow import sample
from echotruth.tracking.grey import FAINTEST, levels
from echotruth.tracking.region import Region, region


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
    grey = np.nan_to_num(levels(frames))
    blur = max(values.blur / spacing, values.blur_px)
    images = [spline.coefficients(ndimage.gaussian_filter(frame, blur)) for frame in grey]
    body = region(mask, values.knots / spacing, values.margin / spacing)
    follower = Follower(body, grey, images, settings)
    orders = np.arange(len(frames)), np.append(0, np.arange(len(frames) - 1, 0, -1))
    with ThreadPoolExecutor(2) as threads:
        paths = list(threads.map(lambda order: follower.follow(order, points), orders))
    return blend(body, points, *paths)


@dataclass(frozen=True)
class Follower:
    """What both directions of time have in common.

    Attributes
    ----------
    body : Region
    grey : ndarray of shape (frame, axial, lateral)
        Grey values from 0 to 1.
    images : list of ndarray
        Spline coefficients of the blurred frames.
    settings : BsplineDic
    """

    body: Region
    grey: np.ndarray
    images: list[np.ndarray]
    settings: BsplineDic

    def follow(self, order: np.ndarray, points: np.ndarray) -> Path:
        """The wall through the frames in an order that begins with end-diastole."""
        count, size = len(order), self.body.lattice.size
        coefficients, variance = np.zeros((count, size, 2)), np.zeros(count)
        alike = np.ones((count, len(points)))
        key = last = 0
        template = grey = grey_at(self.images[0], self.body.places)
        for i in range(1, count):
            before, now = order[i - 1], order[i]
            start = self._start(now, before, coefficients[before], template)
            found, moved = self._align(now, template, start, coefficients[key])
            if key != last and not likeness(template, moved, self.body.inside) > self.settings.renewal:
                key, template = last, grey
                found, moved = self._align(now, template, start, coefficients[key])
            coefficients[now] = found
            variance[now] = variance[key] + doubt(template, moved, self.body.inside)
            alike[now] = self._alike(template, moved, points)
            if np.isfinite(variance[now]):
                last, grey = now, moved
        return Path(coefficients, variance, alike)

    def _align(self, frame: int, template: np.ndarray, start: np.ndarray, anchor: np.ndarray):
        stiffness = self.settings.smoothness, self.settings.tolerance
        return self.body.align(self.images[frame], template[:, 0], start, anchor, stiffness)

    def _start(self, now: int, before: int, coefficients: np.ndarray, template: np.ndarray) -> np.ndarray:
        """Coefficients after a step as the dense flow has it, or before it if that is nearer to the template."""
        places = self.body.places + self.body.cells.evaluate(coefficients)
        step = sample(flow(self.grey[before], self.grey[now]), places)
        moved = coefficients + self.body.fit(np.nan_to_num(step), self.settings.smoothness)
        return min(coefficients, moved, key=lambda each: self._misfit(now, each, template))

    def _misfit(self, frame: int, coefficients: np.ndarray, template: np.ndarray) -> float:
        moved = grey_at(self.images[frame], self.body.places + self.body.cells.evaluate(coefficients))
        return float(np.abs(moved[:, 0] - template[:, 0]).mean())

    def _alike(self, template: np.ndarray, moved: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Correlation about the points (n,), weighted by the splines; NaN where there is no texture."""
        a, b, weight = template[:, 0], moved[:, 0], self.body.inside.astype(float)
        moments = np.stack([np.ones_like(a), a, b, a * a, b * b, a * b], -1) * weight[:, None]
        total, *sums = self.body.lattice.at(self.body.cells.gather(moments, self.body.lattice.size), points).T
        a, b, aa, bb, ab = (np.divide(each, total, out=np.full(len(points), np.nan), where=total > 0) for each in sums)
        textured = np.minimum(aa - a * a, bb - b * b) > FAINTEST**2
        product = np.where(textured, (aa - a * a) * (bb - b * b), np.nan)
        return np.clip((ab - a * b) / np.sqrt(product), 0, 1)


def likeness(template: np.ndarray, moved: np.ndarray, inside: np.ndarray) -> float:
    """Correlation of two sets of grey values (pixel, 3) over the pixels inside; NaN where one has no texture."""
    a, b = (each[inside, 0] - each[inside, 0].mean() for each in (template, moved))
    return np.mean(a * b) / (a.std() * b.std()) if min(a.std(), b.std()) > FAINTEST else np.nan


def doubt(template: np.ndarray, moved: np.ndarray, inside: np.ndarray) -> float:
    """Square of the shift that would explain what differs, px^2; the less alike the images, the more so."""
    alike = likeness(template, moved, inside)
    if not alike > 0:
        return np.inf
    difference = np.mean((template[inside, 0] - moved[inside, 0]) ** 2)
    return difference / np.mean(moved[inside, 1:] ** 2) / alike**2


def blend(body: Region, points: np.ndarray, forward: Path, backward: Path) -> tuple[np.ndarray, np.ndarray]:
    """Mean of two paths, each weighted by the variance of the other.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        px.
    quality : ndarray of shape (frame, n)
    """
    share = np.array([_share(*pair) for pair in zip(forward.variance, backward.variance, strict=True)])[:, None]
    coefficients = share[..., None] * forward.coefficients + (1 - share[..., None]) * backward.coefficients
    flat = coefficients.transpose(1, 0, 2).reshape(body.lattice.size, -1)
    displacement = body.lattice.at(flat, points).reshape(len(points), -1, 2).transpose(1, 0, 2).copy()
    ours, theirs = (np.where(np.isnan(path.alike), -1, path.alike) for path in (forward, backward))
    both = (ours >= 0) & (theirs >= 0)
    quality = np.where(both, share * ours + (1 - share) * theirs, np.maximum(ours, theirs))
    quality[quality < 0] = np.nan
    return displacement, quality


def _share(ours: float, theirs: float) -> float:
    """Weight of a value beside another by their variances; a half where neither is known."""
    if np.isinf(ours) or np.isinf(theirs):
        return 0.5 * (1 + float(np.isinf(theirs)) - float(np.isinf(ours)))
    return theirs / (ours + theirs) if ours + theirs > 0 else 0.5
