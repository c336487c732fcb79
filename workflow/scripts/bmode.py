"""Envelope, log compression, scan conversion and downsampling of one clip."""

from echotruth.imaging.bmode import clip
from echotruth.repository.job import Job, Result, main


def work(job: Job) -> Result:
    rf = job.take("rf")
    images = clip(rf["lines"], rf["angle"], rf["range"], job.case.config.bmode)
    return {f"bmode/{size}": {"image": image} for size, image in images.items()}


if __name__ == "__main__":
    main("bmode", work, __doc__)
