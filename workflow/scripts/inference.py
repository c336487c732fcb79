"""Infer the muscle of one heart from what a tracker saw of it."""

from echotruth.inference.laplace import NoMode
from echotruth.inference.observation import ObservationError
from echotruth.inference.stored import stored
from echotruth.inference.tracker_errors import NoErrors
from echotruth.loop.recording import LoopError
from echotruth.mechanics.fibres import FibreError
from echotruth.mechanics.geometry import GeometryError
from echotruth.mechanics.solver.newton import Diverged
from echotruth.repository.reader import Repository
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.job import Job, Result, main

NO_RESULT = (NoErrors, NoMode, ObservationError, Diverged, FibreError, GeometryError, LoopError)


def work(job: Job) -> Result:
    try:
        return stored(Repository(job.folder), job.case)
    except NO_RESULT as error:
        raise CaseFailed(str(error)) from error


if __name__ == "__main__":
    main("inference", work, __doc__)
