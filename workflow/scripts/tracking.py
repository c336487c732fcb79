"""Track the clips of one view with one tracker, in all sizes, and score what it finds against the truth."""

from collections.abc import Iterator
from typing import Any

from echotruth.evaluation.clip import Clip, make_clip
from echotruth.evaluation.points import stored_truth
from echotruth.evaluation.scoring import Estimate, estimated, scored
from echotruth.imaging.labels import unpack
from echotruth.repository.datasets import as_stored
from echotruth.repository.scores import packed
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    settings = job.config.tracking.trackers[str(job.tracker)]
    clips = list((_volumes if job.config.has_volumes else _slices)(job))
    found = [estimated(clip, settings) for clip in clips]
    job.notes["settings"] = settings.model_dump(mode="json")
    job.notes["failures"] = {str(clip.size): why for clip, (_, why) in zip(clips, found, strict=True) if why}
    estimates = [estimate for estimate, _ in found]
    # Only now, so that a tracker does not find the truth in its process.
    score = _scored_volumes if job.config.has_volumes else _scored_slices
    return {f"tracking/{job.tracker}": score(job, clips, estimates)}


def _slices(job: Job) -> Iterator[Clip]:
    inside = job.read("points", "layer")["layer"] > 0
    for size in job.config.bmode.sizes:
        image = job.read(f"bmode/{size}", "image")["image"]
        labels = job.read(f"truth/{size}", "labels")["labels"]
        yield make_clip(job.case, str(job.view_name), image, labels[0], inside)


def _volumes(job: Job) -> Iterator[Any]:
    from echotruth.evaluation.volume import VolumeClip  # compiled; slices need none of it

    labels = job.read("truth/volume", "labels")["labels"][0]
    yield VolumeClip(job.case, str(job.view_name), job.read("bmode/volume")["image"], unpack(labels, 3)["mask"])


def _scored_slices(job: Job, clips: list[Clip], found: list[Estimate]) -> dict[str, Any]:
    truth = stored_truth(job.read("points"), job.view.plane, job.config)
    arrays = scored(clips, truth, found)
    return arrays | {"scores": packed(arrays)}


def _scored_volumes(job: Job, clips: list[Any], found: list[Estimate]) -> dict[str, Any]:
    from echotruth.evaluation.volume import VolumePoints, metrics, strain_radius

    (clip,), (estimate,) = clips, found
    arrays = as_stored(job.case, {"tracking/TRACKER": clip.arrays(*estimate)})["tracking/TRACKER"]
    points = VolumePoints(job.heart, job.plane, clip.positions, strain_radius(job.config))
    scores = metrics(arrays["displacement"], points, job.heart.es)
    return arrays | {"score": list(scores), "scores": list(scores.values())}


if __name__ == "__main__":
    main("tracking", work, __doc__)
