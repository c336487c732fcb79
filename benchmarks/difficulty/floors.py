"""Difficulty of a clip: the error of a perfect tracker of the plane, the Cramer-Rao bound, and correlations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.difficulty.bound import AlignedImages
from benchmarks.difficulty.plane import both_ways, plane_path, tissue_path
from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.clip import Clip, between_frames, read_clips
from echotruth.evaluation.displacement_error import evaluate
from echotruth.evaluation.points import Truth, ground_truth
from echotruth.heart import Heart
from echotruth.imaging import spline
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.view import Plane
from echotruth.repository.reader import Repository
from echotruth.tracking.alignment import interpolate_with_gradient
from echotruth.tracking.bidirectional import forward_backward
from echotruth.tracking.grey import DYNAMIC_RANGE, decompress, grey_levels

PARAMETERS = 27
"""Parameters for each component of the smooth motion of the Cramer-Rao bound: sines and cosines up to four waves around
the wall, nine functions, times a polynomial of second degree through it."""
COLUMNS = (
    *("case", "view", "size_px"),
    *("floor_percent", "floor_plane_percent", "floor_plane_forward_percent", "floor_plane_backward_percent"),
    *("floor_plane_coverage", "floor_crb_percent", "floor_crb_forward_percent", "floor_crb_backward_percent"),
    *("crb_step_um", "crb_parameters"),
    *("correlation_median", "correlation_least", "correlation_closing", "correlation_es"),
)
"""Columns of the table."""
Row = dict[str, str | int | float]


def difficulty(repository: Repository, case: str, view: str) -> list[Row]:
    """Determine how difficult a clip is to track.

    Parameters
    ----------
    repository : Repository
    case, view : str

    Returns
    -------
    list of dict
        Of each image size, by :data:`COLUMNS`, as :meth:`.Repository.difficulty` describes them.
    """
    scene, given = _Scene.read(repository, case, view), read_clips(repository, case, view)
    paths = [_paths(scene, given, order) for order in scene.orders]
    rows: list[Row] = []
    for size, clip in given.items():
        ways = [_way(scene, clip, path) for path in paths]
        keys: Row = {"case": case, "view": view, "size_px": size, "crb_parameters": PARAMETERS}
        rows.append(keys | _plane(scene, ways) | _bound(scene, ways) | _correlations(scene, ways))
        rows[-1]["floor_percent"] = float(np.hypot(rows[-1]["floor_plane_percent"], rows[-1]["floor_crb_percent"]))
    return [{name: row[name] for name in COLUMNS} for row in rows]


@dataclass(frozen=True)
class _Scene:
    """What all image sizes of a clip share.

    It has heart, plane, truth, the orders in which given frames are visited, and whether the cycle closes.
    """

    heart: Heart
    config: Config
    plane: Plane
    truth: Truth
    orders: tuple[list[int], list[int]]
    is_closed: bool = True

    @classmethod
    def read(cls, repository: Repository, case: str, view: str) -> _Scene:
        config, (heart, plane) = repository.case(case).config, repository.before_probe(case, view)
        truth = ground_truth(heart, plane, config.views[view].plane, config)
        given = range(0, len(truth.displacement), config.tracking.frame_step)
        forward, backward = ([given[visit] for visit in order] for order in forward_backward(len(given)))
        return cls(heart, config, plane, truth, (forward, backward), config.views[view].motion.is_closed)

    def follow(self, start: Floats, order: list[int]) -> Floats:
        """Positions (visit, n, 2), m, of a perfect tracker of the plane that starts at points (n, 2)."""
        path = tissue_path if self.config.phantom.in_plane_only else plane_path
        return path(self.heart, self.plane, start, order)

    def at_es(self, values: Floats) -> Floats:
        """Values of the given frames (given frame, ...) at end-systole, as those of trackers are interpolated."""
        step = self.config.tracking.frame_step
        found: Floats = between_frames(values, step, len(self.truth.displacement), self.is_closed)[self.truth.es]
        return found

    @property
    def es_visit(self) -> int:
        """Visit, forwards, of the last given frame that is not after end-systole."""
        return self.truth.es // self.config.tracking.frame_step

    @property
    def cauchy_green(self) -> Floats:
        """Mean over the wall of F^T F of the motion in the plane from end-diastole to end-systole, (2, 2).

        It turns the covariance of an error in the coordinates of end-diastole into the mean square of the error that
        the tissue carries to end-systole.
        """
        truth = self.truth
        radial, tangential, shear = truth.strain[REFERENCES.index("plane"), truth.es].T
        strain = np.stack([np.stack([radial, shear], -1), np.stack([shear, tangential], -1)], -2)
        axes = truth.operator.axes
        in_image = np.swapaxes(axes, 1, 2) @ strain @ axes
        mean: Floats = np.eye(2) + 2 * np.nanmean(in_image, axis=0)
        return mean


@dataclass(frozen=True)
class _Way:
    """One way through a clip.

    It has the displacement (frame, point, 2), m, of a perfect tracker of the plane at the points of the grid, in the
    frames that a tracker gets; the images in the order of the visits; the least covariance `variance` of the
    displacement, mean over the wall, (frame, 2, 2), m^2; and the least variance `step_variance` of a step, sum of both
    components, (visits - 1,), m^2.
    """

    displacement: Floats
    images: AlignedImages
    variance: Floats
    step_variance: Floats


@dataclass(frozen=True)
class _Paths:
    """Paths of a perfect tracker of the plane, one way through a clip.

    It has the frames in the `order` of the visits; `points` (visit, point, 2), m, of the grid; and `pixels` of the wall
    (visit, n, 2), m, by image size.
    """

    order: list[int]
    points: Floats
    pixels: dict[int, Floats]


def _paths(scene: _Scene, given: dict[int, Clip], order: list[int]) -> _Paths:
    """Paths of all points of a clip; the mesh is searched once a frame."""
    start = [scene.truth.wall.position]
    for clip in given.values():
        axial, lateral = pixel_centres(scene.config.bmode, clip.size)
        rows, columns = np.nonzero(clip.mask)
        start.append(np.column_stack([lateral[columns], axial[rows]]))
    path = scene.follow(np.concatenate(start), order)
    points, *pixels = np.split(path, np.cumsum([len(each) for each in start])[:-1], axis=1)
    return _Paths(order, points, dict(zip(given, pixels, strict=True)))


def _way(scene: _Scene, clip: Clip, paths: _Paths) -> _Way:
    """Displacement, images and bound of one way."""
    visits = np.argsort(paths.order)
    images = _aligned(scene, clip, paths)
    steps = [np.trace(images.variance(visit, visit + 1, PARAMETERS)) for visit in range(len(visits) - 1)]
    variance = images.path_variance(PARAMETERS)[visits]
    return _Way(paths.points[visits] - scene.truth.wall.position, images, variance, np.array(steps))


def _aligned(scene: _Scene, clip: Clip, paths: _Paths) -> AlignedImages:
    """Amplitudes of a clip along the path of a perfect tracker of the plane, on the rectangle that holds the wall."""
    axial, lateral = pixel_centres(scene.config.bmode, clip.size)
    pixel = (paths.pixels[clip.size] - [lateral[0], axial[0]]) / clip.spacing
    rows, columns = np.nonzero(clip.mask)
    rows, columns = rows - rows.min(), columns - columns.min()
    values = np.full((len(paths.order), rows.max() + 1, columns.max() + 1), np.nan)
    for image, frame, position in zip(values, paths.order, pixel, strict=True):
        known = np.isfinite(position).all(-1)
        amplitude = decompress(grey_levels(clip.frames[frame]), DYNAMIC_RANGE)
        read = interpolate_with_gradient(spline.coefficients(amplitude), position[known])[:, 0]
        image[rows[known], columns[known]] = read
    return AlignedImages(values, clip.spacing, clip.size * clip.spacing)


def _plane(scene: _Scene, ways: list[_Way]) -> Row:
    """Error of a perfect tracker of the plane, forwards, backwards, and of the mean of both as trackers take it."""
    variances = [np.trace(scene.at_es(way.variance)) for way in ways]
    forward, backward = (scene.at_es(way.displacement) for way in ways)
    both = both_ways(forward, backward, variances)
    row: Row = {}
    for name, displacement in (("", both), ("_forward", forward), ("_backward", backward)):
        found = evaluate(displacement[None], scene.truth.displacement[scene.truth.es][None], scene.truth.wall, 0)
        row[f"floor_plane{name}_percent"] = 100 * float(found["nrmse"][0, -1])
        if not name:
            row["floor_plane_coverage"] = float(found["coverage"])
    return row


def _bound(scene: _Scene, ways: list[_Way]) -> Row:
    """Cramer-Rao bound at end-systole, over the RMS of the true displacement, and that of a step."""
    forward, backward = (scene.at_es(way.variance) for way in ways)
    step = float(np.mean(np.append(ways[0].step_variance, ways[1].step_variance[0])))
    return {
        "floor_crb_percent": _percent(_combined(forward, backward), scene),
        "floor_crb_forward_percent": _percent(forward, scene),
        "floor_crb_backward_percent": _percent(backward, scene),
        "crb_step_um": 1e6 * np.sqrt(step) if np.isfinite(step) else np.nan,
    }


def _combined(first: Floats, second: Floats) -> Floats:
    """Covariance of the best mean of two independent estimates of covariances (2, 2): V1 (V1 + V2)^-1 V2."""
    if not np.isfinite(first).all() or not np.isfinite(second).all():
        return np.where(np.isfinite(first), first, second)
    combined: Floats = first @ np.linalg.pinv(first + second) @ second
    return combined


def _percent(variance: Floats, scene: _Scene) -> float:
    """RMS error at end-systole by a covariance in the coordinates of end-diastole, over the RMS displacement, %."""
    true = np.nanmean((scene.truth.displacement[scene.truth.es] ** 2).sum(-1))
    if not (np.isfinite(variance).all() and true > 0):
        return np.nan
    return float(100 * np.sqrt(np.trace(scene.cauchy_green @ variance) / true))


def _correlations(scene: _Scene, ways: list[_Way]) -> Row:
    """Correlations of the images along the path of a perfect tracker of the plane."""
    forward, backward = (way.images for way in ways)
    steps = [forward.correlation(visit, visit + 1) for visit in range(len(forward.values) - 1)]
    return {
        "correlation_median": float(np.median(steps)),
        "correlation_least": float(np.min(steps)),
        "correlation_closing": backward.correlation(0, 1),
        "correlation_es": forward.correlation(0, scene.es_visit),
    }
