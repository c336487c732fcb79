"""Measure a heart, and mark a solved heart that is outside the bounds."""

import logging

from numpy.typing import ArrayLike

from echotruth.loop.cycle import read_loop
from echotruth.mechanics.physiology import measures, violated_bound
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    kinematics = job.read("kinematics", "strain_mean", "layer_strain", "volume_ratio_min")
    depth = job.read("fibres", "wall_depth")["wall_depth"]
    mechanics = job.read("mechanics") | {"time": read_loop(job.case.config.loop).time}
    measured: dict[str, ArrayLike] = {**measures(job.read("geometry"), mechanics, kinematics, depth)}
    solved = job.case.config.motion.kind == "beat"  # the bounds do not apply to prescribed motions
    healthy = not job.read("pathology", "region")["region"].any()
    judged = measured | {"active_tension": mechanics["active_tension"]}
    if solved and (reason := violated_bound(judged, job.case.config.physiology, healthy)):
        job.set_verdict("implausible", reason)
        logging.getLogger("echotruth").warning("implausible: %s", reason)
    return {"physiology": measured}


if __name__ == "__main__":
    main("physiology", work, __doc__, per_view=False)
