"""A small repository whose jobs are all done, with values that a heart could have, made in a second."""

import json
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import zarr
from echotruth.workflow.scripts.cases import lay_out
from echotruth.workflow.stage_cost import Cost

from echotruth.cases import expand
from echotruth.config import Bmode, Config, Geometry, Loop, Motion, PhaseCorrelation, Tracking, View
from echotruth.repository import ledger, packing, schema
from echotruth.repository.ledger import GATES, VIEW_STAGES
from echotruth.repository.publication import publish
from echotruth.repository.store import Store, packs_of, schema_of
from echotruth.workflow.job import Job

SIZE, FRAMES = 64, 3


def configured(name="small", seeds=(1, 2), views=("mid", "long_axis"), **changes) -> Config:
    planes = {"mid": View(), "long_axis": View(plane="long_axis"), "apex": View(position=0.8)}
    settings = {
        "geometry": Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
        "loop": Loop(frames=FRAMES),
        "motion": Motion(kind="affine"),
        "bmode": Bmode(size_px=SIZE, downsampling=(1,)),
        "tracking": Tracking(trackers={"one": PhaseCorrelation(window_px=16)}),
    }
    swept = {"cases": {"seed": list(seeds)}}
    return Config(name=name, views={view: planes[view] for view in views}, **settings | swept | changes)


FLOW = np.zeros((FRAMES, 2, 1, 1, 1))
FLOW[0, 0] = FLOW[-1, 1] = np.nan
"""No motion; there is no frame before the first and none after the last."""

VALUES = {
    "fibres": {"fibre": [1, 0, 0], "sheet": [0, 1, 0], "layer": 1, "segment": 1},
    "mechanics": {"volume": 1, "volume_target": 1, "pressure": 1, "pressure_target": 1},
    "kinematics": {"volume_ratio_min": 1, "volume_ratio_mean": 1},
    "physiology": {"volume_ratio_min": 1},
    "phantom": {"axes": np.eye(3)},
    "truth": {"labels": np.reshape([1, 1, 0], (3, 1, 1)), "flow": FLOW},
    "evaluation": {"wall_axes": np.eye(2)},
}
"""Values that are not 0: of a heart that does not move, and fills its images."""


@cache
def shapes(store: Path, group: str) -> dict[str, tuple[int, ...]]:
    """Shape of what one job writes of each array of a group, by the names of those in packs."""
    opened = zarr.open_group(store, path=group, mode="r", use_consolidated=False)
    blank = {array.name: np.zeros(opened[array.name].shape[array.leading :]) for array in schema_of(group)}
    found = packing.unpack(packs_of(group), blank, opened.attrs["labels"])
    return {name: values.shape for name, values in found.items()}


def result(store: Store, stage: str, config: Config, seed: int) -> dict:
    """All arrays of a job by group; images are noise, so that they differ between jobs."""
    arrays = {}
    for group in schema.written_by(stage, config):
        values = VALUES.get(group.partition("/")[0], {})
        arrays[group] = {
            name: np.broadcast_to(np.asarray(values.get(name, 0), float), shape)
            for name, shape in shapes(store.path, group).items()
        }
        if stage == "bmode":
            noise = np.random.default_rng(seed).integers(256, size=shapes(store.path, group)["image"])
            arrays[group]["image"] = noise
    return arrays


def work(folder: Path, config: Config, stage: str, case, view=None) -> None:
    """Do a job."""
    job = Job(folder, stage, case, view, code="1")
    job.commit(result(job.store, stage, config, [case.config.seed, len(str(view))]), Cost())


def finish(folder: Path, config: Config) -> Path:
    """Make a repository, in its folder, as the workflow does."""
    cases = expand(config)
    lay_out(folder, config, cases)
    for case in cases:
        for stage in GATES:
            work(folder, config, stage, case)
        for stage in VIEW_STAGES:
            for view in config.views:
                work(folder, config, stage, case, view)
    ledger.commit(folder / "ledger/repository.json", publish(folder))
    return folder


def maker(folder: Path, config: Config, made: list[str]):
    """A function that makes records again, given their paths, as a run does; it notes which ones in `made`."""
    cases = {case.id: case for case in expand(config)}

    def make(paths: list[str]) -> int:
        lay_out(folder, config, list(cases.values()))
        for path in paths:
            made.append(Path(path).relative_to(folder).as_posix())
            if path.endswith("ledger/repository.json"):
                ledger.commit(Path(path), publish(folder))
                continue
            stage, case, *view = Path(path).relative_to(folder / "ledger").with_suffix("").parts
            work(folder, config, stage, cases[case], *view)
        return 0

    return make


def content(folder: Path) -> dict[str, str]:
    """Path -> hash of every file of the hierarchy."""
    store = next(folder.glob("*.zarr"))
    files = [path for path in store.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def owners(folder: Path) -> dict[str, str]:
    """Path of every file of the hierarchy -> path of its record, both below the folder."""
    store = next(folder.glob("*.zarr")).name
    records = [path for path in (folder / "ledger").rglob("*.json")]
    return {
        f"{store}/{name}": path.relative_to(folder).as_posix()
        for path in records
        for name in json.loads(path.read_text()).get("sha256", {})
    }
