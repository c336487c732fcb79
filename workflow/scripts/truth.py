"""True motion, strain and labels at every pixel of every frame."""

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import PixelTruth
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    group, pixels = f"truth/{job.size}", pixel_centres(job.config.bmode, job.size)
    # Of a sweep in which some hearts have neighbours, all have the array.
    has_tissue = job.store.has(f"{group}/tissue")
    tissue = TissueImages(job.config, job.heart, job.plane, *pixels) if has_tissue else None
    return {group: PixelTruth(job.heart, job.plane, *pixels, tissue)}


if __name__ == "__main__":
    main("truth", work, __doc__)
