"""Score the tracked motion of one view against the motion of the same material points."""

import numpy as np

from echotruth.evaluation.scoring import ground_truth, score
from echotruth.imaging.view import Plane
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    plane = Plane(**job.read("phantom", "origin", "axes"))
    truth = ground_truth(job.heart, plane, job.view.plane, job.case.config)
    tracked = job.read("tracking", "displacement")["displacement"]
    scores = [[score(displacement, truth) for displacement in of_size] for of_size in tracked]
    stacked = {name: np.array([[found[name] for found in of_size] for of_size in scores]) for name in scores[0][0]}
    return {"evaluation": truth.arrays | stacked}


if __name__ == "__main__":
    main("evaluation", work, __doc__)
