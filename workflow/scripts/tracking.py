"""Track one clip with every tracker, and score what they find against the truth."""

from echotruth.evaluation.clip import clip_at, grid_positions
from echotruth.evaluation.scoring import score, truth_at
from echotruth.workflow.job import Job, Result, main
from echotruth.workflow.tracks import Tracks


def work(job: Job) -> Result:
    truth = truth_at(job.heart, job.plane, job.view.plane, grid_positions(job.config), job.config)
    tracks, groups = Tracks(job, clip_at(job, truth.inside)), {f"evaluation/{job.size}": truth.arrays}
    for name in job.config.tracking.trackers:
        displacement, quality = tracks.of(name)
        groups[f"tracking/{job.size}/{name}"] = {"displacement": displacement, "quality": quality}
        groups[f"evaluation/{job.size}/{name}"] = score(displacement, truth)
    job.note(made_from=tracks.made_from, failures=tracks.failures)
    return groups


if __name__ == "__main__":
    main("tracking", work, __doc__)
