"""Point tracks in the form of TAP-Vid: arrays `video`, `points` and `occluded`, in a NumPy archive.

Doersch et al., TAP-Vid: A Benchmark for Tracking Any Point in a Video, NeurIPS 2022 (arXiv:2211.03726): its files
hold `video` (frame, height, width, 3; uint8), `points` (point, frame, 2; x, y; of the width and the height, 0 to 1) and
`occluded` (point, frame; bool).
"""

from pathlib import Path
from typing import Any

import numpy as np

from echotruth.sharing.export.clip import ExportedClip

POINTS_ALONG_SIDE = 64
"""Points along the side of an image that is all wall."""


def write(clip: ExportedClip, path: Path) -> None:
    """Write the :func:`arrays` of a clip as a NumPy archive (.npz).

    Parameters
    ----------
    clip : ExportedClip
    path : Path
    """
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays(clip))


def arrays(clip: ExportedClip) -> dict[str, Any]:
    """Video and paths of the points of a grid that are in the wall at end-diastole.

    x is 0 at the left edge of the image and 1 at the right one, y is 0 at the upper edge, nearest the array, and 1 at
    the lower one. A point is occluded where it has left the sector or the slice of tissue that is imaged. Besides,
    `elevation_m` (point, frame) is its distance from the plane, `spacing_m` the distance of pixel centres and
    `frame_time_s` the time from one frame to the next.

    Parameters
    ----------
    clip : ExportedClip

    Returns
    -------
    dict
        video, points, occluded, elevation_m, spacing_m, frame_time_s; see above.
    """
    found = clip.tracks(max(1, clip.size // POINTS_ALONG_SIDE))
    return {
        "video": np.repeat(clip.image[..., None], 3, axis=-1),
        "points": ((found["pixel"].values + 0.5) / clip.size).transpose(1, 0, 2).astype(np.float32),
        "occluded": ~found["visible"].values.T,
        "elevation_m": found["elevation"].values.T.astype(np.float32),
        "spacing_m": np.float64(clip.spacing),
        "frame_time_s": np.float64(clip.frame_time),
    }
