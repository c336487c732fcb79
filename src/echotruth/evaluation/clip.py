"""B-mode clips as trackers receive them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from echotruth.cases import Case
from echotruth.imaging.labels import unpack
from echotruth.loop.cycle import frame_times
from echotruth.repository.reader import Repository
from echotruth.section import Section
from echotruth.seeds import generator
from echotruth.tracking.point_grid import grid_points
from echotruth.units import mm


@dataclass(frozen=True)
class Clip:
    """One view of one heart at one image size.

    Trackers are given every `frame_step`-th frame, as of a scanner with a lower frame rate.

    Attributes
    ----------
    frames : ndarray of shape (frame, axial, lateral), uint8
        B-mode; frame 0 is end-diastole.
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole.
    inside : ndarray of shape (grid rows, grid columns), bool
        Whether a point of the grid is in the wall at end-diastole.
    points : ndarray of shape (n, 2)
        Points inside: lateral, axial, px of this size.
    spacing : float
        Distance of pixel centres, m.
    frame_time : ndarray of shape (frame,)
        Time since end-diastole, s.
    seed : int
        Seed of the tracker's random numbers.
    frame_step : int
        Step between the frames that a tracker is given.
    is_closed : bool
        Whether the first frame follows the last one; trackers do not know.
    """

    frames: np.ndarray
    mask: np.ndarray
    inside: np.ndarray
    points: np.ndarray
    spacing: float
    frame_time: np.ndarray
    seed: int
    frame_step: int = 1
    is_closed: bool = True

    @property
    def size(self) -> int:
        """Pixels along a side."""
        return self.frames.shape[-1]

    @property
    def tracker_arguments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, np.ndarray, int]:
        """Arguments of a tracker, in the order of :func:`echotruth.tracking.tracker.track`."""
        given = slice(None, None, self.frame_step)
        return self.frames[given], self.points, self.mask, self.spacing, self.frame_time[given], self.seed

    def suited(self, settings: Section) -> Section:
        """Settings of a tracker for the clip: as they are, since it looks itself whether the cycle is closed."""
        return settings

    @property
    def no_estimate(self) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (given frame, n, 2) and quality (given frame, n) of a tracker that failed, all NaN."""
        shape = len(self.frames[:: self.frame_step]), len(self.points)
        return np.full((*shape, 2), np.nan), np.full(shape, np.nan)

    def on_grid(self, displacement: np.ndarray, quality: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and quality on the whole grid, in all frames.

        Parameters
        ----------
        displacement : ndarray of shape (given frame, n, 2)
            Lateral, axial, px.
        quality : ndarray of shape (given frame, n)

        Returns
        -------
        displacement : ndarray of shape (frame, grid rows, grid columns, 2)
            Lateral, axial, m; NaN outside the wall.
        quality : ndarray of shape (frame, grid rows, grid columns)
        """
        gridded = np.full((len(self.frames), *self.inside.shape, 3), np.nan)
        of_clip = self.frame_step, len(self.frames), self.is_closed
        gridded[:, self.inside, :2] = between_frames(displacement, *of_clip) * self.spacing
        gridded[:, self.inside, 2] = between_frames(quality, *of_clip)
        return gridded[..., :2], gridded[..., 2]


def between_frames(values: np.ndarray, step: int, frames: int, is_closed: bool = True) -> np.ndarray:
    """Values in all frames of a cycle from those in every n-th, linear in time in between.

    Frames are equally far apart. If the cycle closes, after the last given frame comes the first one, a period after
    the first; else there is none, and values stay those of the last given frame.

    Parameters
    ----------
    values : ndarray of shape (given frame, ...)
        In the frames 0, `step`, 2 `step` and so on; NaN where unknown.
    step, frames : int
        Step between the given frames, and number of all frames.
    is_closed : bool

    Returns
    -------
    ndarray of shape (frame, ...)
        NaN also between a given frame in which a value is known and one in which it is not.
    """
    if step == 1:
        return values
    frame = np.arange(frames)
    before = frame // step
    interval = np.minimum(step, frames - before * step)  # the last one is shorter where the step does not divide them
    weight = ((frame - before * step) / interval).reshape(-1, *(1,) * (values.ndim - 1))
    after = (before + 1) % len(values) if is_closed else np.minimum(before + 1, len(values) - 1)
    given, following = values[before], values[after]
    return np.where(weight > 0, (1 - weight) * given + weight * following, given)


def make_clip(case: Case, view: str, frames: np.ndarray, labels: np.ndarray, inside: np.ndarray) -> Clip:
    """Clip of one view of one heart at one image size.

    Parameters
    ----------
    case : Case
    view : str
    frames : ndarray of shape (frame, axial, lateral), uint8
        Grey levels.
    labels : ndarray of shape (label, axial, lateral), uint8
        Labels of the tissue at end-diastole, as :mod:`echotruth.imaging.labels` packs them.
    inside : ndarray of shape (grid rows, grid columns), bool
        Whether a point of the grid is in the wall at end-diastole.
    """
    config, size = case.config, frames.shape[-1]
    return Clip(
        frames=frames,
        mask=unpack(labels)["mask"],
        inside=inside,
        points=grid_points(config, size)[inside],
        spacing=config.bmode.field_of_view_mm * mm / size,
        frame_time=frame_times(config.loop),
        seed=tracker_seed(case, view),
        frame_step=config.tracking.frame_step,
        is_closed=config.views[view].motion.is_closed,
    )


def clips_of(case: Case, view: str, read: Callable[..., dict[str, Any]]) -> list[Any]:
    """Clips of one view of one heart, one of each image size, or the :class:`.VolumeClip`.

    Parameters
    ----------
    case : Case
    view : str
    read : callable
        Returns arrays of a group of the view by name, given the group and the names.
    """
    if case.config.has_volumes:
        from echotruth.evaluation.volume import VolumeClip  # compiled; slices need none of it

        mask = unpack(read("truth/volume", "labels")["labels"][0], 3)["mask"]
        return [VolumeClip(case, view, read("bmode/volume", "image")["image"], mask)]
    inside, clips = read("points", "layer")["layer"] > 0, []
    for size in case.config.bmode.sizes:
        image, labels = read(f"bmode/{size}", "image")["image"], read(f"truth/{size}", "labels")["labels"]
        clips.append(make_clip(case, view, image, labels[0], inside))
    return clips


def read_clips(repository: Repository, case: str, view: str) -> dict[int, Clip]:
    """Clips of one view of a repository, by image size."""

    def read(group: str, *names: str) -> dict[str, Any]:
        return repository.arrays(group, case, view, *names)

    return {clip.size: clip for clip in clips_of(repository.case(case), view, read)}


def tracker_seed(case: Case, view: str) -> int:
    """Seed of the random numbers of trackers in one view of one heart."""
    return int(generator(case, view, "tracking").integers(2**31))
