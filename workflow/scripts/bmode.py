"""Envelope, gain, log compression, scan conversion and downsampling of one clip."""

from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import clip, time_gain
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    rf, config = job.take("rf"), job.case.config
    gain = time_gain(config.probe, config.bmode, rf["range"])
    images = clip(rf["lines"], scan_lines(config.probe, config.rf), rf["range"], config.bmode, gain)
    return {f"bmode/{size}": {"image": image} for size, image in images.items()}


if __name__ == "__main__":
    main("bmode", work, __doc__)
