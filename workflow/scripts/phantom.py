"""Place the imaging plane, and seed scatterers."""

from echotruth.imaging.sequence import Sequence
from echotruth.imaging.volume_sequence import VolumeSequence
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    sequence = VolumeSequence if job.plane.is_volume else Sequence
    scatterers = sequence(job.config, job.heart, job.plane, job.random_of).scatterers()
    return {"phantom": scatterers | {"origin": job.plane.origin, "axes": job.plane.axes}}


if __name__ == "__main__":
    main("phantom", work, __doc__)
