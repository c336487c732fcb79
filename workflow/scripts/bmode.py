"""Convert lines to the B-mode clip of the largest size, and reduce that to the smaller ones."""

from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import bmode_clip, clip_gain
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    config, lines, range_ = job.config, job.read("rf", "lines")["lines"], job.coordinate("rf", "range")
    gain = clip_gain(config.probe, config.bmode, lines.shape[:2], range_, job.random_of("dropout"))
    scan, is_closed = scan_lines(config.probe, config.rf), job.view.motion.is_closed
    clips = bmode_clip(lines, scan, range_, config.bmode, gain, is_closed)
    return {f"bmode/{size}": {"image": clip} for size, clip in clips.items()}


if __name__ == "__main__":
    main("bmode", work, __doc__)
