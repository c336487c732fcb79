"""True motion, strain and labels at every pixel of every frame, in all sizes."""

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import PixelTruth
from echotruth.repository.datasets import source_of
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    found = {}
    job.notes |= source_of(job.solved, job.plane)
    for size in job.config.bmode.sizes:
        pixels = pixel_centres(job.config.bmode, size)
        tissue = TissueImages(job.config, job.heart, job.plane, *pixels)
        found[f"truth/{size}"] = PixelTruth(job.heart, job.plane, *pixels, tissue)
    return found


if __name__ == "__main__":
    main("truth", work, __doc__)
