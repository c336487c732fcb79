"""Digital image correlation of the whole wall at once; the motion is a cubic B-spline.

In every frame the displacement U since end-diastole, a cubic B-spline of coefficients c, minimises

    J(c) = sum_p rho(r_p) + beta E(U - U_before),    r_p = I(X_p + U(X_p)) - T_p,    U(X) = sum_k c_k B_k(X)

    X_p       pixels of the wall and its surroundings at end-diastole, px        region.wall_region
    B_k, c_k  cubic B-spline of a knot, and its coefficient (2,), px         bspline.KnotLattice, bspline.Cells
    I         image: amplitude of even gain, a little blurred, in grey values    track (grey.decompress, grey.even_gain)
    T_p       template: an earlier image at its own displaced positions          Template, WallTracker.track
    rho       r^2 / (1 + (r / (tolerance sigma))^2), sigma from the median |r|   alignment.geman_mcclure: w = rho' / 2 r
    U_before  displacement in the frame before, px                               WallTracker.track
    E         bending energy, px^2: of the field less the best affine field      bending_energy.bending_matrix,
              and multiple of U_before, which have none                          bending_energy.BendingEnergy
    beta      weight of E, grey^2 / px^2: from `smoothness`, or by the evidence  WallRegion._normal_matrix, evidence

J is minimised by Gauss-Newton with the weights w (:meth:`.region.WallRegion.align`; Baker and Matthews 2004, Int J
Comput Vis 56:221; B-splines as Rueckert et al. 1999, IEEE Trans Med Imaging 18:712): with g = grad I at X + U and the
row B g of all products B_k g,

    (sum_p w (B g)^T (B g) + beta K) dc = -sum_p w r (B g)^T - beta K (c - c_before),    E(U) = c^T K c,

whose first sum is :func:`.alignment.add_normal_matrix`, and whose solution is :meth:`.region.NormalMatrix.newton_step`.

Image and template are blurred at first, so that a motion beyond the size of a speckle is found; the start is
`WallTracker._predict`, by a dense flow. The gain is made even, so that tissue in a shadow counts like the rest. A
template is kept until its correlation with the tissue falls below `template_update_ncc`. Where tissue is not seen, as
in a shadow that shows noise alone (:mod:`.visibility`), the clip is tracked once more without the pixels there: the
energy carries the motion of the tissue around into it. That the cycle closes is no term of J: if it does
(:mod:`.closure`), the clip is tracked from end-diastole both forwards and backwards, and :class:`BothWays` takes the
mean of the two with weights from their variances.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import cv2
import numpy as np

from echotruth.config.tracking import BsplineDic
from echotruth.imaging import spline
from echotruth.threads import each
from echotruth.tracking import bidirectional
from echotruth.tracking.accumulation import Path, length, step_variance
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import decompress, even_gain, grey_levels, rms
from echotruth.tracking.ncc import NormalizedCrossCorrelation
from echotruth.tracking.region import WallRegion, wall_region
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.dis import MIN_IMAGE_SIDE, optical_flow
from echotruth.tracking.visibility import Visibility, visibility
from echotruth.units import mm, um

MIN_KNOT_SPACING = 5.0
"""px; closer knots have more unknowns than the image has information."""
FLOW_PIXELS_PER_KNOT = 8
"""Pixels between knots in the images of the dense flow, at least; these are block means."""
COARSE_BLUR = 0.25
"""Standard deviation of the blur with which an alignment begins, over the knot spacing: with that of the mouse 0.1 mm,
twice the size of a speckle. The next speckle, a false match, then lies no longer between start and solution."""
COARSE_ITERATIONS = 6
"""Iterations with blurred images at most: their solution is a start."""
LIKENESS_RADIUS = 0.5
"""Half-width of the windows in which it is judged whether tissue is seen, over the knot spacing."""
LIKENESS_STRIDE = 4
"""Every n-th pixel is the centre of such a window."""
BLOCKS_PER_KNOT = 4
"""Blocks of the image over which that is averaged, per knot spacing; what is not seen is wider by a knot spacing."""
LEAST_UNSEEN = 0.01
"""Share of the wall at end-diastole below which a clip is taken to be seen everywhere."""
MIN_COARSE_BLUR = 2.0
"""px; where that blur is less, pixels are as large as speckle, and an alignment begins with the images as they are."""
NCC_EXPONENT = 8
"""Power of the correlation in the variance of a step. The noise of one match gives 2; where the correlation is low,
the field may also settle on other tissue that resembles the template, and such errors weigh more."""


@dataclass(frozen=True)
class WallTrajectory:
    """Motion of the wall, tracked from end-diastole in one direction of time.

    Attributes
    ----------
    coefficients : ndarray of shape (frame, knot, 2)
        Coefficients of the displacement, px.
    variance : ndarray of shape (frame,)
        Variance of the displacement, px^2 up to a factor; infinite in frames without texture.
    ncc : ndarray of shape (frame, n)
        Correlation of image and template around each point; NaN where one of them has no texture.
    decorrelation : ndarray of shape (frame, n)
        Sum of :func:`.accumulation.step_variance` of the correlations around each point, over the templates on the way.
    likeness : list of (ndarray of shape (k, 2), ndarray of shape (k,))
        Of every frame but the first: displaced pixels, px, and the correlation of image and template around each;
        empty where it is known already what is seen.
    """

    coefficients: np.ndarray
    variance: np.ndarray
    ncc: np.ndarray
    decorrelation: np.ndarray
    likeness: list[tuple[np.ndarray, np.ndarray]]


def track(clip: TrackerInput, settings: BsplineDic) -> Path:
    """Path of the points of a clip; those outside the wall and its surroundings are lost."""
    if not clip.mask.any():
        return lost(clip)
    if clip.is_volume:
        from echotruth.tracking.volume import follow_volume  # it is built of what is here

        return follow_volume(clip, settings).path
    return follow(clip, settings).path


def lost(clip: TrackerInput) -> Path:
    """Path of points of which none is found."""
    unknown = np.full((len(clip.frames), len(clip.points)), np.nan)
    return Path(np.stack([unknown] * clip.mask.ndim, -1), unknown, unknown, unknown)


def follow(clip: TrackerInput, settings: BsplineDic) -> "BothWays":
    """Track the wall of a clip, which must have some, both ways or forwards only."""
    mask, spacing = clip.mask, clip.spacing
    blur = settings.blur_px * np.sqrt(max(0.0, 1 - (settings.speckle_pixel_um * um / spacing) ** 2))
    knot_spacing = max(settings.knots_mm * mm / spacing, MIN_KNOT_SPACING)
    region = wall_region(mask, knot_spacing, settings.margin_um * um / spacing, settings.transmural_scale)
    coarse_blur = COARSE_BLUR * knot_spacing
    ncc = NormalizedCrossCorrelation(
        region.positions, region.inside, clip.points, 2 * knot_spacing, settings.dynamic_range_dB
    )
    pixels = NormalizedCrossCorrelation(
        region.positions,
        np.ones(len(region.positions), bool),
        region.positions[::LIKENESS_STRIDE],
        LIKENESS_RADIUS * knot_spacing,
        settings.dynamic_range_dB,
    )
    block = max(1, min(int(knot_spacing / FLOW_PIXELS_PER_KNOT), min(mask.shape) // MIN_IMAGE_SIDE))

    grey = grey_levels(clip.frames)
    typical = rms(decompress(np.nan_to_num(grey[0][mask]), settings.dynamic_range_dB))

    def prepare(frame: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        amplitude = decompress(np.nan_to_num(frame), settings.dynamic_range_dB)
        even = even_gain(amplitude, settings.gain_mm * mm / spacing, typical) if settings.gain_mm else amplitude
        return block_mean(even, block), gaussian(even, blur), gaussian(amplitude, blur)

    means, even, amplitudes = zip(*each(prepare, list(grey)), strict=True)
    images = [spline.coefficients(frame) for frame in even]
    resolved = images if coarse_blur >= MIN_COARSE_BLUR else []
    blurred = each(partial(gaussian, deviation=coarse_blur), resolved)
    coarse = np.array(means) / (np.max(means) or 1)
    tracker = WallTracker(region, ncc, pixels, coarse, block, images, blurred, amplitudes, settings)
    is_both = settings.reference == "bidirectional" and len(clip.frames) > 2  # of two frames both ways are the same
    orders = bidirectional.forward_backward(len(clip.frames))[: 1 + is_both]
    trajectories = each(tracker.track, orders)
    likeness = [match for trajectory in trajectories for match in trajectory.likeness]
    visible = visibility(likeness, mask.shape, knot_spacing / BLOCKS_PER_KNOT, BLOCKS_PER_KNOT)
    in_wall = region.positions[region.inside]
    if 1 - visible.at(in_wall).mean() < LEAST_UNSEEN:
        return BothWays(region, clip.points, even, trajectories[0], trajectories[-1])
    trajectories = each(replace(tracker, visible=visible).track, orders)
    return BothWays(region, clip.points, even, trajectories[0], trajectories[-1], visible)


def gaussian(image: np.ndarray, deviation: float) -> np.ndarray:
    """Image (rows, columns) blurred by a Gaussian of a standard deviation, px; as it is for 0."""
    return cv2.GaussianBlur(image, (0, 0), deviation, borderType=cv2.BORDER_REFLECT) if deviation else image


def block_mean(image: np.ndarray, side: int) -> np.ndarray:
    """Mean over blocks of side x side pixels; rows and columns left over at the end are dropped."""
    rows, columns = (length // side for length in image.shape)
    return image[: rows * side, : columns * side].reshape(rows, side, columns, side).mean((1, 3))


@dataclass(frozen=True)
class Template:
    """What the tissue looks like in an earlier frame, to which others are aligned.

    Attributes
    ----------
    frame : int
    warped : ndarray of shape (pixel, 3)
        Image at the displaced pixels, and its lateral and axial derivative per px.
    blurred : ndarray of shape (pixel,) or None
        Blurred image there; None if none is used.
    seen : ndarray of shape (pixel,) or None
        How far tissue is seen there, from 0 to 1; None if it is everywhere.
    """

    frame: int
    warped: np.ndarray
    blurred: np.ndarray | None
    seen: np.ndarray | None


@dataclass(frozen=True)
class WallTracker:
    """Tracker of the wall through a clip in either direction of time.

    Attributes
    ----------
    region : WallRegion
    ncc, pixels : NormalizedCrossCorrelation
        Around the points, and around pixels of the region.
    coarse : ndarray of shape (frame, rows, columns)
        Block means of the amplitudes over their maximum, for the dense flow.
    block : int
        Side of a block, px.
    images : list of ndarray
        Spline coefficients of the amplitudes with even gain.
    blurred : list of ndarray
        The same, blurred by `COARSE_BLUR`; empty if an alignment begins with the images as they are.
    amplitudes : sequence of ndarray
        Blurred amplitudes as they are (axial, lateral): they tell whether a place has texture.
    settings : BsplineDic
    visible : Visibility, optional
        Where tissue is seen; pixels elsewhere have no weight. None: everywhere.
    """

    region: WallRegion
    ncc: NormalizedCrossCorrelation
    pixels: NormalizedCrossCorrelation | None
    coarse: np.ndarray
    block: int
    images: list[np.ndarray]
    blurred: list[np.ndarray]
    amplitudes: Sequence[np.ndarray]
    settings: BsplineDic
    visible: Visibility | None = None

    def track(self, order: Sequence[int]) -> WallTrajectory:
        """Track the wall through the frames in an order that begins with end-diastole."""
        coefficients = np.zeros((len(order), self.region.lattice.size, self.region.positions.shape[1]))
        variance = np.zeros(len(order))
        warped = self.region.interpolate(self.images[0], self.region.positions)
        template = latest = self._template(0, coefficients[0], warped)
        amplitude = {0: self._amplitude(0, coefficients[0])}
        ncc = [self.ncc.at_points(amplitude[0], amplitude[0])] * len(order)
        decorrelation = [np.zeros_like(ncc[0])] * len(order)
        likeness = []
        for before, now in pairwise(order):
            start = self._predict(now, before, coefficients[before], template)
            fitted, warped = self._align(now, template, start, coefficients[before])
            if template is not latest and not self._ncc(template, warped) > self.settings.template_update_ncc:
                template = latest
                start = self._best(now, template, start, fitted)
                fitted, warped = self._align(now, template, start, coefficients[before])
            coefficients[now] = fitted
            variance[now] = variance[template.frame] + self._variance(template, warped)
            amplitude[now] = self._amplitude(now, fitted)
            ncc[now] = self.ncc.at_points(amplitude[template.frame], amplitude[now])
            decorrelation[now] = decorrelation[template.frame] + step_variance(ncc[now])
            if self.visible is None and self.pixels is not None:
                alike = self.pixels.at_points(template.warped[:, 0], warped[:, 0])
                likeness.append((self.region.displaced(fitted)[::LIKENESS_STRIDE], alike))
            if np.isfinite(variance[now]):
                latest = self._template(now, fitted, warped)
        return WallTrajectory(coefficients, variance, np.array(ncc), np.array(decorrelation), likeness)

    def _template(self, frame: int, coefficients: np.ndarray, warped: np.ndarray) -> Template:
        seen = self._seen(coefficients)
        if not self.blurred:
            return Template(frame, warped, None, seen)
        blurred = self.region.interpolate(self.blurred[frame], self.region.displaced(coefficients))
        return Template(frame, warped, blurred[:, 0], seen)

    def _seen(self, coefficients: np.ndarray) -> np.ndarray | None:
        """How far the tissue of each pixel is seen where it is displaced to; None if all is seen everywhere."""
        return None if self.visible is None else self.visible.at(self.region.displaced(coefficients))

    def _amplitude(self, frame: int, coefficients: np.ndarray) -> np.ndarray:
        """Amplitudes (pixel,) of a frame at the displaced pixels; outside the image those of its border."""
        return self.region.sample(self.amplitudes[frame], self.region.displaced(coefficients))

    def _ncc(self, template: Template, warped: np.ndarray) -> float:
        return self.ncc.overall(template.warped[:, 0], warped[:, 0])

    def _variance(self, template: Template, warped: np.ndarray) -> float:
        """Variance mean((T - I)^2) / mean(|grad I|^2) / NCC^8 of the match of image I and template T, px^2."""
        ncc, inside = self._ncc(template, warped), self.region.inside
        if not ncc > 0:
            return np.inf
        difference = np.mean((template.warped[inside, 0] - warped[inside, 0]) ** 2)
        return difference / np.mean(warped[inside, 1:] ** 2) / ncc**NCC_EXPONENT

    def _align(self, frame: int, template: Template, start: np.ndarray, previous: np.ndarray):
        """Align a frame with a template, blurred at first; see :meth:`WallRegion.align`."""
        how = self.settings.smoothness, self.settings.tolerance
        seen = None if template.seen is None else self._seen(start) * template.seen
        if seen is not None and not seen.any():
            seen = None
        if template.blurred is not None:
            image = self.blurred[frame]
            coarse, _ = self.region.align(image, template.blurred, start, previous, *how, COARSE_ITERATIONS, seen)
            start = self._best(frame, template, start, coarse)
        return self.region.align(self.images[frame], self._aligned_to(template), start, previous, *how, seen=seen)

    def _aligned_to(self, template: Template) -> np.ndarray:
        """What of a template an image is aligned to: its grey values."""
        return template.warped[:, 0]

    def _predict(self, now: int, before: int, coefficients: np.ndarray, template: Template) -> np.ndarray:
        """Coefficients advanced by the dense flow, or unchanged if they then match the template better."""
        positions = (self.region.displaced(coefficients) - (self.block - 1) / 2) / self.block
        step = self.block * interpolate_field(optical_flow(self.coarse[before], self.coarse[now]), positions)
        advanced = coefficients + self.region.fit(np.nan_to_num(step))
        return self._best(now, template, coefficients, advanced)

    def _best(self, frame: int, template: Template, *fields: np.ndarray) -> np.ndarray:
        """The field with the smallest mean absolute difference between image and template."""

        def difference(coefficients: np.ndarray) -> float:
            warped = self.region.interpolate(self.images[frame], self.region.displaced(coefficients))
            return float(np.abs(warped[:, 0] - template.warped[:, 0]).mean())

        return min(fields, key=difference)


@dataclass(frozen=True)
class BothWays:
    """The wall tracked forwards and backwards.

    Attributes
    ----------
    region : WallRegion
    points : ndarray of shape (n, 2)
        Positions at end-diastole: lateral, axial, px.
    images : sequence of ndarray of shape (axial, lateral)
        Amplitude of each frame, of even gain and blurred, as the wall was tracked in it.
    forward, backward : WallTrajectory
        The same if it is tracked forwards only.
    visible : Visibility, optional
        Where tissue is seen. None: everywhere.
    """

    region: WallRegion
    points: np.ndarray
    images: Sequence[np.ndarray]
    forward: WallTrajectory
    backward: WallTrajectory
    visible: Visibility | None = None

    @cached_property
    def weight(self) -> np.ndarray:
        """Weight (frame,) of the way forwards in the mean of both, from their variances."""
        return bidirectional.inverse_variance_weight(self.forward.variance, self.backward.variance)

    @cached_property
    def displacements(self) -> list[np.ndarray]:
        """Displacement (frame, n, 2) of the points by each way, px."""
        return [_displacement(self.region, self.points, way) for way in (self.forward, self.backward)]

    @property
    def path(self) -> Path:
        """The mean of both ways; its variance is that of the correlation around each point."""
        forward, backward, weight = self.forward, self.backward, self.weight[:, None]
        displacement = bidirectional.weighted_mean(weight[..., None], *self.displacements)
        correlation = bidirectional.weighted_mean(weight, np.maximum(forward.ncc, 0), np.maximum(backward.ncc, 0))
        correlation[0] += 1 - correlation[0]
        displacement[np.isnan(correlation)] = np.nan
        if forward is backward:
            variance, disagreement = forward.decorrelation, np.full_like(correlation, np.nan)
        else:
            variance = bidirectional.mean_variance(weight, forward.decorrelation, backward.decorrelation)
            disagreement = length(self.displacements[0] - self.displacements[1])
        path = Path(displacement, correlation, variance, disagreement)
        if self.visible is None:
            return path
        position = self.points + np.nan_to_num(displacement)
        return replace(path, unseen=1 - self.visible.at(position.reshape(-1, 2)).reshape(correlation.shape))


def _displacement(region: WallRegion, points: np.ndarray, trajectory: WallTrajectory) -> np.ndarray:
    """Displacement (frame, n, 2) of points, px."""
    frames = len(trajectory.coefficients)
    flat = trajectory.coefficients.transpose(1, 0, 2).reshape(region.lattice.size, -1)
    return np.moveaxis(region.lattice.evaluate(flat, points).reshape(len(points), frames, points.shape[1]), 0, 1).copy()
