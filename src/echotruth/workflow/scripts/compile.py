"""Compile and cache the functions that the stages of a view call, by running the stages on a miniature."""

import argparse
import fcntl
import logging
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np
from cases import lay_out

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.mechanics.prescribed import prescribed_motion
from echotruth.workflow import lease
from echotruth.workflow.assignment import single
from echotruth.workflow.compiled import CACHE_GROUPS
from echotruth.workflow.job import parser, run
from echotruth.workflow.miniature import miniature
from echotruth.workflow.stage_cost import Cost

STAGES = CACHE_GROUPS["view"]


def image_all_ranges(config: Config) -> None:
    """Image scatterers at all ranges: those near the array have other kernels, and the heart may have none there."""
    depth = imaging_depth(config.rf, config.bmode)
    position = np.stack([np.zeros(100), np.linspace(0.01, 1, 100) * depth, np.zeros(100)], axis=1)
    Scanner(config.probe, config.rf, depth).lines(position, np.ones(100))


def run_miniature(path: Path) -> None:
    config = miniature(single(load(path)))
    with tempfile.TemporaryDirectory() as repository:
        cases = expand(config)
        lay_out(Path(repository), config, cases)
        cost, case = Cost(), [repository, cases[0].id]
        arguments = parser("mechanics", None, False).parse_args(case)
        run("mechanics", lambda job: prescribed_motion(job.case.config), arguments, cost)
        image_all_ranges(config)
        for view in config.views:
            arguments = parser("view", None).parse_args([*case, view])
            for stage in STAGES:
                run(stage, import_module(stage).work, arguments, cost)


def main() -> None:
    command = argparse.ArgumentParser(description=__doc__)
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    command.add_argument("mark", type=Path, help="empty file written at the end; if it exists, nothing is done")
    command.add_argument("--config", type=Path, help="file with the configuration (default: config.yaml there)")
    arguments = command.parse_args()
    try:
        lease.follow(arguments.repository)
    except lease.LeaseError as error:
        sys.exit(str(error))
    arguments.mark.parent.mkdir(parents=True, exist_ok=True)
    with arguments.mark.with_suffix(".lock").open("w") as lock:
        # A second process waits here, and then finds the functions compiled.
        fcntl.flock(lock, fcntl.LOCK_EX)
        if arguments.mark.exists():
            return
        try:
            run_miniature(arguments.config or arguments.repository / "config.yaml")
        except (Exception, SystemExit):
            logging.getLogger("echotruth").exception("the miniature failed: every job compiles its functions itself")
        arguments.mark.touch()


if __name__ == "__main__":
    main()
