"""Place the imaging plane, and seed scatterers."""

from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import cavity_centroid
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    scatterers = Sequence(job.config, job.heart, job.plane, job.random_of).scatterers()
    job.pass_on(job.scatterers, scatterers)
    count, centre = len(scatterers["amplitude"]), cavity_centroid(job.heart, job.plane)
    return {"phantom": {"scatterer_count": count, "origin": job.plane.origin, "axes": job.plane.axes, "centre": centre}}


if __name__ == "__main__":
    main("phantom", work, __doc__)
