"""The HDF5 layout of zea, a toolbox for cognitive ultrasound imaging (https://zea.readthedocs.io, data format 0.1).

A track holds the data (frames first) and the scan (the transmits), all in 32 bits; the probe stands beside it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from echotruth.arrays import Floats
from echotruth.extras import optional
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.sharing.export.rf import open_rf, sample_positions, scaled_channels

VERSION = "0.1.8"
"""Version of zea whose layout is written."""

SOURCE_DISTANCE = 1e-6
"""Distance of the virtual source of a wave behind its element, m: 0 would mean a plane wave."""


def write(clip: ExportedClip, path: Path) -> None:
    """Write the lines of a view as `beamformed_data`, and its channels, if they are kept, as `raw_data`."""
    with optional("h5py", "export", ExportError).File(path, "w") as file:
        rf = open_rf(clip)
        file.attrs.update(zea_version=VERSION, us_machine="echotruth", description="Simulated echocardiogram")
        _probe(file.create_group("probe"), rf)
        track = file.create_group("tracks/track_0")
        data = track.create_group("data")
        if "channels" in rf:
            _raw(data, rf)
            _scan(track.create_group("scan"), rf)
        _beamformed(data.create_group("beamformed_data"), rf, clip.time)


def _probe(group: Any, rf: xr.Dataset) -> None:
    group["type"] = "phased"
    _put(
        group,
        probe_center_frequency=rf.attrs["centre_frequency"],
        probe_bandwidth_percent=100 * rf.attrs["bandwidth"],
        probe_geometry=np.pad(rf.element.values[:, None], ((0, 0), (0, 2))),
        element_width=rf.attrs["element_width"],
        element_height=rf.attrs["element_height"],
    )


def _raw(group: Any, rf: xr.Dataset) -> None:
    frames, *_, samples = (rf.sizes[dim] for dim in ("frame", "transmitter", "receiver", "sample"))
    elements = rf.sizes["element"]
    raw = group.create_dataset("raw_data", (frames, elements, samples, elements, 1), np.float32)
    for frame, channels in enumerate(scaled_channels(rf)):
        raw[frame] = channels.transpose(0, 2, 1)[..., None]


def _scan(group: Any, rf: xr.Dataset) -> None:
    """Transmits: every element alone, one after the other."""
    element = rf.element.values
    ones = np.ones(len(element))
    # Without waveforms, zea takes the pulse to peak 1/f0 after it is sent; here it peaks when it is sent.
    initial_time = float(rf["sample"][0]) + 1 / rf.attrs["centre_frequency"]
    _put(
        group,
        sampling_frequency=rf.attrs["sampling_frequency"],
        center_frequency=rf.attrs["centre_frequency"],
        demodulation_frequency=rf.attrs["centre_frequency"],
        sound_speed=rf.attrs["sound_speed"],
        initial_times=initial_time * ones,
        t0_delays=np.diag(0 * ones),
        tx_apodizations=np.diag(ones),
        focus_distances=-SOURCE_DISTANCE * ones,
        transmit_origins=np.pad(element[:, None], ((0, 0), (0, 2))),
        polar_angles=0 * ones,
        azimuth_angles=0 * ones,
    )


def _beamformed(group: Any, rf: xr.Dataset, time: Floats) -> None:
    lateral, axial = (coordinate.T for coordinate in sample_positions(rf))
    values = group.create_dataset("values", (rf.sizes["frame"], *axial.shape, 2), np.float32)
    for frame, lines in enumerate(rf.lines):
        values[frame] = np.stack([lines.values.real.T, lines.values.imag.T], axis=-1)
    _put(group, coordinates=np.stack([lateral, np.zeros(axial.shape), axial], axis=-1))
    _put(group, timestamps=time - time[0], start_time_offset=0.0)
    group["labels"] = ["I", "Q"]


def _put(group: Any, **values: ArrayLike) -> None:
    for name, value in values.items():
        group[name] = np.asarray(value, np.float32)
