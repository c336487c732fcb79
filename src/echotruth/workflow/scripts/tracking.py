"""Track the clips of one view, at every image size, with every tracker; what stands already is taken over."""

import logging

import numpy as np

from echotruth.evaluation.clip import Clip, clips
from echotruth.evaluation.pieces import ARRAYS, Piece, Pieces, fingerprint, known
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow import superseded
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    config = job.case.config
    trackers, roots = config.tracking.trackers, superseded.roots(job.folder, job.store.path)
    earlier = Pieces(job.checkpoints.entry(job.stage), job.index, roots)
    images = {size: job.read(f"bmode/{size}", "image")["image"] for size in config.bmode.sizes}
    labels = {size: job.read(f"truth/{size}", "labels")["labels"][0] for size in config.bmode.sizes}
    pieces: dict[int, dict[str, Piece]] = {}
    for size, clip in clips(job.case, str(job.view_name), images, labels).items():
        pieces[size] = {name: _piece(job, name, clip, earlier) for name in trackers}
        logging.getLogger("echotruth").info("%d px", size)
    job.remember(pieces=known(pieces), index=list(job.index))
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
