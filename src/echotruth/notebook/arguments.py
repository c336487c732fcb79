"""Refusal of what is no heart and no clip, with the function that makes one."""

import xarray as xr

from echotruth.heart import Heart


def check_heart(heart: object) -> None:
    """Check that a heart is one.

    Raises
    ------
    TypeError
        If it is something else, such as the path of a repository.
    """
    if not isinstance(heart, Heart):
        made = "a Repository has one, echotruth.beat makes one"
        raise TypeError(f"heart = {heart!r:.80}: must be a Heart: {made}.")


def check_clip(clip: object, name: str = "clip") -> None:
    """Check that a clip, or what a tracker made of one, is a dataset.

    Raises
    ------
    TypeError
        If it is something else, such as the path of a repository.
    """
    if not isinstance(clip, xr.Dataset):
        clips, tracked = "a Repository has one, echotruth.image makes one", "echotruth.track makes one from a clip"
        raise TypeError(f"{name} = {clip!r:.80}: must be a Dataset: {clips if name == 'clip' else tracked}.")
