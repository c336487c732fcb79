"""Stages of one heart, or of one of its views, carried out by one process.

A process takes longer to start than a short stage takes, and passes arrays on through a scratch folder.
"""

from __future__ import annotations

import argparse
import logging
import shutil
from importlib import import_module
from pathlib import Path

from echotruth.workflow.job import Job, Work, carry_out, open_job, parser, prepare, skipped
from echotruth.workflow.sharing import take_over
from echotruth.workflow.stage_cost import Cost

SCRIPTS = Path(__file__).parent / "scripts"
BEGUN = "begun"
"""Empty file beside records that are made ahead, as long as they are not complete."""
ALONE = "ECHOTRUTH_ALONE"
"""Environment variable with which no stages of other rules are carried out ahead, because their results stand."""
log = logging.getLogger("echotruth")


def command() -> argparse.ArgumentParser:
    """Command line of a series of stages."""
    command = parser("series", __doc__, per_view=False)
    command.add_argument("stages", nargs="+", help="names of scripts in this folder, such as phantom truth rf bmode")
    command.add_argument("--view", help="name of the view, for stages that are run per view")
    command.add_argument("--same-as", metavar="CASE", help="case with the same motion, whose files are taken over")
    command.add_argument(
        "--then", nargs="+", default=[], help="stages of other rules, to be carried out ahead of these"
    )
    command.add_argument("--ahead", type=Path, help="folder for the records of stages that are carried out ahead")
    return command


def run_series(arguments: argparse.Namespace, cost: Cost) -> None:
    """Carry out stages one after the other; those whose results stand already are taken up.

    Parameters
    ----------
    arguments : Namespace
        As parsed by :func:`command`.
    cost : Cost
        Cost counter of this process.
    """
    if arguments.ahead:
        _discard(arguments.ahead)
    jobs = _open(arguments.stages, arguments)
    standing = _standing(jobs)
    for stage, job in jobs.items():
        prepare(job, arguments.threads)
        if skipped(job):
            continue
        if stage in standing:
            log.info("taken up as it stands")
            job.take_up()
        elif stage == "mechanics" and arguments.same_as:
            _share(job, arguments.same_as, cost)
        else:
            carry_out(job, _work(stage), cost)
    if arguments.view is not None:
        job.clear_scratch()


def run_ahead(arguments: argparse.Namespace, cost: Cost) -> None:
    """Carry out the stages of other rules, whose records these rules then only move to the ledger.

    Nothing that happens here concerns the stages that are done: what fails, or ends the process, is run by its rule.
    """
    ahead, begun = arguments.ahead, arguments.ahead / BEGUN
    if begun.exists():
        log.warning("%s: left to their own job, because this one has not finished them", " ".join(arguments.then))
        return
    ahead.mkdir(parents=True)
    begun.touch()
    try:
        for stage, job in _open(arguments.then, arguments).items():
            prepare(job, arguments.threads)
            job.ahead = ahead
            if not skipped(job):
                carry_out(job, _work(stage), cost)
    except (Exception, SystemExit):
        log.exception("%s: left to their own job", " ".join(arguments.then))
    else:
        begun.unlink()


def _discard(ahead: Path) -> None:
    """Delete the records that were made ahead, also those of other settings: what they vouch for is about to change.

    Only the sign that they were begun and not finished stays.
    """
    for folder in ahead.parent.glob("ahead-*"):
        if folder != ahead or not (ahead / BEGUN).exists():
            shutil.rmtree(folder)


def _open(stages: list[str], arguments: argparse.Namespace) -> dict[str, Job]:
    return {stage: open_job(stage, str(SCRIPTS / f"{stage}.py"), arguments) for stage in stages}


def _standing(jobs: dict[str, Job]) -> set[str]:
    """Stages whose results stand; not RF of which the lines are gone, if B-mode must be made from them."""
    standing = {stage for stage, job in jobs.items() if job.stands()}
    if "bmode" in jobs and "bmode" not in standing and "rf" in standing:
        rf = jobs["rf"]
        if not (rf.has_scratch("rf") or "lines" in rf.case.config.rf.keep):
            standing.remove("rf")
    return standing


def _share(job: Job, case: str, cost: Cost) -> None:
    """Take over the result of another case, or that it has none."""
    job.verdict["shared_with"] = case
    carry_out(job, lambda job: take_over(job, case), cost)


def _work(stage: str) -> Work:
    """Work of a stage; its script is imported when it is needed."""
    return import_module(f"echotruth.workflow.scripts.{stage}").work
