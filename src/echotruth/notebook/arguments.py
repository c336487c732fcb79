"""Refusal of what is no heart and no clip, with the function that makes one."""

import numpy as np
import xarray as xr

from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.loop.cycle import frame_times


def check_heart(heart: object) -> None:
    """Check that a heart is one.

    Raises
    ------
    TypeError
        If it is something else, such as the path of a repository.
    ValueError
        If it was solved in some of its frames only.
    """
    if not isinstance(heart, Heart):
        made = "a Repository has one, echotruth.beat makes one"
        raise TypeError(f"heart = {heart!r:.80}: must be a Heart: {made}.")
    solved = len(heart.displacement)
    if heart.config is not None and solved < heart.config.loop.frames:
        of = f"{solved} of {heart.config.loop.frames} frames"
        raise ValueError(f"The heart has {of}, of which only its arrays can be used: beat it without `frames`.")


def is_volume(clip: xr.Dataset) -> bool:
    """Whether a clip, or what was tracked in one, is of volumes."""
    return "elevation" in clip.coords


def check_clip(clip: object, name: str = "clip", volumes: bool = False) -> None:
    """Check that a clip, or what a tracker made of one, is a dataset, of slices unless volumes will do.

    Raises
    ------
    TypeError
        If it is something else, such as the path of a repository.
    ValueError
        If it is of volumes, and they will not do.
    """
    if not isinstance(clip, xr.Dataset):
        clips, tracked = "a Repository has one, echotruth.image makes one", "echotruth.track makes one from a clip"
        raise TypeError(f"{name} = {clip!r:.80}: must be a Dataset: {clips if name == 'clip' else tracked}.")
    if not volumes and is_volume(clip):
        raise ValueError(f"{name}: is of volumes: give one of a short or a long axis.")


def check_whole(clip: xr.Dataset, config: Config) -> None:
    """Check that a clip has all frames and pixels of its image, in their order.

    Trackers are given one spacing and the wall at end-diastole, so that in a clip that was cropped, reversed or
    resampled they would find another motion.

    Parameters
    ----------
    clip : Dataset
        With the coordinates frame, time, axial and lateral.
    config : Config
        Of the case.

    Raises
    ------
    ValueError
        With the coordinate that is not that of the image.
    """
    size = clip.sizes["axial"]
    if is_volume(clip):
        centres = dict(zip(("axial", "elevation", "lateral"), voxel_centres(config), strict=True))
    else:
        size = size if size in config.bmode.sizes else config.bmode.sizes[0]
        centres = dict(zip(("axial", "lateral"), pixel_centres(config.bmode, size), strict=True))
    whole = {"frame": np.arange(config.loop.frames), "time": frame_times(config.loop)} | centres
    for name, values in whole.items():
        found = np.asarray(clip[name].values, float)
        if found.shape != values.shape or not np.allclose(found, values, rtol=1e-6, atol=1e-12):
            raise ValueError(f"The clip's {name} is not that of its image: give all frames and pixels, in their order.")
