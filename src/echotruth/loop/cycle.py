"""The cycle that drives the heart: read from a CSV file, checked, scaled and sampled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise, starmap
from pathlib import Path

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config, Geometry
from echotruth.config.anatomy import HEART_PRESETS
from echotruth.config.loop import Loop, Prescribed
from echotruth.loop.phases import es_frame
from echotruth.loop.recording import LoopError, Recording, read
from echotruth.units import mmHg, per_min, uL

SHIPPED = Path(__file__).parent / "recordings"

SPECIES_OF = {species: species for species in HEART_PRESETS} | {"twitch": "mouse"}
"""Shipped cycle -> species whose ellipsoid it suits."""

PRESCRIBED: dict[Prescribed, tuple[str, ...]] = {
    "pressure_volume": ("pressure", "volume"),
    "pressure": ("pressure", "tension"),
    "volume": ("volume",),
}
"""Value of `loop.prescribed` -> quantities that the file must have; `volume` takes a tension too where there is one."""

_CURVES = ("pressure", "volume", "tension")

_MAX_GAP = 0.03
"""Largest difference of the last row from the first, over the range: noise keeps a measured loop from closing."""
_MAX_FILLING = 4.0
"""Largest factor between end-diastolic volume and unloaded cavity: it is 1.7 to 2.1 for pressures up to 20 mmHg (Klotz
et al., Am J Physiol Heart Circ Physiol 291 (2006) H403), and 10 or more where a unit is wrong."""
_MIN_FIRST_VOLUME = 0.95
"""Smallest volume of the first row, on a scale from 0 (smallest) to 1 (largest)."""
_MAX_FIRST_TENSION = 0.05
"""Largest tension of the first row, over the largest: end-diastole is passive."""


@dataclass(frozen=True)
class Cycle:
    """One closed cycle of one beat or more, at equal steps of time, beginning at end-diastole.

    Attributes
    ----------
    source : str
        File it came from.
    prescribed : "pressure_volume", "pressure" or "volume"
        What is prescribed.
    period : float, s
    time : ndarray of shape (n_frames,), s
    pressure : ndarray of shape (n_frames,), Pa, or None if it is to be solved
    volume : ndarray of shape (n_frames,), m^3, or None if it is to be solved
    tension : ndarray of shape (n_frames,), Pa, or None if it is to be solved
        Active tension T_Ca.
    starts : tuple of int
        First frame of each beat, at end-diastole, and then the number of frames.
    """

    source: str
    prescribed: Prescribed
    period: float
    time: Floats
    pressure: Floats | None
    volume: Floats | None
    tension: Floats | None
    starts: tuple[int, ...]

    @property
    def beats(self) -> list[slice]:
        """Frames of each beat."""
        return list(starmap(slice, pairwise(self.starts)))

    @property
    def edv(self) -> float:
        """End-diastolic volume, m^3, if volumes are prescribed."""
        assert self.volume is not None
        return float(self.volume[0])

    @property
    def systole(self) -> list[int]:
        """Frames from end-diastole to end-systole of the first beat.

        Raises
        ------
        LoopError
            Unless pressure and volume are prescribed.
        """
        if self.pressure is None or self.volume is None:
            raise LoopError(f"{self.source}: has no pressure or no volume, and so no end-systole: use pressure_volume")
        first = self.beats[0]
        return list(range(es_frame(self.pressure[first], self.volume[first]) + 1))

    def at(self, frames: Sequence[int]) -> Cycle:
        """The cycle in some of its frames, of which the first is end-diastole."""
        chosen = list(frames)
        pressure, volume, tension = (None if curve is None else curve[chosen] for curve in self._curves)
        starts = tuple(np.searchsorted(chosen, self.starts).tolist())
        return replace(self, time=self.time[chosen], pressure=pressure, volume=volume, tension=tension, starts=starts)

    @property
    def _curves(self) -> tuple[Floats | None, ...]:
        return self.pressure, self.volume, self.tension

    def scaled(self, factor: float) -> Cycle:
        """The cycle with its volumes times a factor, and the same ejection fraction."""
        return replace(self, volume=None if self.volume is None else factor * self.volume)


def heart_cycle(config: Config) -> Cycle:
    """The cycle of the heart of a configuration: as of :func:`read_loop`, by its :func:`size`."""
    return read_loop(config.loop, size(config))


def size(config: Config) -> float:
    """Factor on the volumes of the loop's file, where the section gives none.

    A shipped loop is that of the ellipsoid of its species. In another ellipsoid its volumes are in proportion to that
    of the cavity, so that a heart that is larger fills by as much and ejects the same fraction. With `loop.kind:
    circulation` it is the loop of the heart before it was dilated.
    """
    geometry, species = config.geometry, SPECIES_OF.get(config.loop.file)
    if species is None or geometry.file:
        return 1.0
    if config.loop.kind == "circulation":
        geometry = geometry.model_copy(update={"dilation": 1.0})
    return geometry.cavity_uL() / Geometry(preset=species).cavity_uL()


def read_loop(loop: Loop, size: float = 1.0) -> Cycle:
    """Read, check, scale and sample a cycle.

    Parameters
    ----------
    loop : Loop
    size : float
        Factor on the volumes of the file, where the section gives none.

    Returns
    -------
    Cycle
        Interpolated between the rows of the file by a monotone cubic (PCHIP), periodic in time; of each beat the
        volume is V_ED + stroke (V - V_ED), over its frames.

    Raises
    ------
    LoopError
        If the file cannot be read or holds no valid cycle: one sentence with the file, the row and the remedy.
    """
    recording, curves = _read_recording(loop), recorded_curves(loop, size)
    time = curves.pop("time")
    assert time is not None
    starts = np.array(loop.beat_starts)
    frames = np.diff(starts)
    phase = (np.arange(loop.frames) - np.repeat(starts[:-1], frames)) / np.repeat(frames, frames)
    sampled = {
        name: None if values is None else _resample(time / time[-1], values, phase) for name, values in curves.items()
    }
    if sampled["volume"] is not None:
        stroke = np.repeat([beat.stroke for beat in loop.beats], frames)
        sampled["volume"] = stroke * sampled["volume"] + (1 - stroke) * sampled["volume"][0]
    if loop.prescribed == "volume" and sampled["tension"] is None:
        sampled["tension"] = np.zeros(loop.frames)
    period, time = _period(recording, loop), frame_times(loop)
    return Cycle(str(recording.path), loop.prescribed, period, time, **sampled, starts=tuple(loop.beat_starts))


def check_loop(loop: Loop, size: float = 1.0) -> None:
    """Check all that :func:`read_loop` does, in less time.

    Raises
    ------
    LoopError
        If the file cannot be read or holds no valid cycle.
    """
    recorded_curves(loop, size)


def check_filling(config: Config, cavity: float) -> None:
    """Refuse volumes that the heart cannot have, as those in another unit.

    Parameters
    ----------
    config : Config
    cavity : float
        Volume of the cavity of the given geometry, m^3.

    Raises
    ------
    LoopError
        If its end-diastolic volume is far from that of the loop.
    """
    loop, volume = config.loop, recorded_curves(config.loop, size(config))["volume"]
    healthy = cavity / config.geometry.dilation**3 if loop.kind == "circulation" else cavity
    if volume is None or 1 / _MAX_FILLING <= volume[0] / healthy <= _MAX_FILLING:
        return
    key = f"file = {loop.file!r}" if loop.edv_uL is None else f"edv_uL = {loop.edv_uL:g}"
    filled, empty = (f"{float(f'{amount * 1e9:.3g}'):,g} uL" for amount in (volume[0], healthy))
    geometry = config.geometry
    place = f"in {geometry.file} with geometry.unit = {geometry.unit}" if geometry.file else "in the section geometry"
    volumes = f"the heart fills to {filled}, and its cavity {place} holds {empty}"
    remedy = f"mend the unit of the one or of the other, so that they are within a factor of {_MAX_FILLING:g}"
    raise LoopError(f"loop.{key}: {volumes}: {remedy}.")


def frame_times(loop: Loop) -> Floats:
    """Times of the frames of a cycle, (n_frames,), s.

    Raises
    ------
    LoopError
        If the file cannot be read or its curves are not valid.
    """
    return np.arange(loop.frames) / loop.frames * period(loop)


def period(loop: Loop) -> float:
    """Period of a cycle, of all its beats, s; raises as :func:`frame_times`."""
    return _period(_read_recording(loop), loop)


def recorded_curves(loop: Loop, size: float = 1.0) -> dict[str, Floats | None]:
    """Curves at the rows of the file, mapped to the volumes and pressures of the loop.

    Parameters
    ----------
    loop : Loop
    size : float
        Factor on the volumes of the file, where the section gives none.

    Returns
    -------
    dict
        `time` (s, as in the file), `pressure` (Pa), `volume` (m^3) and `tension` (Pa), each (n_rows,) or None.

    Raises
    ------
    LoopError
        If the file cannot be read or its curves are not valid.
    """
    recording = _read_recording(loop)
    curves = {quantity: recording.si(quantity) for quantity in ("time", *_CURVES)}
    if curves["pressure"] is not None:
        curves["pressure"] = _map_pressure(recording.path, curves["pressure"], curves["volume"], loop)
    if curves["volume"] is not None:
        curves["volume"] = _map_volume(recording.path, curves["volume"], loop, size)
    return curves


def _period(recording: Recording, loop: Loop) -> float:
    """Duration of a cycle, of all its beats, s."""
    time, rate = recording.si("time"), loop.heart_rate_per_min
    assert time is not None
    return sum(beat.length for beat in loop.beats) * (float(time[-1]) if rate is None else 1 / (rate * per_min))


def _read_recording(loop: Loop) -> Recording:
    """Columns of the file that `loop.prescribed` needs, and no others; its curves are checked."""
    path = SHIPPED / f"{loop.file}.csv"
    path = path if path.is_file() else Path(loop.file)
    if not path.is_file():
        shipped = ", ".join(sorted(file.stem for file in SHIPPED.glob("*.csv")))
        remedy = f"give the path of a CSV file from the working folder, or the name of a shipped loop ({shipped})"
        raise LoopError(f"{path}: there is no file {path.absolute()}; {remedy}.")
    state = path.stat()
    return _checked(path, loop.prescribed, (str(path.resolve()), state.st_ino, state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=64)
def _checked(path: Path, prescribed: Prescribed, version: tuple[str | int, ...]) -> Recording:
    """Recording in a file, read once as long as the file does not change: thousands of hearts may share it."""
    needed = ("time", *PRESCRIBED[prescribed])
    recording = read(path, f"loop.prescribed = {prescribed}", needed, ("tension",) if prescribed == "volume" else ())
    _check_time(recording)
    for quantity in _CURVES:
        if quantity in recording.names:
            _check_curve(recording, quantity)
    _check_end_diastole(recording)
    return recording


def _check_time(recording: Recording) -> None:
    path, name, time = recording.path, recording.names["time"], recording.columns["time"]
    if time[0] != 0:
        raise LoopError(f"{path}, row 1: {name} is {time[0]:g}; begin at 0, the end of diastole.")
    not_later = np.append(False, np.diff(time) <= 0)
    if not_later.any():
        row = int(np.argmax(not_later))
        raise LoopError(f"{path}, row {row + 1}: {name} is {time[row]:g} and must increase from row to row.")


def _check_curve(recording: Recording, quantity: str) -> None:
    """Refuse a curve that is negative, flat or not closed; a tension may be zero."""
    path, name, values = recording.path, recording.names[quantity], recording.columns[quantity]
    invalid = values < 0 if quantity == "tension" else values <= 0
    if invalid.any():
        row, rule = int(np.argmax(invalid)), "must not be negative" if quantity == "tension" else "must be positive"
        raise LoopError(f"{path}, row {row + 1}: {name} is {values[row]:g} and {rule}.")
    flat = np.ptp(values) == 0 and quantity != "tension"
    if flat or abs(values[-1] - values[0]) > _MAX_GAP * np.ptp(values):
        ends = f"{name} begins at {values[0]:g} and ends at {values[-1]:g}"
        raise LoopError(f"{path}: {ends}; a loop must not be flat, and must end with its first row, one period later.")


def _check_end_diastole(recording: Recording) -> None:
    """Refuse a cycle that does not begin full, slack and before the pressure rises."""
    rules = {
        "volume": lambda volume: volume[0] >= volume.min() + _MIN_FIRST_VOLUME * np.ptp(volume),
        "pressure": lambda pressure: pressure[0] <= np.mean(pressure),
        "tension": lambda tension: tension[0] <= _MAX_FIRST_TENSION * tension.max(),
    }
    for quantity, holds in rules.items():
        if quantity in recording.columns and not holds(recording.columns[quantity]):
            values, name = recording.columns[quantity], recording.names[quantity]
            first = f"the first row has {name} {values[0]:g} of {values.min():g} to {values.max():g}"
            remedy = "begin the loop at end-diastole, full, slack and before the pressure rises"
            if quantity == "volume":
                remedy += f": row {np.argmax(values) + 1} has the largest volume"
            raise LoopError(f"{recording.path}: {first}; {remedy}.")


def _map_volume(path: Path, volume: Floats, loop: Loop, size: float) -> Floats:
    """Volumes mapped linearly so that the first is `edv_uL` and the smallest `esv_uL`, by default those of the
    file times a factor."""
    first, smallest = volume[0], volume.min()
    edv = size * first if loop.edv_uL is None else loop.edv_uL * uL
    esv = size * smallest if loop.esv_uL is None else loop.esv_uL * uL
    if esv >= edv:
        volumes = f"the end-systolic volume is {esv * 1e9:g} uL and the end-diastolic {edv * 1e9:g} uL"
        raise LoopError(f"{path}: {volumes}; set edv_uL and esv_uL so that the heart ejects.")
    stroke, most = max(beat.stroke for beat in loop.beats), edv / (edv - esv)
    if stroke >= most:
        raise LoopError(f"loop.beats: a stroke of {stroke:g} empties the heart; give less than {most:.3g}.")
    return esv + (volume - smallest) * ((edv - esv) / (first - smallest))


def _map_pressure(path: Path, pressure: Floats, volume: Floats | None, loop: Loop) -> Floats:
    """Pressures mapped so that the first is `edp_mmHg` and that of end-systole `esp_mmHg`.

    Up to the first they are scaled, so that they stay positive; above it the map is linear.
    """
    first = pressure[0]
    last = float(pressure.max()) if volume is None else float(pressure[es_frame(pressure, volume)])
    edp = first if loop.edp_mmHg is None else loop.edp_mmHg * mmHg
    esp = last if loop.esp_mmHg is None else loop.esp_mmHg * mmHg
    if esp <= edp:
        pressures = f"the end-systolic pressure is {esp:.4g} Pa and the end-diastolic {edp:.4g} Pa"
        raise LoopError(f"{path}: {pressures}; set edp_mmHg and esp_mmHg so that the pressure rises.")
    above = edp + (pressure - first) * ((esp - edp) / (last - first))
    return np.where(pressure <= first, pressure * (edp / first), above)


def _resample(phase: Floats, values: Floats, at: Floats) -> Floats:
    """Periodic monotone cubic interpolation (Fritsch & Butland 1984) of a curve (row,)."""
    from scipy.interpolate import PchipInterpolator

    values = np.concatenate([values[:-1], values[:1]])
    three_periods = np.concatenate([phase[:-1] - 1, phase[:-1], phase + 1])
    return PchipInterpolator(three_periods, np.concatenate([values[:-1], values[:-1], values]))(at)
