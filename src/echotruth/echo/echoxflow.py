"""Recordings of EchoXFlow: B-mode lines in beamspace, in a Zarr store, which are scan-converted here.

Stenhede et al. 2026, EchoXFlow: A Beamspace Echocardiography Dataset for Cardiac Motion, Flow, and Function,
arXiv:2605.05447. The layout is what their loader reads (github.com/Ahus-AIM/EchoXFlow, b782e0a): grey levels (time,
range, angle), times in s, and a sector of the attribute `recording_manifest` that says where the lines are.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.storage import ZipStore

from echotruth.arrays import Floats
from echotruth.echo.failure import EchoError, reading
from echotruth.echo.recording import Recording, check_size

BMODE, TIMES = "data/2d_brightness_mode", "timestamps/2d_brightness_mode"
"""Arrays of the grey levels and, where the manifest names no other, of their times."""

Limits = tuple[float, float]


def read(path: Path) -> Recording:
    """Read the B-mode of a recording.

    Parameters
    ----------
    path : Path
        A Zarr store: a folder, or a ZIP file.

    Returns
    -------
    Recording

    Raises
    ------
    EchoError
        If it is no such store, or has no B-mode, sector or matching times.
    """
    with reading(path, "no Zarr store of a recording that can be read"):
        group: Any = zarr.open_group(ZipStore(path, mode="r") if path.is_file() else path, mode="r")
        if BMODE not in group:
            raise EchoError(f"{path}: has no {BMODE}: give a recording of EchoXFlow with a B-mode in one plane")
        sector, lines = _sector(group.attrs), _checked(group[BMODE], path)[:]
        times = next((name for name in (_array(sector.get("timestamps")), TIMES) if name and name in group), None)
        time = _of_frames(group[times], len(lines), path) if times else np.empty(0)
    frames, spacing = scan_convert(lines, *_limits(sector.get("geometry"), path))
    return Recording(frames, (spacing, spacing), time - time[:1])


def _sector(attributes: Mapping[str, Any]) -> Mapping[str, Any]:
    """The sector of the B-mode in the manifest: the first that names its array, or is called so; empty if none."""
    sectors = attributes.get("recording_manifest", {}).get("sectors", [])
    return next((each for each in sectors if _array(each.get("frames")) == BMODE or _role(each) == "bmode"), {})


def _role(sector: Mapping[str, Any]) -> object:
    return sector.get("semantic_id") or sector.get("sector_role_id")


def _array(reference: Mapping[str, Any] | None) -> str:
    """Path of the array that a manifest refers to; "" for none."""
    keys = ("array_path", "zarr_path", "path")
    return next((str(reference[key]).strip("/") for key in keys if reference.get(key)), "") if reference else ""


def _checked(array: Any, path: Path) -> Any:
    """The array of the grey levels, of which only the header is read."""
    if array.dtype != np.uint8 or array.ndim != 3 or min(array.shape[1:]) < 2:
        wanted = "give uint8 (time, range, angle)"
        raise EchoError(f"{path}: has {BMODE} of the shape {array.shape} of {array.dtype}: {wanted}")
    check_size(int(np.prod(array.shape, dtype=object)), str(path))
    return array


def _of_frames(array: Any, frames: int, path: Path) -> Floats:
    """Times (frame,), s, which are read if there are as many as frames."""
    if array.shape != (frames,):
        raise EchoError(f"{path}: has {frames} frames, and {array.path} of the shape {array.shape}: give one of each")
    return np.asarray(array[:], float)


def _limits(geometry: Any, path: Path) -> tuple[Limits, Limits]:
    """Ranges of the first and the last sample, m, and angles of the first and the last line, rad."""
    given = geometry if isinstance(geometry, Mapping) else {}

    def number(*names: str) -> float:
        value = next((given[name] for name in names if given.get(name) is not None), None)
        try:
            return float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            wanted = "give the geometry of the sector in recording_manifest"
            raise EchoError(f"{path}: has {names[0]} = {value}: {wanted}") from None

    depth = number("depth_start_m", "DepthStart"), number("depth_end_m", "DepthEnd")
    if {"angle_start_rad", "AngleStart"} & given.keys():
        angle = number("angle_start_rad", "AngleStart"), number("angle_end_rad", "AngleEnd")
    else:
        half = number("width_rad", "Width") / 2
        tilt = number("tilt_rad", "Tilt", "Angle") if {"tilt_rad", "Tilt", "Angle"} & given.keys() else 0.0
        angle = tilt - half, tilt + half
    if not (0 <= depth[0] < depth[1] < np.inf and -np.pi / 2 <= angle[0] < angle[1] <= np.pi / 2):
        said = "{:g} to {:g} m and {:g} to {:g} rad".format(*depth, *angle)
        raise EchoError(f"{path}: has a sector of {said}: give rising ranges, and angles within a quarter turn")
    return depth, angle


def scan_convert(lines: NDArray[np.uint8], depth: Limits, angle: Limits) -> tuple[NDArray[np.uint8], float]:
    """Interpolate lines linearly to square pixels, as many along the axis as a line has samples.

    A sample at range r of a line of angle theta lies at x = r sin(theta), z = r cos(theta).

    Parameters
    ----------
    lines : ndarray of shape (frame, range, angle), uint8
    depth : tuple of float, m
        Ranges of the first and the last sample.
    angle : tuple of float, rad
        Angles of the first and the last line from the axis, that of the smallest lateral coordinate first.

    Returns
    -------
    frames : ndarray of shape (frame, axial, lateral), uint8
        Of the box about the sector; 0 beside it.
    spacing : float, m

    Raises
    ------
    EchoError
        If they are more pixels than any echo has.
    """
    from scipy.ndimage import map_coordinates  # takes longer to import than all else here

    _, samples, number = lines.shape
    corners = np.multiply.outer(depth, np.exp(1j * np.array([*angle, np.clip(0, *angle)])))  # z + i x
    spacing = float(np.ptp(corners.real)) / (samples - 1)
    columns = int(np.ptp(corners.imag) / spacing) + 1
    check_size(len(lines) * samples * columns, "the clip in pixels")
    axial = corners.real.min() + spacing * np.arange(samples)[:, None]
    lateral = corners.imag.min() + spacing * np.arange(columns)
    index = _index(np.hypot(axial, lateral), depth, samples), _index(np.arctan2(lateral, axial), angle, number)
    inside = (index[0] >= 0) & (index[0] <= samples - 1) & (index[1] >= 0) & (index[1] <= number - 1)
    at = np.stack([each[inside] for each in index])
    frames = np.zeros((len(lines), samples, columns), np.uint8)
    for frame, levels in zip(frames, lines, strict=True):
        frame[inside] = np.rint(map_coordinates(levels.astype(np.float32), at, order=1, mode="nearest"))
    return frames, spacing


def _index(value: Floats, limits: Limits, number: int) -> Floats:
    """Fractional index of values along an axis of so many even steps between its limits."""
    return np.asarray((value - limits[0]) / (limits[1] - limits[0]) * (number - 1))
