"""Convert lines to the largest B-mode clip, or reduce that to a smaller size."""

import numpy as np

from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import clip_gain, downsample, largest_clip
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    config, largest = job.config, job.config.bmode.sizes[0]
    if job.size < largest:
        image = downsample(job.read(f"bmode/{largest}", "image")["image"], largest // job.size)
        return {f"bmode/{job.size}": {"image": image}}
    lines, depth = kept_lines(job) if "lines" in config.rf.keep else passed_lines(job)
    gain = clip_gain(config.probe, config.bmode, lines.shape[1], depth, job.random_of("dropout"))
    image = largest_clip(lines, scan_lines(config.probe, config.rf), depth, config.bmode, gain)
    return {f"bmode/{job.size}": {"image": image}}


def kept_lines(job: Job) -> tuple[np.ndarray, np.ndarray]:
    return job.read("rf", "lines")["lines"], job.coordinates("rf", "range")["range"]


def passed_lines(job: Job) -> tuple[np.ndarray, np.ndarray]:
    passed = job.passed_on(job.lines)
    return passed["lines"], passed["range"]


if __name__ == "__main__":
    main("bmode", work, __doc__)
