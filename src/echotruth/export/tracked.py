"""What the trackers of a repository found in a clip."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from echotruth.evaluation import kept
from echotruth.export.clip import Clip


def tracked(clip: Clip, group: str, name: str, tracker: str) -> NDArray[Any]:
    """An array of one clip and one tracker.

    Parameters
    ----------
    clip : Clip
    group : {"tracking", "evaluation"}
    name : str
        An array with the dimension `tracker` (docs/schema.md).
    tracker : str

    Returns
    -------
    ndarray
        Its dimensions without case, view, size and tracker.
    """
    return kept.read(clip.job, group, name, tracker=tracker, size=clip.size)[name]
