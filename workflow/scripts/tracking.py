"""Track one clip with every tracker, and score what they find against the truth."""

from echotruth.evaluation.scoring import ground_truth, score
from echotruth.workflow.job import Job, Result, main
from echotruth.workflow.tracks import Tracks, clip_of


def work(job: Job) -> Result:
    truth = ground_truth(job.heart, job.plane, job.view.plane, job.config)
    tracks, groups = Tracks(job, clip_of(job, truth.inside)), {f"evaluation/{job.size}": truth.arrays}
    for name in job.config.tracking.trackers:
        displacement, quality = tracks.of(name)
        groups[f"tracking/{job.size}/{name}"] = {"displacement": displacement, "quality": quality}
        groups[f"evaluation/{job.size}/{name}"] = score(displacement, truth)
    job.note(made_from=tracks.made_from, failures=tracks.failures)
    return groups


if __name__ == "__main__":
    main("tracking", work, __doc__)
