"""True motion of the points that trackers follow in one view, and of the contours of its wall."""

from echotruth.evaluation.points import ground_truth
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    if job.plane.is_volume:
        from echotruth.evaluation.volume import volume_points  # compiled; slices need none of it

        return {"points": volume_points(job.heart, job.plane, job.config).arrays}
    return {"points": ground_truth(job.heart, job.plane, job.view.plane, job.config).arrays}


if __name__ == "__main__":
    main("points", work, __doc__)
