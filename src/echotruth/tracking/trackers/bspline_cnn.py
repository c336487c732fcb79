"""`bspline_dic`, whose motion a network corrects that has learned from hearts of which the true motion is known.

The wall is cut by rays from the middle of the cavity (:mod:`echotruth.tracking.wall_rays`). At points of these rays the
network is given the displacement, how far both ways are apart and how well images match along them, and the brightness
that follows each point: where a border of the wall is lost, it changes. It gives what has to be added and how far the
sum is still off (:mod:`echotruth.tracking.ray_network`). Between the points, and between phases of the cycle, the
correction is interpolated linearly.

It knows whole beats of hearts alone. So the images choose the weight of its correction, one a clip: that with which
they are most alike along the motion (:mod:`echotruth.tracking.similarity`), with a small bonus, since `bspline_dic` is
fitted to these very images, and the true motion is a little less like them. A clip that is open, of several beats or of
a wall that does not contract has no correction at all.
"""

import logging
from dataclasses import dataclass, fields, replace
from pathlib import Path as File

import numpy as np

from echotruth.config.tracking import BsplineCnn, BsplineDic
from echotruth.tracking.accumulation import Path
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import rms
from echotruth.tracking.periodicity import repetition
from echotruth.tracking.quality import IMAGE_FRACTION, error_model, squares
from echotruth.tracking.ray_network import PHASES, RayNetwork, read
from echotruth.tracking.similarity import even_contrast, similarity
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.bspline_dic import BothWays, follow, gaussian, lost
from echotruth.tracking.wall_rays import ANGLES, DEPTHS, DIRECTIONS, RAYS, WallRays, wall_rays

