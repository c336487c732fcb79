"""Points of a clip followed as the tissue moves, in place of a tracker."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from echotruth.heart import Heart
from echotruth.imaging.tracks import follow, visible
from echotruth.notebook.arguments import check_clip, check_heart
from echotruth.repository.datasets import case_of, imaged_heart
from echotruth.units import mm

SEEN = "whether the point is within the field of view, the scan and the slice"


def point_tracks(
    heart: Heart, clip: xr.Dataset, points: ArrayLike, frame: ArrayLike = 0, thickness: float | None = None
) -> xr.Dataset:
    """Follow points of a clip through all frames, exactly, as the tissue that is there in one frame moves.

    Parameters
    ----------
    heart : Heart
        The heart that was imaged.
    clip : Dataset
        As :func:`echotruth.image` or :meth:`echotruth.Repository.clip` returns it.
    points : array_like of shape (n, 2), px
        Lateral, axial; 0 at the centre of the first pixel, as trackers receive them. Any number of them, anywhere.
    frame : int or array_like of shape (n,)
        Frame in which the points are there: one, or that of each point.
    thickness : float, m, optional
        Of the slice within which tissue is visible. Default: the two-way -6 dB width of the beam in elevation.

    Returns
    -------
    Dataset
        `position` (frame, point, plane), m, and `pixel`, px: lateral, axial; `elevation` (frame, point), m, distance
        from the plane; `visible` (frame, point): whether the point is within the field of view, the scan and the slice.
        Positions are known where a point is not visible too; they are NaN, and it is never visible, where it is not in
        the wall in its frame.

    Raises
    ------
    ValueError
        If it is another heart, a point or a frame is not possible, or the clip has lost its attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> demo = et.Repository("out/demo")
    >>> heart, clip = demo.heart(), demo.clip(view="mid", size=128)
    >>> rows, columns = clip["mask"].isel(frame=0).values.nonzero()
    >>> tracks = et.point_tracks(heart, clip, [[columns[0], rows[0]], [columns[-1], rows[-1]]])
    >>> tracks["pixel"].dims, dict(tracks["pixel"].sizes)["point"]
    (('frame', 'point', 'plane'), 2)
    """
    check_heart(heart)
    check_clip(clip)
    case, (moving, plane) = case_of(clip), imaged_heart(clip, heart)
    given, start = _checked(points, frame, len(heart.displacement))
    if thickness is not None and not thickness > 0:
        raise ValueError(f"thickness = {thickness}: give a positive length, in m.")
    first = np.array([clip["lateral"].values[0], clip["axial"].values[0]])
    spacing = case.config.bmode.field_of_view_mm * mm / clip.sizes["axial"]
    followed = follow(moving.nodes + moving.displacement, heart.cells, plane, first + given * spacing, start)
    position = followed[..., :2]
    tracks = xr.Dataset(
        {
            "position": (("frame", "point", "plane"), position, _about("m", "position in the image")),
            "pixel": (("frame", "point", "plane"), (position - first) / spacing, _about("px", "position in the image")),
            "elevation": (("frame", "point"), followed[..., 2], _about("m", "distance from the plane of the image")),
            "visible": (("frame", "point"), visible(case.config, followed, thickness), _about("1", SEEN)),
        },
        coords={
            "frame": np.arange(len(followed)),
            "plane": ["lateral", "axial"],
            "start": ("point", start, _about("1", "frame in which the point was given")),
        },
        attrs=clip.attrs,
    )
    return tracks.assign_coords(time=clip["time"]) if clip.sizes["frame"] == len(followed) else tracks


def _checked(points: ArrayLike, frame: ArrayLike, frames: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, 2), px, and the frame of each, (n,)."""
    given, start = np.asarray(points, float), np.asarray(frame)
    if given.ndim != 2 or given.shape[1] != 2 or not np.isfinite(given).all():
        raise ValueError(f"points: give finite numbers of shape (n, 2), lateral and axial in px, not {given.shape}.")
    if start.dtype.kind not in "iu" or start.shape not in ((), (len(given),)):
        raise ValueError(f"frame: give one whole number, or one for each of the {len(given)} points.")
    if len(given) and (start.min() < 0 or start.max() >= frames):
        raise ValueError(f"frame: give numbers from 0 to {frames - 1}, not {start.min()} to {start.max()}.")
    return given, np.broadcast_to(start, len(given)).astype(np.int64)


def _about(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}
