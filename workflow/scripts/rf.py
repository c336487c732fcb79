"""RF simulation: the beamformed lines of every frame of one view."""

import logging

import numpy as np

from echotruth.imaging.phantom import Scatterers
from echotruth.imaging.scanner import Scanner, imaging_depth
from echotruth.imaging.view import Plane
from echotruth.repository.job import Job, Result, main
from echotruth.tetrahedra import MaterialPoints


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    plane = Plane(**job.read("phantom", "origin", "axes"))
    seeded = job.take("phantom")
    points = MaterialPoints(seeded["cell"], seeded["xi"])
    scatterers = Scatterers(points, seeded["amplitude"], config.phantom.in_plane_only)
    scanner = Scanner(config.probe, config.rf, imaging_depth(config.rf, config.bmode))
    lines = []
    for frame in range(len(heart.displacement)):
        places = scatterers.image(heart.positions(frame), heart.cells, plane)
        lines.append(scanner.lines(places, scatterers.amplitude))
        logging.getLogger("echotruth").info("frame %d of %d", frame + 1, len(heart.displacement))
    job.hand_on(lines=np.stack(lines), angle=scanner.angle, range=scanner.range)
    return {}


if __name__ == "__main__":
    main("rf", work, __doc__)
