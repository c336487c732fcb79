"""Measure a heart, and mark a solved heart that is outside the bounds."""

import logging

from echotruth.mechanics.physiology import measures, violated_bound
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    geometry = job.read("geometry", "node_position", "endo")
    kinematics = job.read("kinematics", "strain_mean", "volume_ratio_min")
    measured = measures(geometry, job.read("mechanics"), kinematics)
    solved = job.case.config.motion.kind == "beat"  # the bounds do not apply to prescribed motions
    if solved and (reason := violated_bound(measured, job.case.config.physiology)):
        job.set_verdict("implausible", reason)
        logging.getLogger("echotruth").warning("implausible: %s", reason)
    return {"physiology": measured}


if __name__ == "__main__":
    main("physiology", work, __doc__, per_view=False)
