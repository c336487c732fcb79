"""Place the imaging plane, and seed scatterers."""

from functools import partial

from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import cavity_centroid
from echotruth.imaging.view import imaging_plane
from echotruth.seeds import generator
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    plane = imaging_plane(job.view, config.rf, heart.endo_at_ed)
    scatterers = Sequence(config, heart, plane, partial(generator, job.case, str(job.view_name))).scatterers()
    job.save_scratch(**scatterers)
    centre, number = cavity_centroid(heart, plane), len(scatterers["amplitude"])
    return {"phantom": {"scatterer_count": number, "origin": plane.origin, "axes": plane.axes, "centre": centre}}


if __name__ == "__main__":
    main("phantom", work, __doc__)
