"""The ultrasound file format (UFF) of the UltraSound ToolBox (USTB): HDF5 with its classes `uff.*`.

An object is a group with the name of its class, a list of objects a group of numbered ones, and an array a dataset with
its dimensions in Fortran order, the last one of the toolbox first. A complex array is a group of two.

Rodriguez-Molares et al., The UltraSound ToolBox, IEEE Int Ultrason Symp 2017.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from echotruth.extras import optional
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.sharing.export.rf import open_rf, sample_positions, scaled_channels

VERSION = "v1.2.0"
"""Version of the format, without which USTB reads no file."""

SPHERICAL = 1
"""`uff.wavefront.spherical`"""


def write(clip: ExportedClip, path: Path) -> None:
    """Write the lines of a view as `beamformed_data`, and its channels, if they are kept, as `channel_data`."""
    h5py = optional("h5py", "export", ExportError)
    with h5py.File(path, "w") as file:
        rf = open_rf(clip)
        file.attrs["version"] = np.array([VERSION], h5py.string_dtype())
        if "channels" in rf:
            _channel_data(_object(file, "channel_data", "uff.channel_data"), rf)
        _beamformed_data(_object(file, "beamformed_data", "uff.beamformed_data"), rf)


def _channel_data(group: Any, rf: xr.Dataset) -> None:
    _settings(group, rf, rf.attrs["sampling_frequency"], 0.0)
    _array(group, "sound_speed", rf.attrs["sound_speed"])
    _array(group, "initial_time", float(rf["sample"][0]))
    sequence = _object(group, "sequence", "uff.wave", len(rf.transmitter))
    for number, lateral in enumerate(rf.transmitter.values, start=1):
        _wave(_object(sequence, f"sequence_{number:04d}", "uff.wave"), float(lateral), rf)
    shape = tuple(rf.sizes[dim] for dim in ("frame", "transmitter", "receiver", "sample"))
    _frames(group, "data", shape, scaled_channels(rf))


def _wave(group: Any, lateral: float, rf: xr.Dataset) -> None:
    """Wave transmitted by one element alone.

    In the toolbox time starts when the wave passes the origin. If the source is not behind the array, the wave is
    taken to travel from the origin to the source first, so that the delay of the record is |x| / c.
    """
    _array(group, "wavefront", [[SPHERICAL]], "uff.wavefront")
    for name in ("source", "origin"):
        _point(group, name, lateral)
    _array(group, "sound_speed", rf.attrs["sound_speed"])
    _array(group, "delay", abs(lateral) / rf.attrs["sound_speed"])
    _probe(group, rf)


def _beamformed_data(group: Any, rf: xr.Dataset) -> None:
    spacing = float(rf.range[1] - rf.range[0])
    in_depth = rf.attrs["sound_speed"] / (2 * spacing)  # as the class wants it, not that of the channels
    _settings(group, rf, in_depth, modulation_frequency=rf.attrs["demodulation_frequency"])
    sector = rf.attrs["scan"] == "sector"
    scan = _object(group, "scan", "uff.sector_scan" if sector else "uff.linear_scan")
    _array(scan, "azimuth_axis" if sector else "x_axis", rf.line_angle if sector else rf.line_origin)
    _array(scan, "depth_axis" if sector else "z_axis", rf.range)
    if sector:
        _point(scan, "origin", 0.0)
    for name, coordinate in zip("xz", sample_positions(rf), strict=True):
        _array(scan, name, coordinate.ravel())
    _array(scan, "y", np.zeros(rf.sizes["line"] * rf.sizes["range"]))
    shape = (rf.sizes["frame"], 1, 1, rf.sizes["line"] * rf.sizes["range"])
    data = group.create_group("data")
    data.attrs.update({"class": "single", "name": "data", "complex": [1], "imaginary": [0]})
    for name, part in (("real", np.real), ("imag", np.imag)):
        _frames(data, name, shape, (part(lines.values).reshape(1, 1, -1) for lines in rf.lines))
        data[name].attrs["imaginary"] = [int(name == "imag")]


def _settings(group: Any, rf: xr.Dataset, sampling_frequency: float, modulation_frequency: float) -> None:
    """Properties of both classes; the toolbox refuses a file with one that its class does not have."""
    _array(group, "sampling_frequency", sampling_frequency)
    _array(group, "modulation_frequency", modulation_frequency)
    pulse = _object(group, "pulse", "uff.pulse")
    _array(pulse, "center_frequency", rf.attrs["centre_frequency"])
    _array(pulse, "fractional_bandwidth", rf.attrs["bandwidth"])
    _probe(group, rf)


def _probe(group: Any, rf: xr.Dataset) -> None:
    probe = _object(group, "probe", "uff.linear_array")
    element = rf.element.values
    geometry = np.zeros((7, len(element)))  # x, y, z, azimuth, elevation, width, height
    geometry[0], geometry[5], geometry[6] = element, rf.attrs["element_width"], rf.attrs["element_height"]
    _array(probe, "geometry", geometry)
    _array(probe, "N", float(len(element)))
    _array(probe, "pitch", element[1] - element[0])
    for name in ("element_width", "element_height"):
        _array(probe, name, rf.attrs[name])
    _point(probe, "origin", 0.0)


def _point(group: Any, name: str, lateral: float) -> None:
    """A point of the array in the spherical coordinates of the format."""
    point = _object(group, name, "uff.point")
    _array(point, "distance", abs(lateral))
    _array(point, "azimuth", np.arctan2(lateral, 0.0))
    _array(point, "elevation", 0.0)


def _object(parent: Any, name: str, kind: str, number: int = 1) -> Any:
    group = parent.create_group(name)
    group.attrs.update({"class": kind, "name": name, "array": [int(number > 1)], "size": [1, number]})
    return group


def _array(group: Any, name: str, values: ArrayLike, kind: str = "single") -> None:
    dataset = group.create_dataset(name, data=np.asarray(values))
    dataset.attrs.update({"class": kind, "name": name, "complex": [0], "imaginary": [0]})


def _frames(group: Any, name: str, shape: tuple[int, ...], frames: Iterator[NDArray[Any]]) -> None:
    """An array whose first dimension is the frame, written frame by frame."""
    dataset = group.create_dataset(name, shape, np.float32)
    dataset.attrs.update({"class": "single", "name": name, "complex": [0], "imaginary": [0]})
    for frame, values in enumerate(frames):
        dataset[frame] = values
