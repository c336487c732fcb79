"""FE update: geometry, fibres, mechanics and kinematics of one heart through its loop, or by its formula."""

from echotruth.loop.cycle import LoopError
from echotruth.mechanics.beat import beat
from echotruth.mechanics.fibres import FibreError
from echotruth.mechanics.geometry import GeometryError
from echotruth.mechanics.pathology import PathologyError
from echotruth.mechanics.prescribed import MotionError, prescribed
from echotruth.mechanics.solver.newton import Diverged
from echotruth.workflow.job import CannotBeMade, Job, Result, main


def work(job: Job) -> Result:
    config = job.case.config
    try:
        return beat(config, job.unfinished) if config.motion.kind == "beat" else prescribed(config)
    except (Diverged, FibreError, GeometryError, LoopError, MotionError, PathologyError) as error:
        raise CannotBeMade(str(error)) from error


if __name__ == "__main__":
    main("mechanics", work, __doc__, per_view=False)
