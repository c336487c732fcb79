"""True motion, strain and labels at every pixel of every frame."""

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import PixelTruth
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    pixels = pixel_centres(job.config.bmode, job.size)
    tissue = TissueImages(job.config, job.heart, job.plane, *pixels)
    return {f"truth/{job.size}": PixelTruth(job.heart, job.plane, *pixels, tissue)}


if __name__ == "__main__":
    main("truth", work, __doc__)