WEIGHTS = File(__file__).with_suffix(".npz")
"""Weights that come with the package; docs/tracking.md says from which hearts."""
SHARES = np.array([-0.3, -0.1, 0.1, 0.5, 0.9, 1.1, 1.3])
"""Where brightness is looked at along a ray: 0 at the endocardium, 1 at the epicardium."""
BLUR = 0.12
"""Standard deviation of the blur of that brightness, over the thickness of the wall."""
LARGEST = 3.0
"""Largest displacement and difference of both ways that the network is given, over the scale: one that has gone astray
in black images may be anywhere."""
LEAST_SCALE = 0.1
"""Scale of a motion at least, over the thickness of the wall."""
EACH_DEPTH = ("along", "across", "along_apart", "across_apart", "ncc_forward", "ncc_backward")
EACH_SHARE = ("brightness", "brightening")
DIRECTION = ("ray_lateral", "ray_axial", "ray_cos2", "ray_sin2")
SIZES = ("relative_thickness", "relative_radius", "thickness", "scale")
CHANNELS = (
    *(f"{kind}_{depth}" for kind in EACH_DEPTH for depth in range(DEPTHS)),
    *(f"{kind}_{share}" for kind in EACH_SHARE for share in SHARES),
    "unseen",
    *DIRECTION,
    *("weight", "phase_cosine", "phase_sine"),
    *SIZES,
    "both_ways",
)
"""Names of what the network is given."""
ODD = [number for number, name in enumerate(CHANNELS) if name.startswith(("across", "ray_lateral", "ray_sin2"))]
"""Channels that change their sign in a mirror, left to right."""
MIRRORED = (RAYS // 2 - np.arange(RAYS)) % RAYS
"""Ray that each is in the mirror: the one at an angle a is at pi - a."""
CORRECTION_WEIGHTS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Weights of the correction that are tried."""
BONUS = 0.04
"""Largest loss of similarity at which the whole correction is still preferred to none; docs/tracking.md says on which
clips it was chosen."""
LEAST_CONTRACTION, LEAST_THICKENING = 0.1, -0.03
"""Mean motion of the wall towards the cavity in the frame in which it is largest, over its thickness, and thickening of
the wall then, below which the network is not used: it has learned from hearts that contract and thicken. Hearts have
0.19 and -0.01 or more, since coarse speckle hides the thickening of a long axis; walls that rest, turn, twist or dilate
have 0.03 or less, and rings that shrink -0.05 or less (docs/tracking.md)."""
LEAST_FRAMES = 6
"""Frames of a beat at least, of which 24 phases can be distinguished."""


@dataclass(frozen=True)
class RayFeatures:
    """What the network is given of a clip.

    Attributes
    ----------
    channels : ndarray of shape (channel, PHASES, RAYS), float32
        By :data:`CHANNELS`.
    displacement : ndarray of shape (frame, DEPTHS, RAYS, 2)
        Of `bspline_dic`, along and across the ray, px.
    rays : WallRays
    scale : float
        RMS displacement of the points in the frame where it is largest, px; `LEAST_SCALE` of the wall at least.
    """

    channels: np.ndarray
    displacement: np.ndarray
    rays: WallRays
    scale: float

    def places(self) -> np.ndarray:
        """Where `bspline_dic` has the points of the rays that cross the wall, (frame, DEPTHS, crossing ray, 2), px."""
        return (self.rays.points + self.rays.in_image(self.displacement))[:, :, self.rays.crosses]


def track(clip: TrackerInput, settings: BsplineCnn) -> Path:
    """Path of the points of a clip; its deviation is that of the network and `deviation_before`, by their weights.

    Raises
    ------
    ValueError
        If the clip has fewer than `LEAST_FRAMES`, or the wall surrounds no cavity.
    """
    frames = len(clip.frames)
    if frames < LEAST_FRAMES:
        raise ValueError(
            f"bspline_cnn knows whole beats and needs {LEAST_FRAMES} frames or more; the clip has {frames}: take "
            "bspline_dic."
        )
    if not clip.mask.any():
        nothing = lost(clip)
        return replace(nothing, deviation=nothing.variance)
    features, path = ray_features(clip, settings)
    rays, network = features.rays, read(settings.weights or WEIGHTS, len(CHANNELS))
    if reason := unknown_motion(clip, features):
        logging.getLogger("echotruth").warning(f"{reason}, which the network does not know: tracked by bspline_dic")
        return replace(path, deviation=deviation_before(clip, path))
    correction, stated = seen_twice(network, features.channels)
    values = features.scale * np.concatenate([rays.in_image(correction), stated[..., None]], -1)
    step = over_frames(values[..., :2], frames)[:, :, rays.crosses]
    weight = correction_weight(clip, features, step)
    at_points = rays.interpolate(np.moveaxis(values, 0, 2), clip.points)
    found = over_frames(np.moveaxis(at_points, 1, 0), frames)
    variance = weight * found[..., 2] ** 2 + (1 - weight) * deviation_before(clip, path) ** 2
    return replace(path, displacement=path.displacement + weight * found[..., :2], deviation=np.sqrt(variance))


def unknown_motion(clip: TrackerInput, features: RayFeatures) -> str:
    """Why a clip is none of those that the network knows, the beginning of a sentence; empty if it may be one."""
    if not clip.is_closed:
        return "the clip is no closed cycle"
    moved, thicker = contraction(features)
    if moved < LEAST_CONTRACTION or thicker < LEAST_THICKENING:
        inwards, thins = (f"{100 * least:.0f} %" for least in (LEAST_CONTRACTION, -LEAST_THICKENING))
        bounds = f"inwards by less than {inwards} of its thickness, or thins by more than {thins}"
        return f"since the first frame the wall moves {bounds}"
    if period := repetition(features.places().reshape(len(clip.frames), -1, 2)):
        return f"the motion comes again after {period} frames, and the clip has {len(clip.frames)}"
    return ""


def contraction(features: RayFeatures) -> tuple[float, float]:
    """Largest mean motion of the wall towards the cavity, less that of the whole wall, over its thickness; and by what
    share the wall is then thicker."""
    rays = features.rays
    moved = rays.in_image(features.displacement)[:, :, rays.crosses]
    moved = moved - moved.mean((1, 2), keepdims=True)
    along = (moved * DIRECTIONS[rays.crosses]).sum(-1)
    outwards, apart = along.mean((1, 2)), (DEPTHS - 1) / DEPTHS * rays.thickness
    frame = int(outwards.argmin())
    return float(-outwards[frame] / rays.thickness), float((along[frame, -1] - along[frame, 0]).mean() / apart)


def correction_weight(clip: TrackerInput, features: RayFeatures, step: np.ndarray) -> float:
    """Weight of `CORRECTION_WEIGHTS` with which images are most alike along the motion, `BONUS` times the weight added.

    `step` (frame, DEPTHS, crossing ray, 2) is the correction at :meth:`RayFeatures.places`, px.
    """
    images, places = even_contrast(clip.frames, features.rays.thickness), features.places()

    def likeness(weight: float) -> float:
        moved = places + weight * step
        return similarity(images, moved.reshape(len(moved), -1, 2)) + BONUS * weight

    return max(CORRECTION_WEIGHTS, key=likeness)


def deviation_before(clip: TrackerInput, path: Path) -> np.ndarray:
    """Standard deviation (frame, n) of the error of `bspline_dic` along each axis, px, as its quality has it."""
    terms = squares(path, speckle_length(clip.frames[0], clip.mask), clip.shape)
    return np.sqrt(error_model(BsplineDic()).variance(terms)) * IMAGE_FRACTION * max(clip.shape)


def seen_twice(network: RayNetwork, channels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Correction and deviation: means of those by the channels and of those by the mirrored clip, mirrored back."""
    other = channels[..., MIRRORED]
    other[ODD] *= -1
    (correction, deviation), mirrored = network(channels), network(other)
    its_correction, its_deviation = (values[:, :, MIRRORED] for values in mirrored)
    return (correction + its_correction * [1, -1]) / 2, (deviation + its_deviation) / 2


def ray_features(clip: TrackerInput, settings: BsplineCnn) -> tuple[RayFeatures, Path]:
    """Input of the network for a clip, and the path of its points by `bspline_dic`.

    Raises
    ------
    ValueError
        If the wall surrounds no cavity.
    """
    rays = wall_rays(clip.mask)
    nodes = rays.points.reshape(-1, 2)
    ways = follow(replace(clip, points=np.concatenate([nodes, clip.points])), settings)
    path = ways.path
    displacement = rays.along_and_across(on_rays(path.displacement))
    length = np.sqrt((displacement[:, :, rays.crosses] ** 2).sum(-1).mean((1, 2)).max())
    scale = max(float(length), LEAST_SCALE * rays.thickness)
    channels = [*_motion(rays, ways, displacement, scale), *_brightness(rays, ways, clip.mask, displacement)]
    channels += _circumstances(rays, ways, path, scale)
    given = np.stack([np.broadcast_to(each, (len(clip.frames), RAYS)) for each in channels], 1) * rays.crosses
    features = RayFeatures(over_phases(given).swapaxes(0, 1).astype(np.float32), displacement, rays, scale)
    return features, _of_points(path, slice(len(nodes), None))


def _of_points(path: Path, points: slice) -> Path:
    """Path of some of the points."""
    names = [each.name for each in fields(Path) if getattr(path, each.name) is not None]
    return replace(path, **{name: getattr(path, name)[:, points] for name in names})


def on_rays(values: np.ndarray) -> np.ndarray:
    """Values (frame, n, ...), whose first points are those of the rays, as (frame, DEPTHS, RAYS, ...); 0 for NaN."""
    return np.nan_to_num(values[:, : DEPTHS * RAYS]).reshape(len(values), DEPTHS, RAYS, *values.shape[2:])


def over_phases(values: np.ndarray) -> np.ndarray:
    """Values (frame, ...) of a cycle at `PHASES` phases of it, (PHASES, ...)."""
    return _resampled(values, PHASES)


def over_frames(values: np.ndarray, frames: int) -> np.ndarray:
    """Values (PHASES, ...) at the frames of a clip of the cycle, (frames, ...)."""
    return _resampled(values, frames)


def _resampled(values: np.ndarray, number: int) -> np.ndarray:
    """Values along the first axis, which is periodic, at another number of equal steps, by linear interpolation."""
    place = np.arange(number) * len(values) / number
    first = place.astype(int)
    between = (place - first).reshape(-1, *(1,) * (values.ndim - 1))
    return (1 - between) * values[first] + between * values[(first + 1) % len(values)]


def _motion(rays: WallRays, ways: BothWays, displacement: np.ndarray, scale: float) -> list[np.ndarray]:
    """Channels (frame, ray) of each depth: displacement, difference of both ways, correlations of both."""
    forward, backward = map(on_rays, ways.displacements)
    vectors = np.concatenate([displacement, rays.along_and_across(forward - backward)], -1) / scale
    vectors = np.clip(vectors, -LARGEST, LARGEST)
    correlations = np.stack([on_rays(way.ncc) for way in (ways.forward, ways.backward)], -1)
    values = np.concatenate([vectors, correlations], -1)
    return [values[:, depth, :, kind] for kind in range(values.shape[-1]) for depth in range(DEPTHS)]


def _brightness(rays: WallRays, ways: BothWays, mask: np.ndarray, displacement: np.ndarray) -> list[np.ndarray]:
    """Channels (frame, ray): amplitude at end-diastole at each of `SHARES`, and how it has changed since, there.

    The amplitude has even gain and is over its RMS in the wall.
    """
    start = rays.centre + (rays.inner + SHARES[:, None] * (rays.outer - rays.inner))[..., None] * DIRECTIONS
    nearest = np.clip((SHARES * DEPTHS).astype(int), 0, DEPTHS - 1)
    position = start + rays.in_image(displacement)[:, nearest]
    inside = np.clip(position.reshape(len(position), -1, 2), 0, np.array(mask.shape[::-1]) - 1)
    blurred = (gaussian(image, BLUR * rays.thickness)[..., None] for image in ways.images)
    seen = [interpolate_field(image, places) for image, places in zip(blurred, inside, strict=True)]
    brightness = np.reshape(seen, (-1, len(SHARES), RAYS)) / (rms(ways.images[0][mask]) or 1.0)
    return [*brightness[0], *np.moveaxis(brightness - brightness[0], 1, 0)]


def _circumstances(rays: WallRays, ways: BothWays, path: Path, scale: float) -> list[np.ndarray]:
    """Channels that broadcast to (frame, ray): what is seen, direction of the ray, phase, sizes, and the two ways."""
    frames = len(path.displacement)
    unseen = np.zeros(1) if path.unseen is None else on_rays(path.unseen).mean(1)
    phase = 2 * np.pi * np.arange(frames)[:, None] / frames
    thickness, radius = rays.outer - rays.inner, float((rays.inner + rays.outer)[rays.crosses].mean()) / 2
    direction = [np.cos(ANGLES), np.sin(ANGLES), np.cos(2 * ANGLES), np.sin(2 * ANGLES)]
    sizes = [thickness / radius, rays.inner / radius, np.log([rays.thickness / 20]), np.log([scale / rays.thickness])]
    both = np.ones(1) * (ways.forward is not ways.backward)
    return [unseen, *direction, ways.weight[:, None], np.cos(phase), np.sin(phase), *sizes, both]
