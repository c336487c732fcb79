"""Track the clips of one view, at every image size, with every tracker."""

import logging

import numpy as np

from echotruth.evaluation.clip import Clip, clips
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    result: Result = {}
    for size, clip in clips(job).items():
        estimates = [_track(job, name, clip) for name in job.case.config.tracking.trackers]
        displacement, quality = zip(*estimates, strict=True)
        result[f"tracking/{size}"] = {"displacement": np.stack(displacement), "quality": np.stack(quality)}
        logging.getLogger("echotruth").info("%d px", size)
    return result


def _track(job: Job, name: str, clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and quality of one tracker; if it fails, no estimate, and the reason in the record."""
    try:
        return clip.on_grid(*track(*clip.tracker_arguments, job.case.config.tracking.trackers[name]))
    except TrackerFailed as error:
        logging.getLogger("echotruth").warning("%s at %d px: %s", name, clip.size, error)
        job.verdict.setdefault("failures", {})[f"{name}/{clip.size}"] = str(error)
        return clip.on_grid(*clip.no_estimate)


if __name__ == "__main__":
    main("tracking", work, __doc__)
