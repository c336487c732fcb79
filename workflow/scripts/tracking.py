"""Track the clips of one view, at every image size, with every tracker."""

import numpy as np

from echotruth.repository.job import Job, Result, main
from echotruth.tracking import grid, track


def work(job: Job) -> Result:
    config = job.case.config
    result: Result = {}
    for size in config.bmode.sizes:
        frames = job.read(f"bmode/{size}")["image"]
        points = grid((size, size), config.tracking.grid_px)
        spacing = config.bmode.si().field_of_view / size
        trackers = config.tracking.trackers.values()
        clips = [track(frames, points.reshape(-1, 2), tracker, spacing) for tracker in trackers]
        shape = (len(clips), len(frames), *points.shape[:2])
        result[f"tracking/{size}"] = {
            "displacement": np.stack([displacement for displacement, _ in clips]).reshape(*shape, 2),
            "quality": np.stack([quality for _, quality in clips]).reshape(shape),
        }
    return result


if __name__ == "__main__":
    main("tracking", work, __doc__)
