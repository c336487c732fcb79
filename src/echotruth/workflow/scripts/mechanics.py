"""Geometry, fibres, mechanics and kinematics of one heart: solved through its loop, by a formula, or from files."""

from echotruth.loop.recording import LoopError
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.fibres import FibreError
from echotruth.mechanics.geometry import GeometryError
from echotruth.mechanics.pathology import PathologyError
from echotruth.mechanics.prescribed import MotionError
from echotruth.mechanics.solver.newton import Diverged
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    try:
        return simulate(job.case.config, job.checkpoint_folder)
    except (Diverged, FibreError, GeometryError, LoopError, MotionError, PathologyError) as error:
        raise CaseFailed(str(error)) from error


if __name__ == "__main__":
    main("mechanics", work, __doc__, per_view=False)
