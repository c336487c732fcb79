"""What the trackers of a repository found in a clip."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

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
    config = clip.case.config
    of_size = clip.job.read(group, name)[name][list(config.bmode.sizes).index(clip.size)]
    values: NDArray[Any] = of_size[list(config.tracking.trackers).index(tracker)]
    return values
