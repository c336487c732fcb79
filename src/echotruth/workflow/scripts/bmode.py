"""Convert the RF lines of one clip to B-mode: envelope, gain, log compression, scan conversion, downsampling."""

from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import bmode_clip, time_gain_compensation
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    config = job.case.config
    # Lines that are kept need not be simulated again for other images of them.
    kept = "lines" in config.rf.keep and not job.has_scratch("rf")
    rf = job.read("rf", "lines") | job.coordinates("rf", "range") if kept else job.load_scratch("rf")
    gain = time_gain_compensation(config.probe, config.bmode, rf["range"])
    images = bmode_clip(rf["lines"], scan_lines(config.probe, config.rf), rf["range"], config.bmode, gain)
    return {f"bmode/{size}": {"image": image} for size, image in images.items()}


if __name__ == "__main__":
    main("bmode", work, __doc__)
