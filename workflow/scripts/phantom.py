"""Scatterer seeding: place the probe, and scatterers in the wall."""

from echotruth.imaging.phantom import scatter
from echotruth.imaging.truth import cavity_centre
from echotruth.imaging.view import plane
from echotruth.repository.job import Job, Result, main


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    where = plane(job.view, config.rf, heart.positions(0)[heart.endo.ravel()])
    scatterers = scatter(config, heart, where, job.random)
    job.hand_on(cell=scatterers.points.cell, xi=scatterers.points.xi, amplitude=scatterers.amplitude)
    centre = cavity_centre(heart, where)
    phantom = {"scatterers": len(scatterers.points), "origin": where.origin, "axes": where.axes, "centre": centre}
    return {"phantom": phantom}


if __name__ == "__main__":
    main("phantom", work, __doc__)
