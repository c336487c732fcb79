"""Measure a heart, and mark a solved one where it is out of bounds."""

import logging

from echotruth.mechanics.physiology import measures, verdict
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    geometry = job.read("geometry", "node_position", "endo")
    kinematics = job.read("kinematics", "strain_mean", "volume_ratio_min")
    found = measures(geometry, job.read("mechanics"), kinematics)
    solved = job.case.config.motion.kind == "beat"  # what moves by a formula is no heart, and need not behave like one
    if solved and (reason := verdict(found, job.case.config.physiology)):
        job.mark("implausible", reason)
        logging.getLogger("echotruth").warning("implausible: %s", reason)
    return {"physiology": found}


if __name__ == "__main__":
    main("physiology", work, __doc__, per_view=False)
