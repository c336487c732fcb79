"""The pressure-volume loop that drives the heart, read from a CSV file."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Loop
from echotruth.section import UNITS

Floats = NDArray[np.float64]

COLUMNS = ("time_ms", "pressure_mmHg", "volume_uL")
SHIPPED = Path(__file__).parent / "loops"

_LEAST_ROWS = 4
_CLOSED = 0.01
"""Most that the last row may differ from the first, as a share of the range of the column."""
_FULL = 0.95
"""Least volume of the first row, as a share of the way from the smallest to the largest."""


class LoopError(ValueError):
    """A pressure-volume loop that cannot drive a heart."""


@dataclass(frozen=True)
class PressureVolume:
    """One cycle at equal steps of time, beginning at end-diastole.

    Attributes
    ----------
    source : str
        File it came from.
    period : float, s
    time : ndarray of shape (n_frames,), s
    pressure : ndarray of shape (n_frames,), Pa
    volume : ndarray of shape (n_frames,), m^3
    """

    source: str
    period: float
    time: Floats
    pressure: Floats
    volume: Floats

    @property
    def es_frame(self) -> int:
        """Frame of end-systole, the largest P/V (time-varying elastance, Suga & Sagawa 1974)."""
        return int(np.argmax(self.pressure / self.volume))


def read_loop(loop: Loop) -> PressureVolume:
    """Read, check, scale and sample a loop.

    Parameters
    ----------
    loop : Loop

    Returns
    -------
    PressureVolume
        Between the rows of the file by monotone cubic (PCHIP) interpolation, periodic in time.

    Raises
    ------
    LoopError
        If the file cannot be read or its loop is none: one sentence with the file, the place and the remedy.
    """
    path = SHIPPED / f"{loop.file}.csv" if (SHIPPED / f"{loop.file}.csv").is_file() else Path(loop.file)
    rows = _table(path)
    _check(path, rows)
    wanted = loop.si()
    time, pressure, volume = rows.T * [[UNITS[name.split("_")[1]]] for name in COLUMNS]
    period = float(time[-1]) if wanted.heart_rate is None else 1 / wanted.heart_rate
    volume = _mapped(path, volume, wanted.edv, wanted.esv)
    at = np.arange(loop.frames) / loop.frames
    pressure, volume = (_sampled(time / time[-1], values, at) for values in (pressure, volume))
    return PressureVolume(str(path), period, at * period, pressure, volume)


def _table(path: Path) -> Floats:
    """Rows of the file, in its own units and in the order of `COLUMNS`."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        shipped = ", ".join(sorted(file.stem for file in SHIPPED.glob("*.csv")))
        remedy = f"give the path of a CSV file or the name of a shipped loop ({shipped})"
        raise LoopError(f"{path}: there is no readable loop of this name; {remedy}.") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    names = [name.strip() for name in lines[0][1].split(",")] if lines else []
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        head = f"the first line that is no comment must name the columns {', '.join(COLUMNS)}"
        raise LoopError(f"{path}: column {missing[0]} is missing; {head}.")
    numbers = [[_number(path, line, row, names.index(name), name) for name in COLUMNS] for line, row in _cells(lines)]
    if len(numbers) < _LEAST_ROWS:
        raise LoopError(f"{path}: there are {len(numbers)} rows; a loop needs {_LEAST_ROWS} or more.")
    return np.array(numbers)


def _cells(lines: list[tuple[int, str]]) -> list[tuple[int, list[str]]]:
    return [(line, row) for (line, _), row in zip(lines[1:], csv.reader(text for _, text in lines[1:]), strict=True)]


def _number(path: Path, line: int, row: list[str], place: int, name: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise LoopError(f"{path}, line {line}: {name} is {text!r}; give a finite number.")
    return value


def _check(path: Path, rows: Floats) -> None:
    """Refuse what is no loop from end-diastole to end-diastole."""
    time, pressure, volume = rows.T
    if time[0] != 0:
        raise LoopError(f"{path}, row 1: time_ms is {time[0]:g}; begin at 0, the end of diastole.")
    for name, values, bad in (
        ("time_ms", time, np.append(False, np.diff(time) <= 0)),
        ("pressure_mmHg", pressure, pressure <= 0),
        ("volume_uL", volume, volume <= 0),
    ):
        if bad.any():
            row = int(np.argmax(bad))
            rule = "must increase from row to row" if name == "time_ms" else "must be positive"
            raise LoopError(f"{path}, row {row + 1}: {name} is {values[row]:g} and {rule}.")
    for name, values in (("pressure_mmHg", pressure), ("volume_uL", volume)):
        gap = abs(values[-1] - values[0])
        if gap > _CLOSED * np.ptp(values) or np.ptp(values) == 0:
            ends = f"{name} begins at {values[0]:g} and ends at {values[-1]:g}"
            raise LoopError(
                f"{path}: {ends}; end the loop, which must not be flat, with its first row, a period later."
            )
    if volume[0] < volume.min() + _FULL * np.ptp(volume) or pressure[0] > np.mean(pressure):
        first = f"the first row has {volume[0]:g} uL of {volume.max():g} at {pressure[0]:g} mmHg"
        raise LoopError(f"{path}: {first}; begin the loop at end-diastole, full and before the pressure rises.")


def _mapped(path: Path, volume: Floats, edv: float | None, esv: float | None) -> Floats:
    """Volumes mapped linearly so that the first is `edv` and the smallest is `esv` (m^3)."""
    full, empty = volume[0], volume.min()
    edv, esv = full if edv is None else edv, empty if esv is None else esv
    if esv >= edv:
        volumes = f"the end-systolic volume is {esv * 1e9:g} uL and the end-diastolic {edv * 1e9:g} uL"
        raise LoopError(f"{path}: {volumes}; set edv_uL and esv_uL so that the heart ejects.")
    return esv + (volume - empty) * ((edv - esv) / (full - empty))


def _sampled(phase: Floats, values: Floats, at: Floats) -> Floats:
    """Periodic monotone cubic interpolation (Fritsch & Butland 1984)."""
    from scipy.interpolate import PchipInterpolator

    values = np.append(values[:-1], values[0])
    around = np.concatenate([phase[:-1] - 1, phase[:-1], phase + 1])
    return PchipInterpolator(around, np.concatenate([values[:-1], values[:-1], values]))(at)
