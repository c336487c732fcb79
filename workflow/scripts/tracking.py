"""Track one clip with every tracker, and score what they find against the truth."""

from echotruth.evaluation.clip import make_clip
from echotruth.evaluation.scoring import ground_truth, score
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job, Result, main
from echotruth.workflow.tracks import Tracks


def work(job: Job) -> Result:
    truth = ground_truth(job.heart, job.plane, job.view.plane, job.config)
    image, labels = job.read(f"bmode/{job.size}")["image"], job.read(f"truth/{job.size}", "labels")["labels"]
    tracks = Tracks(job, make_clip(job.case, str(job.view_name), image, labels[0], truth.inside), track)
    groups = {f"evaluation/{job.size}": truth.arrays}
    for name in job.config.tracking.trackers:
        displacement, quality = tracks.of(name)
        groups[f"tracking/{job.size}/{name}"] = {"displacement": displacement, "quality": quality}
        groups[f"evaluation/{job.size}/{name}"] = score(displacement, truth)
    job.note(made_from=tracks.made_from, failures=tracks.failures)
    return groups


if __name__ == "__main__":
    main("tracking", work, __doc__)
