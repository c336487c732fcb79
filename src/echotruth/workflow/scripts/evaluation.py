"""Score the tracked motion of one view against the motion of the same material points."""

import numpy as np

from echotruth.evaluation.scoring import ground_truth, score
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    truth = ground_truth(job)
    result: dict[str, dict[str, np.ndarray]] = {}
    for size in job.case.config.bmode.sizes:
        tracked = job.read(f"tracking/{size}", "displacement")["displacement"]
        scores = [score(displacement, truth) for displacement in tracked]
        stacked = {name: np.stack([arrays[name] for arrays in scores]) for name in scores[0]}
        result[f"evaluation/{size}"] = truth.arrays | stacked
    return result


if __name__ == "__main__":
    main("evaluation", work, __doc__)
