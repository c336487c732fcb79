"""True motion, strain and labels at every pixel of every frame."""

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import PixelTruth
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    return {f"truth/{job.size}": PixelTruth(job.heart, job.plane, *pixel_centres(job.config.bmode, job.size))}


if __name__ == "__main__":
    main("truth", work, __doc__)
