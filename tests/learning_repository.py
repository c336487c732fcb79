"""A small repository with exact truth: its hearts move affinely, and its images are textures that move with them."""

from functools import cache
from pathlib import Path

import numpy as np
from finished_repository import configured, finish, result

import echotruth as et
from echotruth.config import Bmode, Config, Motion
from echotruth.config.motion import Affine
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.repository.case_file import read_case
from echotruth.workflow.job import Job

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


def of_job(job: Job):
    """Arrays of a job, as the workflow stores them."""
    heart, config = _beat(job.folder, job.case.id), job.config
    if job.stage == "mechanics":
        return heart.arrays
    view, number = config.views[job.view_name], list(config.views).index(job.view_name)
    plane = imaging_plane(view, config.rf, heart.endo_at_ed)
    if job.stage == "phantom":
        posed = {"scatterer_count": 0, "origin": plane.origin, "axes": plane.axes, "centre": np.zeros(2)}
        return {"phantom": posed}
    if job.stage not in ("truth", "bmode"):
        return result(job)
    centres = pixel_centres(config.bmode, job.size)
    truth = pixel_truth(heart, plane, *centres, TissueImages(config, heart, plane, *centres))
    if job.stage == "truth":
        return {f"truth/{job.size}": truth}
    random = np.random.default_rng([config.seed, number])
    return {f"bmode/{job.size}": {"image": texture(truth["displacement"], *centres, random)}}


@cache
def _beat(folder: Path, case: str):
    return et.beat(read_case(folder, case).config, progress=False)


def texture(displacement, axial, lateral, random):
    """Frames (frame, axial, lateral) of a texture that tissue carries along: waves of a millimetre, black outside."""
    position = np.stack(np.broadcast_arrays(lateral, axial[:, None]), axis=-1) - displacement[..., :2]
    direction, phase = random.uniform(0, 2 * np.pi, (2, 30))
    wave = 2 * np.pi / random.uniform(0.6e-3, 1.2e-3, 30) * np.stack([np.cos(direction), np.sin(direction)])
    grey = 128 + 60 * np.sin(position @ wave + phase).sum(-1) / np.sqrt(15)
    return np.nan_to_num(grey).clip(0, 255).round()
