"""A small repository with exact truth: its hearts move affinely, and its images are textures that move with them."""

from pathlib import Path

import numpy as np
from echotruth.workflow.scripts.cases import lay_out
from echotruth.workflow.stage_cost import Cost
from finished_repository import configured, work

import echotruth as et
from echotruth.cases import expand
from echotruth.config import Bmode, Motion
from echotruth.config.motion import Affine
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.repository import ledger
from echotruth.repository.publication import publish
from echotruth.workflow.job import Job

GRADIENT = [[0.9, 0.05, 0.0], [0.0, 1.1, 0.0], [0.2, 0.0, 1.0]]
"""Rows lateral, axial, elevation: part of the tissue leaves the plane of a short-axis view."""
SWEPT = {"seed": [1, 2], "pathology.infarct.segments": [None, [7, 12]]}


def made(folder: Path) -> Path:
    """Two hearts, one with an infarct, and each with two seeds; all is done but tracking, which is empty."""
    motion = Motion(kind="affine", affine=Affine(gradient=GRADIENT))
    config = configured(name="small", cases=SWEPT, bmode=Bmode(size_px=64, downsampling=(1, 2)), motion=motion)
    cases = expand(config)
    lay_out(folder, config, cases)
    for case in cases:
        make(folder, case)
    ledger.commit(folder / "ledger/repository.json", publish(folder))
    return folder


def make(folder, case):
    """Results of one heart, as the workflow stores them."""
    heart, config = et.beat(case.config, progress=False), case.config
    groups = dict(heart.arrays)
    commit(folder, "physiology", case, None, {"physiology": groups.pop("physiology")})
    commit(folder, "mechanics", case, None, groups)
    for number, view in enumerate(config.views):
        plane = imaging_plane(config.views[view], config.rf, heart.endo_at_ed)
        posed = {"scatterer_count": 0, "origin": plane.origin, "axes": plane.axes, "centre": np.zeros(2)}
        commit(folder, "phantom", case, view, {"phantom": posed})
        images, truth = {}, {}
        for size in config.bmode.sizes:
            centres = pixel_centres(config.bmode, size)
            truth[f"truth/{size}"] = pixel_truth(heart, plane, *centres)
            random = np.random.default_rng([config.seed, number])
            images[f"bmode/{size}"] = {"image": texture(truth[f"truth/{size}"]["displacement"], *centres, random)}
        commit(folder, "truth", case, view, truth)
        commit(folder, "bmode", case, view, images)
        for stage in ("rf", "tracking", "evaluation"):
            work(folder, case.config, stage, case, view)


def texture(displacement, axial, lateral, random):
    """Frames (frame, axial, lateral) of a texture that tissue carries along: waves of a millimetre, black outside."""
    position = np.stack(np.broadcast_arrays(lateral, axial[:, None]), axis=-1) - displacement[..., :2]
    direction, phase = random.uniform(0, 2 * np.pi, (2, 30))
    wave = 2 * np.pi / random.uniform(0.6e-3, 1.2e-3, 30) * np.stack([np.cos(direction), np.sin(direction)])
    grey = 128 + 60 * np.sin(position @ wave + phase).sum(-1) / np.sqrt(15)
    return np.nan_to_num(grey).clip(0, 255).round()


def commit(folder, stage, case, view, arrays):
    Job(folder, stage, case, view, code="1").commit(arrays, Cost())
