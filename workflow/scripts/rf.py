"""Simulate the RF of every frame of one view, and focus it to lines."""

import numpy as np

from echotruth.imaging.recorder import RfRecorder
from echotruth.imaging.sequence import Sequence
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    sequence, keep = Sequence(job.config, job.heart, job.plane, job.random_of), [*job.config.rf.keep]
    recorder = RfRecorder(keep, sequence.scanner.matrix, len(job.heart.displacement))
    with np.load(job.scatterers) as scatterers:
        lines = sequence.lines(dict(scatterers), recorder)
    np.savez(job.lines, lines=lines, range=sequence.scanner.range)
    return {"rf": recorder.finish(lines)} if keep else {}


if __name__ == "__main__":
    main("rf", work, __doc__)
