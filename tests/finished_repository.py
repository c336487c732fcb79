"""Repositories whose jobs are all done, in this process.

    finish(folder, configured())            in 2 s: hearts that are squeezed, noise for images, nought for the rest
    finish(folder, configured(), solved)    what a run makes: the work of the scripts, which takes a second a view
    finish(folder, config, result)          with `result(job)`, the arrays of a job by group; it may raise CaseFailed
    begin(folder, config)                   no job is done; `do(job)` does one of `jobs(folder, case)`

The fixture `finished` is `FINISHED` as the scripts make it, once for all tests of a session: copy it to change it.
"""

import json
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path

import numpy as np

from echotruth.cases import Case
from echotruth.config import (
    Bmode,
    Config,
    Geometry,
    Inference,
    Loop,
    Motion,
    Phantom,
    PhaseCorrelation,
    Probe,
    Rf,
    Tracking,
    View,
)
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.physiology import measured_heart
from echotruth.repository import schema
from echotruth.repository.checksums import CHECKSUMS, METADATA
from echotruth.repository.coordinates import coordinates_of
from echotruth.repository.datasets import source_of
from echotruth.repository.places import JobPlace, jobs_of
from echotruth.repository.publication import publish
from echotruth.workflow import lock
from echotruth.workflow.job import Job, Result, Work, run
from echotruth.workflow.plan import Plan

SIZE, FRAMES = 64, 3

DEPTHS = 8
"""Samples of a line that is made up."""
OPTIONAL = (
    "right_endo",
    "blood",
    "endocardium",
    "epicardium",
    "surroundings",
    "leaflets",
    "aortic_cusps",
    "tricuspid_leaflets",
    "papillary_muscles",
    "channels",
    "transmit",
)
"""Beginnings of the names of arrays that a repository has only if they are asked for."""


def configured(name="small", seeds=(1, 2), views=("mid", "long_axis"), **changes) -> Config:
    """A configuration of few elements, frames and pixels."""
    planes = {"mid": View(), "long_axis": View(plane="long_axis"), "apex": View(position=0.8)}
    settings = {
        "geometry": Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
        "loop": Loop(frames=FRAMES),
        "motion": Motion(kind="affine"),
        "phantom": Phantom(density_per_mm3=50.0),
        "probe": Probe(elements=16),
        "rf": Rf(lines=32, focal_zones=1),
        "bmode": Bmode(size_px=SIZE, downsampling=(1,)),
        "tracking": Tracking(grid=0.08, trackers={"one": PhaseCorrelation(window_px=16)}),
    }
    swept = {"cases": {"seed": list(seeds)}}
    return Config(name=name, views={view: planes[view] for view in views}, **settings | swept | changes)


FINISHED = configured(
    "finished",
    cases={"fibres.endo_deg": [60.0, 70.0]},
    bmode=Bmode(size_px=2 * SIZE, downsampling=(1, 2)),
    tracking=Tracking(grid=0.016, trackers={"one": PhaseCorrelation(window_px=16), "dis": {"method": "dis"}}),
)
"""Two hearts in two views and two sizes, and two trackers."""


def plan_of(folder: Path, config: Config) -> Plan:
    """Plan of the jobs of a repository that may be in any folder."""
    return Plan(config.model_dump(), folder=folder)


def begin(folder: Path, config: Config) -> list[Case]:
    """Write what a run writes before its first job; the cases."""
    plan = plan_of(folder, config)
    with lock.held(folder):
        plan.begin()
    return list(plan.cases.values())


def jobs(folder: Path, case: Case) -> Iterator[Job]:
    """Jobs of a case, in the order of their stages, that of its heart first."""
    return (Job(folder, *place) for place in jobs_of(case.id, case.config))


def missing(plan: Plan) -> list[JobPlace]:
    """Jobs that Snakemake runs: a group is not there or made otherwise, and is asked for or read by a job that runs."""
    found = []
    for id, case in plan.cases.items():
        for place in jobs_of(id, case.config):
            readers = {"phantom": ("rf", "bmode"), "rf": ("bmode",)}.get(place.stage, ())
            others = [JobPlace(stage, id, place.view) for stage in readers]
            is_first = place.stage != "mechanics" or plan.hearts[case.heart] == id
            if is_first and not any(plan.is_made(one) for one in (place, *others)):
                found.append(place)
    return found


