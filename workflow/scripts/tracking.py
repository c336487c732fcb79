"""Track one clip with every tracker, and score what they find against the truth."""

from echotruth.evaluation.clip import make_clip
from echotruth.evaluation.scoring import ground_truth, scored
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    truth = ground_truth(job.heart, job.plane, job.view.plane, job.config)
    image = job.read(f"bmode/{job.size}", "image")["image"]
    labels = job.read(f"truth/{job.size}", "labels")["labels"]
    clip = make_clip(job.case, str(job.view_name), image, labels[0], truth.inside)
    trackers = job.config.tracking.trackers
    found, job.notes["failures"] = scored(clip, truth, trackers)
    return {f"tracking/{job.size}": truth.arrays | found | {"tracker": list(trackers)}}


if __name__ == "__main__":
    main("tracking", work, __doc__)
