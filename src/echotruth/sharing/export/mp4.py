"""MP4 (H.264), which browsers and slides play."""

from collections.abc import Sequence
from pathlib import Path

from echotruth import video
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.overlay import pictures


def write(clip: ExportedClip, path: Path, overlay: Sequence[str], rate: float) -> None:
    """Write a video; its comment holds the scale and the frame time of the heart as JSON.

    Parameters
    ----------
    clip : ExportedClip
    path : Path
    overlay : sequence of str
        As :func:`echotruth.sharing.export.overlay.pictures` takes them.
    rate : float
        Frames per second of the video.

    Raises
    ------
    OSError
        If the disk is full.
    """
    video.write(path, pictures(clip, overlay), rate, comment=clip.note)
