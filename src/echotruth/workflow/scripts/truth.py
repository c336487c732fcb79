"""True motion, strain and labels at every pixel of every frame and image size."""

import logging

import numpy as np

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import Plane
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    heart, bmode = job.heart, job.case.config.bmode
    plane = Plane(**job.read("phantom", "origin", "axes"))
    result: dict[str, dict[str, np.ndarray]] = {}
    for size in bmode.sizes:
        axial, lateral = pixel_centres(bmode, size)
        result[f"truth/{size}"] = pixel_truth(heart, plane, axial, lateral)
        logging.getLogger("echotruth").info("%d px", size)
    return result


if __name__ == "__main__":
    main("truth", work, __doc__)
