"""Scatterer seeding: place the probe, and scatterers in the wall."""

from functools import partial

from echotruth.cases import generator
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.medium.medium import seed
from echotruth.imaging.truth import cavity_centre
from echotruth.imaging.view import plane
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    where = plane(job.view, config.rf, heart.positions(0)[heart.endo.ravel()])
    scanner = Scanner(config.probe, config.rf, imaging_depth(config.rf, config.bmode))
    seeded = seed(config, heart, where, partial(generator, job.case, job.view_name), scanner.matrix.in_beam)
    job.hand_on(**seeded)
    centre = cavity_centre(heart, where)
    phantom = {"scatterers": len(seeded["amplitude"]), "origin": where.origin, "axes": where.axes, "centre": centre}
    return {"phantom": phantom}


if __name__ == "__main__":
    main("phantom", work, __doc__)
