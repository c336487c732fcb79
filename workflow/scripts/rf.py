"""RF simulation: the beamformed lines of every frame of one view."""

import logging
from functools import partial

import numpy as np

from echotruth.cases import generator
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.medium.medium import Medium
from echotruth.imaging.rf.acquisition import Acquisition
from echotruth.imaging.rf.recorder import Kept
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    plane = Plane(**job.read("phantom", "origin", "axes"))
    random, time = partial(generator, job.case, job.view_name), read_loop(config.loop).time
    medium = Medium(config, heart, plane, time=time, seeded=job.take("phantom"), random=random)
    scanner = Scanner(config.probe, config.rf, imaging_depth(config.rf, config.bmode))
    acquire = Acquisition(config, scanner, medium, random)
    lines, kept = [], Kept(config.rf.keep, scanner.matrix, len(heart.displacement))
    for frame in range(len(heart.displacement)):
        matrix = acquire(frame)
        kept.add(frame, matrix)
        lines.append(scanner.beamform(matrix))
        logging.getLogger("echotruth").info("frame %d of %d", frame + 1, len(heart.displacement))
    job.hand_on(lines=np.stack(lines), angle=scanner.angle, range=scanner.range)
    return {"rf": kept.finish(np.stack(lines))} if config.rf.keep else {}


if __name__ == "__main__":
    main("rf", work, __doc__)
