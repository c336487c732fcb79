"""Calibration of the circulation on a measured loop.

The resistance and compliance of the arteries follow from the loop, the other compartments from published pressures and
from Regazzoni et al., scaled by stroke volume and period. With the measured flows through the left ventricle the ring
then comes to its steady beat; the two heads are what that leaves of the measured pressure: in ejection, of that behind
the aortic valve, reflected waves and the inertia of the blood; in filling what the atrium has not.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config.loop import Circulation as Settings
from echotruth.loop.circulation import (
    ARTERIES,
    LEFT_ATRIUM,
    LEFT_VENTRICLE,
    PULMONARY_ARTERIES,
    PULMONARY_VEINS,
    REFERENCE_STROKE_VOLUME,
    RIGHT_ATRIUM,
    RIGHT_VENTRICLE,
    VEINS,
    Circulation,
)
from echotruth.loop.cycle import Cycle
from echotruth.loop.phases import EJECTION, FILLING, RELAXATION, phases
from echotruth.loop.recording import LoopError
from echotruth.units import mmHg

_MAX_NEWTON_STEPS = 60


class Chamber(NamedTuple):
    """A chamber of the heart as a time-varying elastance, of a stroke volume of one.

    Attributes
    ----------
    passive, active : float, mmHg
        Elastance at rest, and what contraction adds at its height.
    unstressed : float
    onset, contraction, relaxation : float
        Beginning after end-diastole and durations, in periods of the beat.
    """

    passive: float
    active: float
    unstressed: float
    onset: float
    contraction: float
    relaxation: float

    def elastance(self, phase: Floats) -> Floats:
        """Elastance, mmHg, at fractions of the beat."""
        contracting = (phase - self.onset) % 1.0
        relaxing = contracting - self.contraction
        rise = 0.5 - 0.5 * np.cos(np.pi * contracting / self.contraction)
        fall = 0.5 + 0.5 * np.cos(np.pi * np.clip(relaxing / self.relaxation, 0, 1))
        return self.passive + self.active * np.where(relaxing < 0, rise, fall)


CHAMBERS = {
    RIGHT_ATRIUM: Chamber(
        0.07 * REFERENCE_STROKE_VOLUME, 0.06 * REFERENCE_STROKE_VOLUME, 4 / REFERENCE_STROKE_VOLUME, 0.70, 0.08, 0.80
    ),
    RIGHT_VENTRICLE: Chamber(
        0.029 * REFERENCE_STROKE_VOLUME, 0.55 * REFERENCE_STROKE_VOLUME, 16 / REFERENCE_STROKE_VOLUME, 0.0, 0.34, 0.15
    ),
    LEFT_ATRIUM: Chamber(
        0.09 * REFERENCE_STROKE_VOLUME, 0.07 * REFERENCE_STROKE_VOLUME, 4 / REFERENCE_STROKE_VOLUME, 0.75, 0.13, 0.85
    ),
}
"""Regazzoni et al. 2022; but the passive elastance and V0 of the right ventricle as in the package `circulation` 0.4,
with which the mean pressure of the right atrium is 2 to 4 mmHg."""

PULMONARY_COMPLIANCE = {
    PULMONARY_ARTERIES: 10.0 / REFERENCE_STROKE_VOLUME,
    PULMONARY_VEINS: 16.0 / REFERENCE_STROKE_VOLUME,
}
"""Compliance, 1/mmHg, of a stroke volume of one (likewise)."""

VALVE_DROP, PULMONARY_VEIN_DROP = 0.0075 * REFERENCE_STROKE_VOLUME / 0.8, 0.0015 * REFERENCE_STROKE_VOLUME / 0.8
"""Pressure, mmHg, that drives the mean flow through a valve of the right heart, and from the lung into the atrium."""

AORTIC_DROP = 4.0
"""Pressure, mmHg, lost in the aortic valve by the fastest ejection of the healthy heart: that of blood at 1 m/s, 4 v^2.
In healthy people it is below 1.5 m/s (ACC/AHA guidelines 2006, J Am Coll Cardiol 48, e1)."""

VENOUS_COMPLIANCE = 60.0
"""Compliance of the systemic veins over that of the arteries (conscious rats; Yamamoto, Trippodo, Ishise & Frohlich,
Am J Physiol 238 (1980) H823). The people of Zenker et al. have 111 mL/mmHg, some 55 times the arteries here."""

VENOUS_PRESSURE, RIGHT_ATRIAL_PRESSURE, PULMONARY_PRESSURE = 7.7, 3.0, 14.0
"""Mean pressures, mmHg, of the healthy circulation that set its resistances. Systemic veins: mean circulatory filling
pressure of conscious rats, 7.7 +- 1.1 ("Mean circulatory pressure and vascular compliances in the spontaneously
hypertensive rat", Am J Physiol). Pulmonary arteries: 14 +- 3 in people (Kovacs et al., Eur Respir J 34 (2009) 888)."""

LEAST_PULMONARY_DROP = 5.0
"""Pressure, mmHg, lost in the lung of a heart whose own filling pressure leaves less of 14."""


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
    pressure = cycle.pressure
    assert pressure is not None
    volume = closed_valves(cycle)
    flow = (volume - np.roll(volume, 1)) / (cycle.period / len(volume))
    outflow, inflow = np.maximum(-flow, 0), np.maximum(flow, 0)
    ejects, fills = outflow > 0, inflow > 0
    mitral_resistance = settings.mitral_gradient_mmHg * mmHg / inflow.max()
    behind = pressure + mitral_resistance * inflow
    aortic_valve = AORTIC_DROP * mmHg / outflow.max()
    root = pressure - aortic_valve * outflow
    ring = _healthy(cycle, root, outflow, float(behind[fills].mean()), settings)
    steady, pressures = _beat_of_flows(ring, outflow, inflow, np.where(fills, behind, np.nan))
    characteristic = settings.characteristic_share / ring.conductance[ARTERIES]
    ejecting = root - characteristic * outflow - pressures[:, ARTERIES]
    filling = behind - pressures[:, LEFT_ATRIUM]
    head, conductance = np.zeros((len(volume), 8)), ring.conductance.copy()
    # Where a valve is shut, the head is between those of its last flow and the next, and keeps it so.
    shut = pressure - pressures[:, ARTERIES]
    head[:, LEFT_VENTRICLE] = -np.maximum(_held(ejecting, ejects), np.where(ejects, -np.inf, shut))
    shut = pressure - pressures[:, LEFT_ATRIUM]
    head[:, LEFT_ATRIUM] = np.minimum(_held(filling, fills, len(filling)), np.where(fills, np.inf, shut))
    conductance[LEFT_VENTRICLE] = 1 / (aortic_valve + characteristic)
    conductance[LEFT_ATRIUM] = 1 / mitral_resistance
    volumes = steady.copy()
    volumes[LEFT_VENTRICLE] = volume[0]
    mean = float(np.where(ejects, root, np.maximum(pressure, pressures[:, ARTERIES])).mean())
    given = {"head": head, "conductance": conductance, "aortic_valve": aortic_valve, "set_pressure": mean}
    return replace(ring, volumes=volumes, **given), replace(cycle, volume=volume)


def closed_valves(cycle: Cycle) -> Floats:
    """Volume (n_frames,) of a loop that stays in the isovolumic phases, falls in ejection and rises in filling.

    Raises
    ------
    LoopError
        If the loop has no frame of ejection, or none of filling.
    """
    pressure, volume = cycle.pressure, cycle.volume
    assert pressure is not None and volume is not None
    phase = phases(pressure, volume)
    ejects, fills = phase == EJECTION, phase == FILLING
    if not ejects.any() or not fills.any():
        what = "ejection" if not ejects.any() else "filling"
        remedy = "raise loop.frames, or leave loop.kind = measured"
        raise LoopError(f"{cycle.source}: with {len(volume)} frames the loop has none of {what}: {remedy}.")
    closed = np.full(len(volume), volume[0])
    closed[ejects] = np.minimum.accumulate(np.minimum(volume[ejects], volume[0]))
    end_systolic, smallest = closed[ejects][-1], volume.min()
    closed[phase == RELAXATION] = end_systolic
    filled = (np.maximum.accumulate(volume[fills]) - smallest) / (volume[0] - smallest)
    closed[fills] = end_systolic + np.clip(filled, 0, 1) * (volume[0] - end_systolic)
    return closed


def _healthy(cycle: Cycle, root: Floats, outflow: Floats, filling: float, settings: Settings) -> Circulation:
    """The compartments outside the left ventricle, whose valves are open to given flows alone.

    Parameters
    ----------
    cycle : Cycle
    root : ndarray of shape (n_frames,), Pa
        Pressure behind the aortic valve while it is open.
    outflow : ndarray of shape (n_frames,), m^3/s
    filling : float, Pa
        Mean pressure behind the mitral valve while it is open.
    settings : Circulation
    """
    number, flow = len(outflow), float(outflow.mean())
    stroke_volume, decay_time = flow * cycle.period, settings.decay_time_periods * cycle.period
    step = cycle.period / number
    kept = 1 / (1 + step / decay_time)
    gained = kept * step / decay_time
    windkessel = _periodic(kept, gained, outflow) + settings.characteristic_share * outflow
    # Of a peripheral resistance of one: all pressures above those of the veins grow with it.
    ejects, above = outflow > 0, root - VENOUS_PRESSURE * mmHg
    resistance = float(np.sum(above[ejects] * windkessel[ejects]) / np.sum(windkessel[ejects] ** 2))
    compliance = decay_time / resistance
    elastance, unstressed = np.zeros((number, 8)), np.zeros(8)
    elastance[:, ARTERIES], elastance[:, VEINS] = 1 / compliance, 1 / (VENOUS_COMPLIANCE * compliance)
    for index, value in PULMONARY_COMPLIANCE.items():
        elastance[:, index] = mmHg / (value * stroke_volume)
    for index, chamber in CHAMBERS.items():
        elastance[:, index] = chamber.elastance(np.arange(number) / number) * mmHg / stroke_volume
        unstressed[index] = chamber.unstressed * stroke_volume
    lost = np.zeros(8)
    lost[VEINS] = VENOUS_PRESSURE - RIGHT_ATRIAL_PRESSURE
    lost[[RIGHT_ATRIUM, RIGHT_VENTRICLE]] = VALVE_DROP
    lost[PULMONARY_ARTERIES] = max(PULMONARY_PRESSURE - filling / mmHg, LEAST_PULMONARY_DROP)
    lost[PULMONARY_VEINS] = PULMONARY_VEIN_DROP
    conductance = np.divide(flow, lost * mmHg, out=np.zeros(8), where=lost > 0)
    conductance[ARTERIES] = 1 / resistance
    nothing, volumes = np.zeros((number, 8)), np.ones(8) * stroke_volume
    volumes[ARTERIES] = compliance * resistance * flow
    return Circulation(cycle.period, elastance, nothing, unstressed, conductance, 0.0, volumes, stroke_volume, 0.0)


def _beat_of_flows(ring: Circulation, outflow: Floats, inflow: Floats, behind: Floats) -> tuple[Floats, Floats]:
    """Volumes (8,) at end-diastole and pressures (n_frames, 8) of the beat with given flows through the left ventricle.

    The mean pressure of the left atrium over the frames in which `behind` (n_frames,) is a number is that of `behind`.
    """
    number, open_ = len(outflow), np.isfinite(behind)
    given = np.zeros((number, 8))
    given[:, LEFT_VENTRICLE], given[:, LEFT_ATRIUM] = outflow, inflow
    order = np.arange(1, number + 1) % number
    volumes, step = ring.volumes, ring.period / number
    for _ in range(_MAX_NEWTON_STEPS):
        state, tangent, pressures = volumes, np.eye(8), np.zeros((number, 8))
        level = np.zeros(8)
        for k, frame in enumerate(order, start=1):
            passed = ring.exchange(state, k * step, step, 0.0, given=given[frame])
            state, tangent, pressures[frame] = passed.volumes, passed.tangent @ tangent, passed.pressures
            if open_[frame]:
                level += ring.elastance[frame, LEFT_ATRIUM] * tangent[LEFT_ATRIUM] / open_.sum()
        missing = behind[open_].mean() - pressures[open_, LEFT_ATRIUM].mean()
        # The left ventricle is as it was; what all contain is free, and sets the pressure of the atrium.
        keeps = np.eye(8)[LEFT_VENTRICLE]
        scale = ring.elastance[0, LEFT_ATRIUM]
        matrix = np.vstack([tangent - np.eye(8), level / scale, keeps])
        right = np.concatenate([volumes - state, [missing / scale, 0.0]])
        change = np.linalg.lstsq(matrix, right, rcond=None)[0]
        volumes = volumes + change
        if np.abs(change).max() < 1e-12 * ring.stroke_volume:
            return volumes, pressures
    return volumes, pressures


def _periodic(kept: float, gained: float, flow: Floats) -> Floats:
    """P (n_frames,) at each frame of a periodic flow (n_frames,): P = kept P before + gained flow."""
    found, last = [], 0.0
    for value in flow:
        last = kept * last + gained * float(value)
        found.append(last)
    # What a beat begins with is left at its end by kept^n.
    first = last / (1 - kept ** len(flow))
    return np.array(found) + first * kept ** np.arange(1, len(flow) + 1)


def _held(values: Floats, known: NDArray[np.bool_], period: int | None = None) -> Floats:
    """Values between those known. Before and after them the first and the last, unless the curve has a period."""
    frames = np.flatnonzero(known)
    return np.interp(np.arange(len(values)), frames, values[frames], period=period)
