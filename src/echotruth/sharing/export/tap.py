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

XYZ = [0, 2, 1]
"""Lateral, elevation, axial of lateral, axial, elevation: the sides of a volume, the last first."""


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
    """Video and paths of points in the wall at end-diastole: of a grid, or those that trackers follow in volumes.

    x is 0 at the left edge of the image and 1 at the right one, y is 0 at the upper edge, nearest the array, and 1 at
    the lower one. A point is occluded where it has left the sector or the slice of tissue that is imaged. Besides,
    `elevation_m` (point, frame) is its distance from the plane, `spacing_m` the distance of pixel centres and
    `frame_time_s` the time from one frame to the next.

    Of volumes, `video` is (frame, axial, elevation, lateral), without a channel, `points` are (point, frame, 3; x, y,
    z: lateral, elevation, axial), occluded outside the box, and `spacing_m` (3,) are the sides of a voxel likewise.

    Parameters
    ----------
    clip : ExportedClip

    Returns
    -------
    dict
        video, points, occluded, elevation_m, spacing_m, frame_time_s; see above.
    """
    if clip.case.config.has_volumes:
        return _in_volumes(clip)
    found = clip.tracks(max(1, clip.size // POINTS_ALONG_SIDE))
    return {
        "video": np.repeat(clip.image[..., None], 3, axis=-1),
        "points": ((found["pixel"].values + 0.5) / clip.size).transpose(1, 0, 2).astype(np.float32),
        "occluded": ~found["visible"].values.T,
        "elevation_m": found["elevation"].values.T.astype(np.float32),
        "spacing_m": np.float64(clip.spacing),
        "frame_time_s": np.float64(clip.frame_time),
    }


def _in_volumes(clip: ExportedClip) -> dict[str, Any]:
    points = clip.repository.arrays("points", clip.case.id, clip.view, "position", "true_displacement")
    places = (points["position"] + points["true_displacement"] - clip.corner)[..., XYZ].swapaxes(0, 1)
    sides = clip.sides[XYZ]
    shares = (places / sides + 0.5) / clip.image.shape[:0:-1]
    return {
        "video": clip.image,
        "points": shares.astype(np.float32),
        "occluded": ((shares < 0) | (shares > 1)).any(axis=-1),
        "spacing_m": sides,
        "frame_time_s": np.float64(clip.frame_time),
    }
