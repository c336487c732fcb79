"""Clips made from those of a repository, on which a tracker is run again: mirrored ones, and ones that do not close."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np

from echotruth.evaluation.clip import Clip


@dataclass(frozen=True)
class Variant:
    """A clip made from another, and how what is found in it is that of the other.

    Attributes
    ----------
    clip : Clip
        Its array `inside` is that of the other.
    order : ndarray of shape (n,), int
        Point k of it is point `order[k]` of the other.
    sign : tuple of float
        Factors of the lateral and the axial displacement.
    frames : int
        Number of frames of the other that a tracker is given.
    last : int
        Last frame of the other that this one reaches.
    """

    clip: Clip
    order: np.ndarray
    sign: tuple[float, float]
    frames: int
    last: int

    def restored(self, displacement: np.ndarray, quality: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and quality found in this clip, as those of the other.

        Parameters
        ----------
        displacement : ndarray of shape (given frame, n, 2)
            Lateral, axial, px.
        quality : ndarray of shape (given frame, n)

        Returns
        -------
        displacement : ndarray of shape (frames, n, 2)
            NaN in frames that this clip lacks.
        quality : ndarray of shape (frames, n)
        """
        points = len(self.order)
        found, sure = np.full((self.frames, points, 2), np.nan), np.full((self.frames, points), np.nan)
        found[: len(displacement), self.order] = displacement * np.array(self.sign)
        sure[: len(quality), self.order] = quality
        return found, sure


def mirrored(clip: Clip) -> Variant:
    """Mirror a clip left to right.

    Arrays and sectors are symmetric, so that the mirrored clip is one that a mirrored heart would have given, and none
    that anybody has seen with its truth. Its points are in rows from left to right, as those of any clip.
    """
    lateral, axial = clip.size - 1 - clip.points[:, 0], clip.points[:, 1]
    order = np.lexsort((lateral, axial))
    turned = replace(
        clip,
        frames=np.ascontiguousarray(clip.frames[..., ::-1]),
        mask=np.ascontiguousarray(clip.mask[:, ::-1]),
        points=np.column_stack([lateral, axial])[order],
    )
    return Variant(turned, order, (-1.0, 1.0), len(clip.tracker_arguments[0]), len(clip.frames) - 1)


def half(clip: Clip) -> Variant:
    """The first half of the cycle, whose end is far from its beginning."""
    given = len(clip.frames[: len(clip.frames) // 2 + 1 : clip.frame_step])
    last = (given - 1) * clip.frame_step
    first = replace(clip, frames=clip.frames[: last + 1].copy(), frame_time=clip.frame_time[: last + 1].copy())
    return Variant(first, np.arange(len(clip.points)), (1.0, 1.0), len(clip.tracker_arguments[0]), last)


def anonymous(clip: Clip, time: np.ndarray) -> Clip:
    """A clip that nothing but its images tells from others of the same size and number of frames.

    Seeds differ from clip to clip, and times from heart to heart, so that either would lead to the truth of the clip
    that a variant is made from.

    Parameters
    ----------
    clip : Clip
    time : ndarray of shape (frame,)
        Times of a beat that all clips share, s; there may be more than the clip has frames.

    Returns
    -------
    Clip
        With these times and a seed drawn from its own images.
    """
    drawn = np.random.default_rng(list(sha256(clip.frames.tobytes()).digest()))
    return replace(clip, frame_time=time[: len(clip.frames)], seed=int(drawn.integers(2**31)))


VARIANTS: dict[str, Callable[[Clip], Variant]] = {"mirrored": mirrored, "open": half}
"""Name -> how it is made."""
