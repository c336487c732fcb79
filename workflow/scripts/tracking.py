"""Track the clips of one view with one tracker, in all sizes, and score what it finds against the truth."""

from echotruth.evaluation.clip import make_clip
from echotruth.evaluation.points import stored_truth
from echotruth.evaluation.scoring import estimated, scored
from echotruth.repository.scores import packed
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    settings, inside = job.config.tracking.trackers[str(job.tracker)], job.read("points", "layer")["layer"] > 0
    clips = []
    for size in job.config.bmode.sizes:
        image = job.read(f"bmode/{size}", "image")["image"]
        labels = job.read(f"truth/{size}", "labels")["labels"]
        clips.append(make_clip(job.case, str(job.view_name), image, labels[0], inside))
    found = [estimated(clip, settings) for clip in clips]
    job.notes["settings"] = settings.model_dump(mode="json")
    job.notes["failures"] = {str(clip.size): why for clip, (_, why) in zip(clips, found, strict=True) if why}
    # Only now, so that a tracker does not find it in its process.
    truth = stored_truth(job.read("points"), job.view.plane, job.config)
    arrays = scored(clips, truth, [estimate for estimate, _ in found])
    return {f"tracking/{job.tracker}": arrays | {"scores": packed(arrays)}}


if __name__ == "__main__":
    main("tracking", work, __doc__)
