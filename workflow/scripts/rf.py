"""Simulate the RF of every frame of one view, and focus it to lines, or at every voxel of a volume."""

from echotruth.imaging.recorder import RfRecorder, sixteen_bit
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.volume_sequence import VolumeSequence
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    if job.plane.is_volume:
        volumes = VolumeSequence(job.config, job.heart, job.plane, job.random_of)
        return {"rf": volumes.volumes(job.read("phantom"))}
    sequence = Sequence(job.config, job.heart, job.plane, job.random_of)
    recorder = RfRecorder(job.config, sequence.scanner, len(job.heart.displacement))
    lines = sequence.lines(job.read("phantom"), recorder)
    job.notes |= recorder.settings
    return {"rf": {"lines": sixteen_bit(lines)} | recorder.arrays}


if __name__ == "__main__":
    main("rf", work, __doc__)
