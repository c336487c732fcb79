"""Track the clips of one view, at every image size, with every tracker; what stands already is taken over."""

import logging

import numpy as np

from echotruth.evaluation.clip import Clip, clips
from echotruth.evaluation.pieces import ARRAYS, Piece, Pieces, fingerprint, known, order
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    trackers, earlier = job.case.config.tracking.trackers, Pieces(job)
    pieces: dict[int, dict[str, Piece]] = {}
    for size, clip in clips(job).items():
        pieces[size] = {name: _piece(job, name, clip, earlier) for name in trackers}
        logging.getLogger("echotruth").info("%d px", size)
    job.remember(pieces=known(pieces), order=order(pieces), index=list(job.index))
    return {"tracking": {name: _stacked(pieces, name) for name in ARRAYS}}


def _stacked(pieces: dict[int, dict[str, Piece]], name: str) -> np.ndarray:
    """An array of all pieces, (size, tracker, ...)."""
    return np.stack([np.stack([getattr(piece, name) for piece in made.values()]) for made in pieces.values()])


def _piece(job: Job, name: str, clip: Clip, earlier: Pieces) -> Piece:
    """What a tracker found before; else what it finds now, or no estimate, and the reason in the record."""
    tracker = job.case.config.tracking.trackers[name]
    made_from = fingerprint(tracker, clip)
    if piece := earlier.find(clip.size, name, made_from):
        logging.getLogger("echotruth").info("%s at %d px: taken up", name, clip.size)
        return piece
    try:
        return Piece(*clip.on_grid(*track(*clip.tracker_arguments, tracker)), made_from)
    except TrackerFailed as error:
        logging.getLogger("echotruth").warning("%s at %d px: %s", name, clip.size, error)
        job.verdict.setdefault("failures", {})[f"{name}/{clip.size}"] = str(error)
        return Piece(*clip.on_grid(*clip.no_estimate), made_from, str(error))


if __name__ == "__main__":
    main("tracking", work, __doc__)
