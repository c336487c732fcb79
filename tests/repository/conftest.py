"""A small repository that keeps RF, and what tests of records need."""

from functools import cache

import numpy as np
import pytest
import yaml

from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Probe, Rf, Tracking, View
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.recorder import RfRecorder, metadata
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import layout, schema
from echotruth.repository.store import Store

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
    return Scanner(config.probe, config.rf, imaging_depth(config.rf, config.bmode))


def lay_out(store, config, **rf):
    arrays, sizes, settings = metadata(config, scanner(**rf)) if config.rf.keep else ({}, {}, {})
    labels = layout.labels(config, ["heart"], np.zeros((1, FRAMES))) | layout.positions(config)
    labels |= {f"rf:{name}": value for name, value in arrays.items()}
    sizes |= layout.sizes(left_ventricle(config.geometry))
    store.lay_out(schema.groups(config), sizes, labels, {"rf": settings})


def scatterers(seed):
    random = np.random.default_rng(seed)
    low, high = (-1.5e-3, 3e-3, -2e-4), (1.5e-3, 9e-3, 2e-4)
    return random.uniform(low, high, (400, 3)), random.standard_normal(400)


@pytest.fixture
def rf_layout():
    """Lay out a store anew, for what is to be kept."""
    return lambda store, keep: lay_out(store, configured(keep))


@pytest.fixture(scope="session")
def rf_repository(tmp_path_factory):
    """Folder of a repository whose first view has RF of 400 scatterers, as the workflow's scripts write it."""

    def make(keep=("lines", "channels"), **rf):
        config = configured(list(keep), **rf)
        folder = tmp_path_factory.mktemp("small")
        (folder / "config.yaml").write_text(yaml.safe_dump(config.model_dump(mode="json")))
        (folder / "registry.txt").write_text("heart\n")
        (folder / "views.txt").write_text("mid\napex\n")
        store = Store(folder / "small.zarr")
        lay_out(store, config, **rf)
        scan = scanner(**rf)
        kept, lines = RfRecorder(config.rf.keep, scan.matrix, FRAMES), []
        for frame in range(FRAMES):
            matrix = scan.matrix(*scatterers(frame))
            kept.add(frame, matrix)
            lines.append(scan.beamform(matrix))
        store.write("rf", kept.finish(np.stack(lines)), 0, 0)
        return folder

    return make
