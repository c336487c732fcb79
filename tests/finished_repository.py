"""A small repository whose jobs are all done, with values that a heart could have, made in a second."""

import json
from collections.abc import Callable, Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import zarr

from echotruth.cases import expand
from echotruth.config import Bmode, Config, Geometry, Loop, Motion, PhaseCorrelation, Tracking, View
from echotruth.repository import ledger, packing, schema
from echotruth.repository.layout import lay_out
from echotruth.repository.publication import publish
from echotruth.workflow.job import Job, Result

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
    "truth": {"labels": np.reshape([1, 1, 0], (3, 1, 1)), "tissue": 2, "flow": FLOW},
    "evaluation": {"wall_axes": np.eye(2)},
}
"""Values that are not 0: of a heart that does not move, and fills its images."""


@cache
def shapes(store: Path, group: str) -> dict[str, tuple[int, ...]]:
    """Shape of what one job writes of each array of a group, by the names of those in packs."""
    opened = zarr.open_group(store, path=group, mode="r", use_consolidated=False)
    blank = {
        array.name: np.zeros(opened[array.name].shape[array.leading :])
        for array in schema.arrays_of(group)
        if array.name in opened
    }
    found = packing.unpack(schema.packs_of(group), blank, opened.attrs["labels"])
    return {name: values.shape for name, values in found.items()}


def result(job: Job) -> dict[str, dict[str, np.ndarray]]:
    """All arrays of a job by group; images are noise, so that they differ between jobs."""
    arrays = {}
    for group in schema.written_by(job.stage, job.config, job.size or None):
        values = VALUES.get(group.partition("/")[0], {})
        arrays[group] = {
            name: np.broadcast_to(np.asarray(values.get(name, 0), float), shape)
            for name, shape in shapes(job.store.path, group).items()
        }
        if job.stage == "bmode":
            noise = np.random.default_rng([job.config.seed, len(str(job.view_name))])
            arrays[group]["image"] = noise.integers(256, size=shapes(job.store.path, group)["image"])
    return arrays


def jobs(folder: Path, config: Config, case: str) -> Iterator[Job]:
    """Jobs of a heart, in the order of their stages."""
    for path in ledger.record_paths(folder, case, config):
        yield job_of(folder, path)


def job_of(folder: Path, record: Path) -> Job:
    """The job that a record is of, given the path of it."""
    stage, case, *place = record.relative_to(folder / "ledger").with_suffix("").parts
    view, size = (*place, None, None)[:2]
    return Job(folder, stage, case, view, int(size) if size else None, code="1")


def finish(folder: Path, config: Config, result: Callable[[Job], Result] = result) -> Path:
    """Make a repository, in its folder, as the workflow does, given the arrays of a job."""
    cases = expand(config)
    lay_out(folder, config, cases)
    for case in cases:
        for job in jobs(folder, config, case.id):
            job.commit(result(job))
    ledger.commit(folder / "ledger/repository.json", publish(folder))
    return folder


def remake(folder: Path, config: Config) -> list[str]:
    """Make what has no record, as a run does; the records that were made, below the folder."""
    cases = expand(config)
    lay_out(folder, config, cases)
    missing = [job for case in cases for job in jobs(folder, config, case.id) if not job.record.exists()]
    for job in missing:
        job.commit(result(job))
    made, published = [job.record for job in missing], folder / "ledger/repository.json"
    if made or not published.exists():
        ledger.commit(published, publish(folder))
        made.append(published)
    return [path.relative_to(folder).as_posix() for path in made]


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
