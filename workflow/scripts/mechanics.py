"""Solve one heart: geometry, fibres, pathology, mechanics, kinematics and physiology."""

from echotruth.loop.recording import LoopError
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.fibres import FibreError
from echotruth.mechanics.geometry import GeometryError
from echotruth.mechanics.pathology import PathologyError
from echotruth.mechanics.physiology import measured_heart
from echotruth.mechanics.prescribed import MotionError
from echotruth.mechanics.solver.newton import Diverged
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.job import Job, Result, main

NO_SOLUTION = (Diverged, FibreError, GeometryError, LoopError, MotionError, PathologyError)


def work(job: Job) -> Result:
    try:
        groups = simulate(job.config)
    except NO_SOLUTION as error:
        raise CaseFailed(str(error)) from error
    measures, job.notes["bounded"] = measured_heart(groups, job.config)
    return groups | {"physiology": measures}


if __name__ == "__main__":
    main("mechanics", work, __doc__)
