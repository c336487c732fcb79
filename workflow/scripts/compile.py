"""Compile what the jobs of a group of stages call, by doing their work on a miniature; the cache keeps it for them."""

import argparse
import fcntl
import logging
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np
from cases import lay_out

from echotruth.cases import expand, generator
from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.mechanics.prescribed import prescribed
from echotruth.workflow.cost import Cost
from echotruth.workflow.job import Job, Result, parser, run
from echotruth.workflow.miniature import miniature

STAGES = {"imaging": ("phantom", "truth", "rf", "bmode"), "tracking": ("phantom", "truth", "tracking", "evaluation")}
"""Group to the stages that are done on the miniature; the images that are tracked are noise."""


def images(job: Job) -> Result:
    config, random = job.case.config, generator(job.case, str(job.view_name), "bmode")
    size = config.bmode.size_px
    return {f"bmode/{size}": {"image": random.integers(256, size=(config.loop.frames, size, size), dtype=np.uint8)}}


def image_all_ranges(config: Config) -> None:
    """Scatterers from close before the array on: those have kernels of another kind, and the heart may have none."""
    depth = imaging_depth(config.rf, config.bmode)
    position = np.stack([np.zeros(100), np.linspace(0.01, 1, 100) * depth, np.zeros(100)], axis=1)
    Scanner(config.probe, config.rf, depth).lines(position, np.ones(100))


def work(group: str, folder: Path) -> None:
    config = miniature(expand(load(folder / "config.yaml"))[0].config)
    with tempfile.TemporaryDirectory() as place:
        cases = expand(config)
        lay_out(Path(place), config, cases)
        cost, words = Cost(), [place, cases[0].id]
        run(
            "mechanics",
            lambda job: prescribed(job.case.config),
            parser("mechanics", None, False).parse_args(words),
            cost,
        )
        if group == "imaging":
            image_all_ranges(config)
        for view in config.views:
            arguments = parser(group, None).parse_args([*words, view])
            if group == "tracking":
                run("bmode", images, arguments, cost)
            for stage in STAGES[group]:
                run(stage, import_module(stage).work, arguments, cost)


def main() -> None:
    command = argparse.ArgumentParser(description=__doc__)
    command.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
    command.add_argument("group", choices=STAGES)
    command.add_argument("mark", type=Path, help="empty file that tells that it is done; nothing is, where it is there")
    arguments = command.parse_args()
    arguments.mark.parent.mkdir(parents=True, exist_ok=True)
    with arguments.mark.with_suffix(".lock").open("w") as lock:
        # Whoever comes second waits, and finds it done.
        fcntl.flock(lock, fcntl.LOCK_EX)
        if arguments.mark.exists():
            return
        try:
            work(arguments.group, arguments.repository)
        except (Exception, SystemExit):
            logging.getLogger("echotruth").exception("the miniature fails: every job compiles for itself")
        arguments.mark.touch()


if __name__ == "__main__":
    main()
