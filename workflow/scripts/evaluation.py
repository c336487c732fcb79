"""Score the tracked motion of one view against the motion of the same material points."""

import numpy as np

from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import follow
from echotruth.imaging.view import Plane
from echotruth.repository.job import Job, Result, main
from echotruth.tracking import Wall, evaluate
from echotruth.tracking.clip import places


def work(job: Job) -> Result:
    heart, config = job.heart, job.case.config
    phantom = job.read("phantom", "origin", "axes", "centre")
    result: Result = {}
    largest = config.bmode.sizes[0]
    axial, lateral = pixel_centres(config.bmode, largest)
    points = places(config, largest).round().astype(int)
    position = np.stack([lateral[points[..., 0]], axial[points[..., 1]]], axis=-1)
    truth = follow(heart, Plane(phantom["origin"], phantom["axes"]), position)
    flat = position.reshape(-1, 2)
    labels = (truth[name].ravel() for name in ("layer", "segment"))
    wall = Wall(flat, *labels, phantom["centre"], job.view.plane, heart.layers)
    true = truth["true_displacement"].reshape(-1, len(flat), 2)
    for size in config.bmode.sizes:
        tracked = job.read(f"tracking/{size}", "displacement")["displacement"].reshape(-1, *true.shape)
        scores = [evaluate(each, true, wall, heart.es) for each in tracked]
        gathered = {name: np.stack([score[name] for score in scores]) for name in scores[0] if "polar" not in name}
        result[f"evaluation/{size}"] = truth | gathered
    return result


if __name__ == "__main__":
    main("evaluation", work, __doc__)
