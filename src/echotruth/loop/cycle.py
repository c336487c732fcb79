"""The cycle that drives the heart: read from a CSV file, checked, scaled and sampled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.loop import Drive, Loop
from echotruth.loop.phases import es_frame
from echotruth.loop.recording import LoopError, Recording, read

SHIPPED = Path(__file__).parent / "recordings"

PRESCRIBED: dict[Drive, tuple[str, ...]] = {
    "pressure_volume": ("pressure", "volume"),
    "pressure": ("pressure", "tension"),
    "volume": ("volume",),
}
"""Drive to what its file must give over time; `volume` takes a tension where there is one."""

_CLOSED = 0.03
"""Most that the last row may differ from the first, as a share of the range: what noise leaves of a measured loop."""
_FULL = 0.95
"""Least volume of the first row, as a share of the way from the smallest to the largest."""
_SLACK = 0.05
"""Largest tension of the first row, as a share of the largest: end-diastole is passive."""


@dataclass(frozen=True)
class Cycle:
    """One cycle at equal steps of time, beginning at end-diastole.

    Attributes
    ----------
    source : str
        File it came from.
    drive : "pressure_volume", "pressure" or "volume"
        What is prescribed.
    period : float, s
    time : ndarray of shape (n_frames,), s
    pressure : ndarray of shape (n_frames,), Pa, or None where it is to be solved
    volume : ndarray of shape (n_frames,), m^3, or None where it follows
    tension : ndarray of shape (n_frames,), Pa, or None where it is to be solved
        Active tension T_Ca.
    """

    source: str
    drive: Drive
    period: float
    time: Floats
    pressure: Floats | None
    volume: Floats | None
    tension: Floats | None

    def scaled(self, factor: float) -> Cycle:
        """The cycle with its volumes times a factor; the ejection fraction stays."""
        return replace(self, volume=None if self.volume is None else factor * self.volume)


def read_loop(loop: Loop) -> Cycle:
    """Read, check, scale and sample a cycle.

    Parameters
    ----------
    loop : Loop

    Returns
    -------
    Cycle
        Between the rows of the file by monotone cubic (PCHIP) interpolation, periodic in time.

    Raises
    ------
    LoopError
        If the file cannot be read or its cycle is none: one sentence with the file, the place and the remedy.
    """
    recording = _recording(loop)
    _check_time(recording)
    for quantity in recording.names:
        _check_course(recording, quantity)
    _check_end_diastole(recording)
    time, wanted = recording.si("time"), loop.si()
    courses = {quantity: recording.si(quantity) for quantity in ("pressure", "volume", "tension")}
    if courses["pressure"] is not None:
        courses["pressure"] = _mapped_pressure(recording.path, courses["pressure"], courses["volume"], wanted)
    if courses["volume"] is not None:
        courses["volume"] = _mapped(recording.path, courses["volume"], wanted)
    period = float(time[-1]) if wanted.heart_rate is None else 1 / wanted.heart_rate
    at = np.arange(loop.frames) / loop.frames
    sampled = {
        name: None if values is None else _sampled(time / time[-1], values, at) for name, values in courses.items()
    }
    if loop.drive == "volume" and sampled["tension"] is None:
        sampled["tension"] = np.zeros(loop.frames)
    return Cycle(str(recording.path), loop.drive, period, at * period, **sampled)


def _recording(loop: Loop) -> Recording:
    """Columns of the file that the drive takes, and no others."""
    path = SHIPPED / f"{loop.file}.csv"
    path = path if path.is_file() else Path(loop.file)
    if not path.is_file():
        shipped = ", ".join(sorted(file.stem for file in SHIPPED.glob("*.csv")))
        remedy = f"give the path of a CSV file or the name of a shipped loop ({shipped})"
        raise LoopError(f"{path}: there is no readable loop of this name; {remedy}.")
    needed = ("time", *PRESCRIBED[loop.drive])
    return read(path, f"the drive {loop.drive}", needed, ("tension",) if loop.drive == "volume" else ())


def _check_time(recording: Recording) -> None:
    path, name, time = recording.path, recording.names["time"], recording.columns["time"]
    if time[0] != 0:
        raise LoopError(f"{path}, row 1: {name} is {time[0]:g}; begin at 0, the end of diastole.")
    back = np.append(False, np.diff(time) <= 0)
    if back.any():
        row = int(np.argmax(back))
        raise LoopError(f"{path}, row {row + 1}: {name} is {time[row]:g} and must increase from row to row.")


def _check_course(recording: Recording, quantity: str) -> None:
    """Refuse a course that is negative, flat or not closed; a tension may be zero."""
    if quantity == "time":
        return
    path, name, values = recording.path, recording.names[quantity], recording.columns[quantity]
    bad = values < 0 if quantity == "tension" else values <= 0
    if bad.any():
        row, rule = int(np.argmax(bad)), "must not be negative" if quantity == "tension" else "must be positive"
        raise LoopError(f"{path}, row {row + 1}: {name} is {values[row]:g} and {rule}.")
    flat = np.ptp(values) == 0 and quantity != "tension"
    if flat or abs(values[-1] - values[0]) > _CLOSED * np.ptp(values):
        ends = f"{name} begins at {values[0]:g} and ends at {values[-1]:g}"
        raise LoopError(f"{path}: {ends}; end the loop, which must not be flat, with its first row, a period later.")


def _check_end_diastole(recording: Recording) -> None:
    """Refuse a cycle that does not begin full, slack and before the pressure rises."""
    found = recording.columns
    rules = {
        "volume": lambda volume: volume[0] >= volume.min() + _FULL * np.ptp(volume),
        "pressure": lambda pressure: pressure[0] <= np.mean(pressure),
        "tension": lambda tension: tension[0] <= _SLACK * tension.max(),
    }
    for quantity, holds in rules.items():
        if quantity in found and not holds(found[quantity]):
            values, name = found[quantity], recording.names[quantity]
            first = f"the first row has {name} {values[0]:g} of {values.min():g} to {values.max():g}"
            remedy = "begin the loop at end-diastole, full, slack and before the pressure rises"
            raise LoopError(f"{recording.path}: {first}; {remedy}.")


def _mapped(path: Path, volume: Floats, wanted: Any) -> Floats:
    """Volumes mapped linearly so that the first is `wanted.edv` and the smallest `wanted.esv` (m^3)."""
    full, empty = volume[0], volume.min()
    edv = full if wanted.edv is None else wanted.edv
    esv = empty if wanted.esv is None else wanted.esv
    if esv >= edv:
        volumes = f"the end-systolic volume is {esv * 1e9:g} uL and the end-diastolic {edv * 1e9:g} uL"
        raise LoopError(f"{path}: {volumes}; set edv_uL and esv_uL so that the heart ejects.")
    return esv + (volume - empty) * ((edv - esv) / (full - empty))


def _mapped_pressure(path: Path, pressure: Floats, volume: Floats | None, wanted: Any) -> Floats:
    """Pressures mapped so that the first is `wanted.edp` and that of end-systole `wanted.esp` (Pa).

    Up to the first they are scaled, so that they stay positive; above it the map is linear.
    """
    first = pressure[0]
    last = float(pressure.max()) if volume is None else float(pressure[es_frame(pressure, volume)])
    edp, esp = first if wanted.edp is None else wanted.edp, last if wanted.esp is None else wanted.esp
    if esp <= edp:
        pressures = f"the end-systolic pressure is {esp:.4g} Pa and the end-diastolic {edp:.4g} Pa"
        raise LoopError(f"{path}: {pressures}; set edp_mmHg and esp_mmHg so that the pressure rises.")
    above = edp + (pressure - first) * ((esp - edp) / (last - first))
    return np.where(pressure <= first, pressure * (edp / first), above)


def _sampled(phase: Floats, values: Floats, at: Floats) -> Floats:
    """Periodic monotone cubic interpolation (Fritsch & Butland 1984)."""
    from scipy.interpolate import PchipInterpolator

    values = np.append(values[:-1], values[0])
    around = np.concatenate([phase[:-1] - 1, phase[:-1], phase + 1])
    return PchipInterpolator(around, np.concatenate([values[:-1], values[:-1], values]))(at)
