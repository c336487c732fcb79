"""Track the clips of one view with one tracker, in all sizes, and score what it finds against the truth."""

from echotruth.evaluation.clip import clips_of
from echotruth.evaluation.points import stored_truth
from echotruth.evaluation.scoring import estimated, scored
from echotruth.repository.scores import packed
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    settings, clips = job.config.tracking.trackers[str(job.tracker)], clips_of(job.case, str(job.view_name), job.read)
    found = [estimated(clip, settings) for clip in clips]
    job.notes["settings"] = settings.model_dump(mode="json")
    job.notes["failures"] = {str(clip.size): why for clip, (_, why) in zip(clips, found, strict=True) if why}
    # Only now, so that a tracker does not find the truth in its process.
    if job.config.has_volumes:
        from echotruth.evaluation.volume import scored_volumes  # compiled; slices need none of it

        return {f"tracking/{job.tracker}": scored_volumes(clips[0], found[0][0], job.heart, job.plane)}
    truth = stored_truth(job.read("points"), job.view.plane, job.config)
    arrays = scored(clips, truth, [estimate for estimate, _ in found])
    return {f"tracking/{job.tracker}": arrays | {"scores": packed(arrays)}}


if __name__ == "__main__":
    main("tracking", work, __doc__)
