"""B-mode clips as trackers receive them, and the grid on which their displacement is stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from echotruth.config import Config
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.labels import unpack
from echotruth.loop.cycle import read_loop
from echotruth.tracking.windows import grid

if TYPE_CHECKING:
    from echotruth.workflow.job import Job


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
    """

    frames: np.ndarray
    mask: np.ndarray
    inside: np.ndarray
    points: np.ndarray
    spacing: float
    frame_time: np.ndarray
    seed: int
    frame_step: int = 1

    @property
    def size(self) -> int:
        """Pixels along a side."""
        return self.frames.shape[-1]

    @property
    def tracker_arguments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, np.ndarray, int]:
        """Arguments of a tracker, in the order of :func:`echotruth.tracking.tracker.track`."""
        given = slice(None, None, self.frame_step)
        return self.frames[given], self.points, self.mask, self.spacing, self.frame_time[given], self.seed

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
        gridded[:, self.inside, :2] = between_frames(displacement, self.frame_step, len(self.frames)) * self.spacing
        gridded[:, self.inside, 2] = between_frames(quality, self.frame_step, len(self.frames))
        return gridded[..., :2], gridded[..., 2]


def between_frames(values: np.ndarray, step: int, frames: int) -> np.ndarray:
    """Values in all frames of a cycle from those in every n-th, linear in time in between.

    Frames are equally far apart. The cycle closes: after the last given frame comes the first one, a period after it.

    Parameters
    ----------
    values : ndarray of shape (given frame, ...)
        In the frames 0, `step`, 2 `step` and so on; NaN where unknown.
    step, frames : int
        Step between the given frames, and number of all frames.

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
    given, following = values[before], values[(before + 1) % len(values)]
    return np.where(weight > 0, (1 - weight) * given + weight * following, given)


def grid_points(config: Config, size: int) -> np.ndarray:
    """Points of the grid, at the same positions in the tissue for every image size.

    Parameters
    ----------
    config : Config
    size : int
        Image size in whose pixels the positions are given.

    Returns
    -------
    ndarray of shape (grid rows, grid columns, 2)
        Lateral, axial, px; pixel centres of the largest image.
    """
    largest = config.bmode.sizes[0]
    # A pixel of a smaller image is the mean of a block of pixels: x_small + 1/2 = (x_largest + 1/2) size / largest.
    return (grid((largest, largest), config.tracking.grid_px) + 0.5) * (size / largest) - 0.5


def grid_positions(config: Config) -> np.ndarray:
    """Positions of the grid, (grid rows, grid columns, 2): lateral, axial, m."""
    largest = config.bmode.sizes[0]
    axial, lateral = pixel_centres(config.bmode, largest)
    points = grid_points(config, largest).round().astype(int)
    return np.stack([lateral[points[..., 0]], axial[points[..., 1]]], axis=-1)


def clip_at(job: Job, inside: np.ndarray) -> Clip:
    """Clip of the heart, view and image size of a job, given the points of the grid that are in the wall."""
    config, size = job.config, job.size
    return Clip(
        frames=job.read(f"bmode/{size}", "image")["image"],
        mask=unpack(job.read(f"truth/{size}", "labels")["labels"][0])["mask"],
        inside=inside,
        points=grid_points(config, size)[inside],
        spacing=config.bmode.si().field_of_view / size,
        frame_time=read_loop(config.loop).time,
        seed=int(job.random_of("tracking").integers(2**31)),
        frame_step=config.tracking.frame_step,
    )


def clips(job: Job) -> dict[int, Clip]:
    """Clips of the heart and view of a job, by image size."""
    config, largest = job.case.config, job.case.config.bmode.sizes[0]
    labels = {size: job.read(f"truth/{size}", "labels")["labels"][0] for size in config.bmode.sizes}
    masks = {size: unpack(label)["mask"] for size, label in labels.items()}
    lateral, axial = np.moveaxis(grid_points(config, largest).round().astype(int), -1, 0)
    inside = masks[largest][axial, lateral]
    seed, time = int(job.random.integers(2**31)), read_loop(config.loop).time
    return {
        size: Clip(
            frames=job.read(f"bmode/{size}", "image")["image"],
            mask=mask,
            inside=inside,
            points=grid_points(config, size)[inside],
            spacing=config.bmode.si().field_of_view / size,
            frame_time=time,
            seed=seed,
            frame_step=config.tracking.frame_step,
        )
        for size, mask in masks.items()
    }
