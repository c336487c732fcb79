"""Convert lines to the B-mode clip of the largest size, and reduce that to the smaller ones; or convert volumes."""

from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import bmode_clip, clip_gain, time_gain_compensation, volume_images
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    config, is_closed = job.config, job.view.motion.is_closed
    if config.has_volumes:
        gain = time_gain_compensation(config.probe, config.bmode, job.coordinate("rf", "axial"))
        found = job.read("rf", "volumes", "volumes_step")
        images = volume_images(found["volumes"], found["volumes_step"], gain, config.bmode, is_closed)
        return {"bmode/volume": {"image": images}}
    lines, range_ = job.read("rf", "lines")["lines"], job.coordinate("rf", "range")
    gain = clip_gain(config.probe, config.bmode, lines.shape[:2], range_, job.random_of("dropout"))
    clips = bmode_clip(lines, scan_lines(config.probe, config.rf), range_, config.bmode, gain, is_closed)
    return {f"bmode/{size}": {"image": clip} for size, clip in clips.items()}


if __name__ == "__main__":
    main("bmode", work, __doc__)
