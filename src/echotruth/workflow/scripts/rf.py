"""Simulate the RF of every frame of one view, and focus it to lines."""

from functools import partial

from echotruth.imaging.recorder import RfRecorder
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import Plane
from echotruth.seeds import generator
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    plane = Plane(**job.read("phantom", "origin", "axes"))
    sequence = Sequence(config, heart, plane, partial(generator, job.case, str(job.view_name)))
    # If the phantom was taken up from an earlier run, its scatterers are drawn again.
    scatterers = job.load_scratch("phantom") if job.has_scratch("phantom") else sequence.scatterers()
    recorder = RfRecorder([*config.rf.keep], sequence.scanner.matrix, len(heart.displacement))
    lines = sequence.lines(scatterers, recorder)
    job.save_scratch(lines=lines, angle=sequence.scanner.angle, range=sequence.scanner.range)
    return {"rf": recorder.finish(lines)} if config.rf.keep else {}


if __name__ == "__main__":
    main("rf", work, __doc__)
