"""Simulate the RF of every frame of one view, and focus it to lines."""

from echotruth.imaging.recorder import RfRecorder
from echotruth.imaging.sequence import Sequence
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    sequence = Sequence(job.config, job.heart, job.plane, job.random_of)
    keep: list[str] = [*job.config.rf.keep]
    recorder = RfRecorder(keep, sequence.scanner.matrix, len(job.heart.displacement))
    lines = sequence.lines(job.passed_on(job.scatterers), recorder)
    job.pass_on(job.lines, {"lines": lines, "range": sequence.scanner.range})
    return {"rf": recorder.finish(lines)} if keep else {}


if __name__ == "__main__":
    main("rf", work, __doc__)
