"""What the trackers of a repository found in a clip."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from echotruth.export.clip import Clip
from echotruth.repository import schema


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
    config = clip.case.config
    if group in schema.groups(config):  # with the dimension `size`
        values = clip.job.read(group, name)[name][list(config.bmode.sizes).index(clip.size)]
    else:
        values = clip.job.read(f"{group}/{clip.size}", name)[name]
    return values[list(config.tracking.trackers).index(tracker)]