def blank(job: Job) -> Result:
    """All arrays of a job by group; images are noise, so that they differ between jobs."""
    if job.stage == "mechanics":
        kind = "affine" if job.config.motion.kind == "beat" else job.config.motion.kind
        motion = job.config.motion.model_copy(update={"kind": kind})
        config = job.config.model_copy(update={"motion": motion, "inference": Inference()})
        groups, job.notes["bounded"] = _moved(config.model_dump_json())
        return groups
    if job.stage == "inference":
        return {group: _zeros(group, job.config) for group in schema.KINDS if group.startswith("inference/")}
    return {group: seen(job, _zeros(group, job.config)) for group in job.groups()}


def seen(job: Job, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays of a group of a view, of which some are not nought."""
    if job.stage == "phantom":
        return arrays | {"origin": job.plane.origin, "axes": job.plane.axes}
    if job.stage == "truth":
        job.notes |= source_of(job.solved, job.plane)
        wall, moves = np.reshape([1, 1, 0], (3, 1, 1)), np.zeros_like(arrays["flow"])
        moves[0, 0] = moves[-1, 1] = np.nan
        return arrays | {"labels": arrays["labels"] + wall, "tissue": arrays["tissue"] + 2, "flow": moves}
    if job.stage == "bmode":
        noise = np.random.default_rng([job.config.seed, len(str(job.view_name))])
        return {"image": noise.integers(256, size=arrays["image"].shape)}
    if job.stage == "points":
        ones = {name: arrays[name] + 1 for name in ("layer", "segment")}
        return arrays | ones | {"wall_axes": arrays["wall_axes"] + np.eye(2)}
    return arrays


def solved(job: Job) -> Result:
    """What the script of a job makes of it."""
    return import_module(f"workflow.scripts.{job.stage}").work(job)


def do(job: Job, result: Work = blank) -> None:
    """Do a job, given its arrays: its groups are written, or say why there are none."""
    run(job, result)


def remake(folder: Path, config: Config, result: Work = blank) -> list[str]:
    """Make what is missing or was made otherwise, as a run does; the jobs that were done, as `rf 1 mid`."""
    plan = plan_of(folder, config)
    done, was_published = missing(plan), plan.is_published
    cases = begin(folder, config)
    for place in done:
        do(Job(folder, *place), result)
    if not was_published:
        publish(folder, plan.config, cases)
    return [" ".join(filter(None, place)) for place in done] + ["repository"] * (not was_published)


def finish(folder: Path, config: Config, result: Work = blank) -> Path:
    """Make a repository, in its folder, as the workflow does, given the arrays of a job."""
    remake(folder, config, result)
    return folder


def content(folder: Path) -> dict[str, str]:
    """Path -> hash of every file that a repository hands over: store, table of cases and checksums."""
    files = [path for path in folder.glob("*.zarr/**/*") if path.is_file()]
    files += [folder / "cases.csv", folder / "config.yaml", folder / CHECKSUMS]
    return {path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def made_otherwise(group: Path) -> None:
    """Give a group the version of one that was made with other settings."""
    path = group / METADATA
    found = json.loads(path.read_bytes())
    found["attributes"]["version"] = "another"
    path.write_text(json.dumps(found))


@cache
def _moved(config: str) -> tuple[Result, dict[str, float]]:
    """Groups of a heart that is moved by a formula, and its measures that have bounds."""
    found = Config.model_validate_json(config, strict=False)
    groups = simulate(found)
    measures, bounded = measured_heart(groups, found)
    return groups | {"physiology": measures}, bounded


def _zeros(group: str, config: Config) -> dict[str, np.ndarray]:
    lengths = {name: np.size(values) for name, values in coordinates_of(group, config).items()}
    lengths |= {"line": config.rf.lines, "range": DEPTHS, "end": 2}
    arrays = [array for array in schema.arrays_of(group).values() if not array.name.startswith(OPTIONAL)]
    shapes = {array.name: [lengths.get(dim, 1) for dim in array.dims] for array in arrays}
    lines = {"range": 1e-3 * np.arange(DEPTHS), "line_angle": np.zeros(config.rf.lines)} if group == "rf" else {}
    return {name: np.zeros(shape) for name, shape in shapes.items()} | lines
