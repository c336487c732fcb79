"""A small repository with exact truth: its hearts move affinely, and its images are textures that move with them."""

from pathlib import Path

import numpy as np
from finished_repository import blank, configured, finish

from echotruth.config import Bmode, Config, Motion
from echotruth.config.motion import Affine
from echotruth.imaging.bmode import pixel_centres
from echotruth.workflow.job import Job, Result
from workflow.scripts import truth

GRADIENT = [[0.9, 0.05, 0.0], [0.0, 1.1, 0.0], [0.2, 0.0, 1.0]]
"""Rows lateral, axial, elevation: part of the tissue leaves the plane of a short-axis view."""
SWEPT = {"seed": [1, 2], "pathology.infarct.segments": [None, [7, 12]]}


def made(folder: Path) -> Path:
    """Two hearts, one with an infarct, and each with two seeds; all is done but tracking, which is empty."""
    motion = Motion(kind="affine", affine=Affine(gradient=GRADIENT))
    config = configured(name="small", cases=SWEPT, bmode=Bmode(size_px=64, downsampling=(1, 2)), motion=motion)
    return make(folder, config)


def make(folder: Path, config: Config) -> Path:
    """A repository whose hearts, images and truth are those of its configuration."""
    return finish(folder, config, of_job)


def of_job(job: Job) -> Result:
    """Arrays of a job, as the workflow stores them."""
    if job.stage == "bmode":
        return {f"bmode/{size}": {"image": texture(job, size)} for size in job.config.bmode.sizes}
    return truth.work(job) if job.stage == "truth" else blank(job)


def texture(job: Job, size: int) -> np.ndarray:
    """Frames (frame, axial, lateral) of a texture that tissue carries along: waves of a millimetre, black outside."""
    random = np.random.default_rng([job.config.seed, list(job.config.views).index(job.view_name)])
    axial, lateral = pixel_centres(job.config.bmode, size)
    displacement = job.read(f"truth/{size}", "displacement")["displacement"]
    position = np.stack(np.broadcast_arrays(lateral, axial[:, None]), axis=-1) - displacement[..., :2]
    direction, phase = random.uniform(0, 2 * np.pi, (2, 30))
    wave = 2 * np.pi / random.uniform(0.6e-3, 1.2e-3, 30) * np.stack([np.cos(direction), np.sin(direction)])
    grey = 128 + 60 * np.sin(position @ wave + phase).sum(-1) / np.sqrt(15)
    return np.nan_to_num(grey).clip(0, 255).round()
