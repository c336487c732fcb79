"""The circulation into which the heart ejects and from which it fills, and its calibration on a measured loop.

A three-element Windkessel (Westerhof, Lankhaar & Westerhof, Med Biol Eng Comput 47 (2009) 131) behind the aortic valve,
and an atrium of given pressure behind the mitral one:

    P = P_a + e(t) + Z Q,    Q >= 0         aortic valve; Z is the characteristic resistance of the aorta
    C dP_a/dt = Q - P_a / R                 arteries of compliance C and peripheral resistance R
    R_m Q_m = P_at(t) - P,    Q_m >= 0      mitral valve
    dV/dt = Q_m - Q.

In time implicit Euler steps, whose dt is that of a frame or a part of it. R, R_m, the pressure P_at(t) of the atrium
and the wave e(t) are found so that a measured loop is given back: e is what three elements leave of the measured
pressure while the heart ejects - the reflected waves and the inertia of the blood - and stays the same in disease.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config.loop import Circulation as Settings
from echotruth.loop.cycle import Cycle
from echotruth.loop.phases import EJECTION, FILLING, RELAXATION, phases
from echotruth.loop.recording import LoopError


class Exchange(NamedTuple):
    """What passes the valves in a step of time.

    Attributes
    ----------
    volume : float, m^3
        Into the cavity; negative where it ejects.
    slope : float, m^3/Pa
        Its derivative by the pressure of the cavity; not positive.
    arterial_pressure : float, Pa
        P_a at the end of the step.
    """

    volume: float
    slope: float
    arterial_pressure: float


@dataclass(frozen=True)
class Circulation:
    """A circulation.

    Attributes
    ----------
    period : float, s
        Of the heart beat.
    peripheral_resistance, characteristic_resistance, mitral_resistance : float, Pa s/m^3
        R, Z and R_m.
    compliance : float, m^3/Pa
        C of the arteries.
    reflection, atrial_pressure : ndarray of shape (n_frames,), Pa
        e and P_at at equal steps of one beat; between them they are linear in time.
    arterial_pressure : float, Pa
        P_a at end-diastole, with which the first beat begins.
    """

    period: float
    peripheral_resistance: float
    characteristic_resistance: float
    mitral_resistance: float
    compliance: float
    reflection: Floats
    atrial_pressure: Floats
    arterial_pressure: float

    def exchange(self, pressure: float, arterial_pressure: float, time: float, duration: float) -> Exchange:
        """What passes the valves in a step.

        Parameters
        ----------
        pressure : float, Pa
            Of the cavity at the end of the step.
        arterial_pressure : float, Pa
            P_a at its beginning.
        time : float, s
            Of its end, since the first end-diastole.
        duration : float, s
        """
        kept, gained = _step(self.peripheral_resistance, self.compliance, duration)
        aortic = pressure - self.at(self.reflection, time) - kept * arterial_pressure
        mitral = self.at(self.atrial_pressure, time) - pressure
        resistance = self.characteristic_resistance + gained
        outflow, inflow = max(0.0, aortic / resistance), max(0.0, mitral / self.mitral_resistance)
        slope = (outflow > 0) / resistance + (inflow > 0) / self.mitral_resistance
        arterial = kept * arterial_pressure + gained * outflow
        return Exchange(duration * (inflow - outflow), -duration * slope, arterial)

    def scaled(self, factor: float) -> Circulation:
        """The circulation of a heart whose volumes are a factor larger, at the same pressures."""
        return replace(
            self,
            peripheral_resistance=self.peripheral_resistance / factor,
            characteristic_resistance=self.characteristic_resistance / factor,
            mitral_resistance=self.mitral_resistance / factor,
            compliance=self.compliance * factor,
        )

    def at(self, curve: Floats, time: float) -> float:
        """Value of a periodic curve (n_frames,) at a time since end-diastole, s."""
        frame = time / self.period * len(curve)
        return float(np.interp(frame, np.arange(len(curve)), curve, period=len(curve)))


def calibrate(cycle: Cycle, settings: Settings) -> tuple[Circulation, Cycle]:
    """The circulation that gives a measured loop back, and the loop as it gives it.

    Parameters
    ----------
    cycle : Cycle
        With pressure and volume.
    settings : Circulation
        The section `loop.circulation` of the configuration; of a healthy circulation, whose factors are not used.

    Returns
    -------
    circulation : Circulation
    cycle : Cycle
        The same pressure; the volume stays where the valves are shut, and that of end-systole is the smallest.

    Raises
    ------
    LoopError
        If the loop has no frame of ejection, or none of filling.
    """
    pressure, volume = cycle.pressure, cycle.volume
    assert pressure is not None and volume is not None
    step = cycle.period / len(cycle.time)
    phase = phases(pressure, volume)
    if not (phase == EJECTION).any() or not (phase == FILLING).any():
        what = "ejection" if not (phase == EJECTION).any() else "filling"
        remedy = "raise loop.frames, or leave loop.kind = measured"
        raise LoopError(f"{cycle.source}: with {len(volume)} frames the loop has none of {what}: {remedy}.")
    volume = _with_closed_valves(volume, phase)
    flow = (volume - np.roll(volume, 1)) / step
    outflow, inflow = np.maximum(-flow, 0), np.maximum(flow, 0)
    decay_time = settings.decay_time_periods * cycle.period
    kept, gained = _step(1.0, decay_time, step)
    before = _periodic(kept, gained, outflow)
    # Of a peripheral resistance of one: all pressures of the Windkessel grow with it.
    windkessel = kept * before + (settings.characteristic_share + gained) * outflow
    ejects = outflow > 0
    resistance = float(np.sum(pressure[ejects] * windkessel[ejects]) / np.sum(windkessel[ejects] ** 2))
    excess = pressure - resistance * windkessel
    mitral_resistance = settings.si().mitral_gradient / inflow.max()
    fills = pressure + mitral_resistance * inflow
    circulation = Circulation(
        cycle.period,
        resistance,
        settings.characteristic_share * resistance,
        mitral_resistance,
        decay_time / resistance,
        # Where a valve is shut, the pressure behind it is between those of its last flow and the next, and keeps it so.
        reflection=np.maximum(_held(excess, ejects), np.where(ejects, -np.inf, excess)),
        atrial_pressure=np.minimum(_between(fills, inflow > 0), np.where(inflow > 0, np.inf, pressure)),
        arterial_pressure=resistance * (kept * before[0] + gained * outflow[0]),
    )
    return circulation, replace(cycle, volume=volume)


def altered(circulation: Circulation, settings: Settings) -> Circulation:
    """A calibrated circulation with the factors of its section: other arteries, another filling pressure."""
    return replace(
        circulation,
        peripheral_resistance=settings.resistance * circulation.peripheral_resistance,
        compliance=settings.compliance * circulation.compliance,
        atrial_pressure=settings.preload * circulation.atrial_pressure,
    )


def _with_closed_valves(volume: Floats, phase: NDArray[np.uint8]) -> Floats:
    """Volume (n_frames,) that stays in the isovolumic phases, falls in ejection and rises in filling."""
    ejects, fills = phase == EJECTION, phase == FILLING
    closed = np.full(len(volume), volume[0])
    closed[ejects] = np.minimum.accumulate(np.minimum(volume[ejects], volume[0]))
    end_systolic, smallest = closed[ejects][-1], volume.min()
    closed[phase == RELAXATION] = end_systolic
    filled = (np.maximum.accumulate(volume[fills]) - smallest) / (volume[0] - smallest)
    closed[fills] = end_systolic + np.clip(filled, 0, 1) * (volume[0] - end_systolic)
    return closed


def _step(resistance: float, compliance: float, duration: float) -> tuple[float, float]:
    """Share of P_a that is left after a step, and what it gains from a unit of flow."""
    kept = 1 / (1 + duration / (resistance * compliance))
    return kept, kept * duration / compliance


def _periodic(kept: float, gained: float, flow: Floats) -> Floats:
    """P_a (n_frames,) before each frame of a periodic flow (n_frames,)."""
    arterial = [0.0]
    for value in flow:
        arterial.append(kept * arterial[-1] + gained * float(value))
    # What a beat begins with is left at its end by kept^n.
    first = arterial[-1] / (1 - kept ** len(flow))
    return np.array(arterial[:-1]) + first * kept ** np.arange(len(flow))


def _held(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Values between those known, and before and after them the first and the last."""
    frames = np.flatnonzero(known)
    return np.interp(np.arange(len(values)), frames, values[frames])


def _between(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Values between those known of a periodic curve."""
    frames = np.flatnonzero(known)
    return np.interp(np.arange(len(values)), frames, values[frames], period=len(values))
