"""A small repository of which a view has RF."""

from functools import cache

import numpy as np
import pytest
from finished_repository import begin, blank, do

from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Probe, Rf, Tracking, View
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.recorder import RfRecorder, sixteen_bit
from echotruth.units import mm
from echotruth.workflow.job import Job

FRAMES = 2


def configured(keep, **rf):
    return Config(
        name="small",
        geometry=Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1),
        loop=Loop(frames=FRAMES),
        views={"mid": View(), "apex": View(position=0.8)},
        probe=Probe(elements=24),
        rf=Rf(lines=16, sector_deg=40.0, keep=keep, **rf),
        bmode=Bmode(size_px=64, downsampling=(1,)),
        tracking=Tracking(trackers={"one": PhaseCorrelation(window_px=16)}),
    )


@cache
def scanner(**rf):
    """One for all that is to be kept: making it takes longer than a frame."""
    config = configured([], **rf)
    return Scanner(config.probe, config.rf, config.bmode.field_of_view_mm * mm)


def scatterers(seed):
    random = np.random.default_rng(seed)
    low, high = (-1.5e-3, 3e-3, -2e-4), (1.5e-3, 9e-3, 2e-4)
    return random.uniform(low, high, (400, 3)), random.standard_normal(400)


@pytest.fixture(scope="session")
def rf_repository(tmp_path_factory):
    """Folder of a repository of which the view mid has RF of 400 scatterers, as the workflow's script writes it."""

    def make(keep=("channels",), **rf):
        config, scan = configured(list(keep), **rf), scanner(**rf)
        folder = tmp_path_factory.mktemp("rf") / "small"
        (case,) = begin(folder, config)
        do(Job(folder, "mechanics", case.id), blank)
        recorder, lines = RfRecorder(config, scan, FRAMES), []
        for frame in range(FRAMES):
            matrix = scan.matrix(*scatterers(frame))
            recorder.add(frame, matrix)
            lines.append(scan.beamform(matrix))
        job = Job(folder, "rf", case.id, "mid")
        job.notes |= recorder.settings
        job.write({"rf": {"lines": sixteen_bit(np.stack(lines))} | recorder.arrays})
        return folder

    return make
