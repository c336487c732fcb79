"""Clips with the points that trackers follow and their true motion, as NumPy archives."""

from io import BytesIO

import numpy as np

from echotruth.evaluation.clip import read_clips
from echotruth.repository.reader import Repository


def clips_of(repository: Repository, case: str, view: str) -> dict[str, bytes]:
    """Archive of each image size of a view, by the name of its file; :mod:`.evaluate` says what it holds.

    Parameters
    ----------
    repository : Repository
    case, view : str
        Of which the images, the truth and the points are made.
    """
    es = int(repository.read("mechanics/es_frame", case))
    found = {}
    for size, clip in read_clips(repository, case, view).items():
        true = repository.arrays("points", case, view, "true_displacement")["true_displacement"]
        arrays = {
            "frames": clip.frames,
            "mask": clip.mask,
            "points": clip.points,
            "spacing_m": np.float64(clip.spacing),
            "frame_time_s": clip.frame_time,
            "seed": np.int64(clip.seed),
            "displacement": (true[:, clip.inside, :2] / clip.spacing).astype(np.float32),
            "es_frame": np.int64(es),
            "frame_step": np.int64(clip.frame_step),
        }
        file = BytesIO()
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]  # no array has the name of an option
        found[f"{case}_{view}_{size}.npz"] = file.getvalue()
    return found
