"""The circulation in which the heart beats: a closed ring of eight compartments.

Blood goes round, from the left ventricle back into it (after Regazzoni et al., J Comput Phys 457 (2022) 111083):

    0 left ventricle -> 1 systemic arteries -> 2 systemic veins -> 3 right atrium ->
    4 right ventricle -> 5 pulmonary arteries -> 6 pulmonary veins -> 7 left atrium -> 0

    P_i = E_i(t) (V_i - V0_i)                            compartment i; P_0 is that of the finite elements
    q_i = G_i (P_i - P_(i+1) + h_i(t)), not below 0 in a valve           flow out of i into the next
    dV_i/dt = q_(i-1) - q_i.

Valves are behind 0, 3, 4 and 7. Vessels have an elastance 1 / C and no V0, so that V is their stressed volume; that of
right ventricle and atria changes as a cosine. The heads h are zero but for those of the flow out of the left ventricle
and into it, which the measured loop gives (:mod:`.calibration`), and which stay the same in disease.

On its way into the compliance of the arteries blood passes the aortic valve, of resistance R_v, and the root of the
aorta, of characteristic resistance Z: 1 / G_0 = R_v + Z. The head h_0 is the arteries' own: reflected waves and the
inertia of the blood. So the arterial pressure, that of the root, is

    P_a = P_0 - R_v q_0 = P_1 + Z q_0 - h_0           while blood passes the valve,
    P_a = max(P_0, P_1)                               else: until it is accelerated, the root follows the ventricle.

Time goes in implicit Euler steps of a frame or a part of it. What leaves a compartment enters the next, so that the
volume of all is constant but for round-off; `retained` fluid is added to it once. The arterial baroreflex answers the
mean P of the arterial pressure of a beat:

    S = 1 / (1 + exp(k (P - P_healthy))),    R / R_healthy = .4 + 1.2 S,    V0_2 = (.5 - S) U

Zenker, Rubin & Clermont, PLoS Comput Biol 3 (2007) e204, with their k = .1838 / mmHg, range of resistance (.5335 to
2.134 mmHg s/mL) and U = 400 mL of unstressed venous volume, here centred on the healthy pressure; the heart's
period, and the contractility that they let it change as well, stay as configured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.loop import Circulation as Settings
from echotruth.loop.recording import LoopError
from echotruth.units import mmHg

(
    LEFT_VENTRICLE,
    ARTERIES,
    VEINS,
    RIGHT_ATRIUM,
    RIGHT_VENTRICLE,
    PULMONARY_ARTERIES,
    PULMONARY_VEINS,
    LEFT_ATRIUM,
) = range(8)
"""The compartments, in the order in which blood passes them."""

VALVES = np.isin(np.arange(8), (LEFT_VENTRICLE, RIGHT_ATRIUM, RIGHT_VENTRICLE, LEFT_ATRIUM))
"""Whether the flow out of a compartment (8,) passes a valve."""

REFERENCE_STROKE_VOLUME = 70.0
"""Stroke volume, mL, at a period of 0.8 s of the heart of Regazzoni et al., by which parameters scale: that of the
package `circulation` 0.4."""

REFLEX_STEEPNESS, REFLEX_RANGE = 0.1838 / mmHg, (0.4, 1.6)
"""k, 1/Pa, of the baroreflex, and the factors on the peripheral resistance between which it acts."""

REFLEX_VOLUME = 400 / REFERENCE_STROKE_VOLUME
"""U, the unstressed venous volume that it commands, in stroke volumes."""

_MAX_SWITCHES, _MAX_NEWTON_STEPS = 40, 60


class Exchange(NamedTuple):
    """What a step of time changes.

    Attributes
    ----------
    volumes : ndarray of shape (8,), m^3
        Of the compartments at its end.
    slope : float, m^3/Pa
        Derivative of the volume of the left ventricle by its pressure; not positive.
    tangent : ndarray of shape (8, 8)
        Derivative of the volumes by those at its beginning.
    pressures : ndarray of shape (8,), Pa
        At its end.
    arterial_pressure : float, Pa
        In the root of the aorta, at its end.
    """

    volumes: Floats
    slope: float
    tangent: Floats
    pressures: Floats
    arterial_pressure: float


class Cavity(NamedTuple):
    """The left ventricle as others see it: P = pressure + elastance (V - volume).

    Attributes
    ----------
    pressure, volume, elastance : ndarray of shape (n_frames,), Pa, m^3 and Pa/m^3
        At the end of each step of a beat; the last is that of end-diastole.
    """

    pressure: Floats
    volume: Floats
    elastance: Floats


class Steady(NamedTuple):
    """A beat that ends as it began.

    Attributes
    ----------
    volumes : ndarray of shape (8,), m^3
        At end-diastole.
    mean_pressures : ndarray of shape (8,), Pa
    mean_arterial_pressure : float, Pa
        In the root of the aorta.
    """

    volumes: Floats
    mean_pressures: Floats
    mean_arterial_pressure: float


@dataclass(frozen=True)
class Circulation:
    """A circulation.

    Attributes
    ----------
    period : float, s
        Of the heart beat.
    elastance, head : ndarray of shape (n_frames, 8), Pa/m^3 and Pa
        E and h at equal steps of one beat, between which they are linear in time; E of the left ventricle is zero.
    unstressed : ndarray of shape (8,), m^3
        V0.
    conductance : ndarray of shape (8,), m^3/(Pa s)
        G of the flow out of each compartment.
    aortic_valve : float, Pa s/m^3
        R_v.
    volumes : ndarray of shape (8,), m^3
        At end-diastole of the healthy heart, with which the first beat begins.
    stroke_volume : float, m^3
        Of the healthy heart.
    set_pressure : float, Pa
        Mean arterial pressure of the healthy circulation.
    reflex : bool
        Whether the baroreflex acts.
    """

    period: float
    elastance: Floats
    head: Floats
    unstressed: Floats
    conductance: Floats
    aortic_valve: float
    volumes: Floats
    stroke_volume: float
    set_pressure: float
    reflex: bool = False

    def exchange(
        self,
        volumes: Floats,
        time: float,
        duration: float,
        pressure: float,
        elastance: float = 0.0,
        given: Floats | None = None,
    ) -> Exchange:
        """What a step changes.

        Parameters
        ----------
        volumes : ndarray of shape (8,), m^3
            At its beginning.
        time : float, s
            Of its end, since the first end-diastole.
        duration : float, s
        pressure, elastance : float, Pa and Pa/m^3
            The pressure of the left ventricle at the end of the step is pressure + elastance V.
        given : ndarray of shape (8,), m^3/s, optional
            Flows in addition, out of each compartment.
        """
        stiffness, offset = self.at(self.elastance, time), np.zeros(8)
        stiffness[LEFT_VENTRICLE], offset[LEFT_VENTRICLE] = elastance, pressure
        head, added = self.at(self.head, time), np.zeros(8) if given is None else given
        # A flow is G (P_i - P_(i+1) + h), P = stiffness V + rest: with the valves that are open it is linear in V.
        rest = offset - stiffness * self.unstressed
        open_ = np.ones(8, dtype=bool)
        for _ in range(_MAX_SWITCHES):
            conductance = duration * self.conductance * open_
            # dq_i/dP_i = G_i, dq_i/dP_(i+1) = -G_i; V_i gains q_(i-1) and loses q_i.
            by_pressure = _DIVERGENCE @ (conductance[:, None] * _DIFFERENCE)
            matrix = np.eye(8) - by_pressure * stiffness
            constant = _DIVERGENCE @ (conductance * (_DIFFERENCE @ rest + head) + duration * added)
            inverse = np.asarray(np.linalg.inv(matrix), dtype=float)
            after = inverse @ (volumes + constant)
            pressures = stiffness * after + rest
            now = ~VALVES | (_DIFFERENCE @ pressures + head > 0)
            if (now == open_).all():
                break
            open_ = now
        # The volumes that the flows leave, which add up to those before.
        flows = conductance * (_DIFFERENCE @ pressures + head) + duration * added
        after = volumes + _DIVERGENCE @ flows
        slope = float(inverse[LEFT_VENTRICLE] @ by_pressure[:, LEFT_VENTRICLE])
        outflow, before_valve = float(flows[LEFT_VENTRICLE]) / duration, float(pressures[LEFT_VENTRICLE])
        shut = max(before_valve, float(pressures[ARTERIES]))
        root = before_valve - self.aortic_valve * outflow if outflow > 0 else shut
        return Exchange(after, slope, inverse, pressures, root)

    def pressures(self, volumes: Floats, time: float, pressure: float) -> Floats:
        """Pressures (8,), Pa, at volumes (8,), m^3, with that of the left ventricle given."""
        found = self.at(self.elastance, time) * (volumes - self.unstressed)
        found[LEFT_VENTRICLE] = pressure
        return found

    def scaled(self, factor: float) -> Circulation:
        """The circulation of a heart whose volumes are a factor larger, at the same pressures."""
        return replace(
            self,
            elastance=self.elastance / factor,
            unstressed=self.unstressed * factor,
            conductance=self.conductance * factor,
            aortic_valve=self.aortic_valve / factor,
            volumes=self.volumes * factor,
            stroke_volume=self.stroke_volume * factor,
        )

    def at(self, curve: Floats, time: float) -> Floats:
        """Value of a periodic curve (n_frames, ...) at a time since end-diastole, s."""
        frame = time / self.period * len(curve)
        before = int(np.floor(frame + 1e-9))
        share = max(frame - before, 0.0)
        first = curve[before % len(curve)]
        return np.array(first) if share < 1e-9 else (1 - share) * first + share * curve[(before + 1) % len(curve)]

    def answered(self, activity: float) -> Circulation:
        """The circulation at an activity S of the baroreflex; 0.5 is that of the healthy one."""
        conductance, unstressed = self.conductance.copy(), self.unstressed.copy()
        conductance[ARTERIES] /= REFLEX_RANGE[0] + (REFLEX_RANGE[1] - REFLEX_RANGE[0]) * activity
        unstressed[VEINS] += (0.5 - activity) * REFLEX_VOLUME * self.stroke_volume
        return replace(self, conductance=conductance, unstressed=unstressed)

    def steady(self, cavity: Cavity, volumes: Floats) -> tuple[Circulation, Steady]:
        """The circulation with its reflex, and the beat that ends as it begins, with a given left ventricle.

        Parameters
        ----------
        cavity : Cavity
        volumes : ndarray of shape (8,), m^3
            Their sum is kept; the nearer to those of the beat, the sooner it is found.

        Raises
        ------
        LoopError
            If there is none.
        """
        from scipy.optimize import brentq  # whoever only checks a loop needs none

        if not self.reflex:
            return self, _steady(self, cavity, volumes)
        beat = _steady(self.answered(0.5), cavity, volumes)

        def excess(activity: float) -> float:
            nonlocal beat
            beat = _steady(self.answered(activity), cavity, beat.volumes)
            pressure = beat.mean_arterial_pressure
            return activity - 1 / (1 + np.exp(REFLEX_STEEPNESS * (pressure - self.set_pressure)))

        activity = float(brentq(excess, 0.0, 1.0, xtol=1e-4))
        answered = self.answered(activity)
        return answered, _steady(answered, cavity, beat.volumes)


_DIFFERENCE = np.eye(8) - np.roll(np.eye(8), 1, axis=1)
"""Pressure of a compartment less that of the next."""
_DIVERGENCE = np.roll(np.eye(8), 1, axis=0) - np.eye(8)
"""Flow into a compartment less that out of it."""


def altered(circulation: Circulation, settings: Settings) -> Circulation:
    """A calibrated circulation with the factors of its section: other arteries, retained fluid, a reflex."""
    conductance, elastance = circulation.conductance.copy(), circulation.elastance.copy()
    conductance[ARTERIES] /= settings.resistance
    elastance[:, ARTERIES] /= settings.compliance
    volumes = circulation.volumes.copy()
    volumes[VEINS] += settings.retained_volume_stroke_volumes * circulation.stroke_volume
    return replace(
        circulation, conductance=conductance, elastance=elastance, volumes=volumes, reflex=settings.baroreflex
    )


def _steady(circulation: Circulation, cavity: Cavity, volumes: Floats) -> Steady:
    """The beat that ends as it begins, by Newton's method on the map from end-diastole to the next."""
    number = len(cavity.pressure)
    step = circulation.period / number
    offset = cavity.pressure - cavity.elastance * cavity.volume
    for _ in range(_MAX_NEWTON_STEPS):
        state, tangent, mean, arterial = volumes, np.eye(8), np.zeros(8), 0.0
        for k in range(number):
            passed = circulation.exchange(state, (k + 1) * step, step, offset[k], cavity.elastance[k])
            state, tangent, mean = passed.volumes, passed.tangent @ tangent, mean + passed.pressures / number
            arterial += passed.arterial_pressure / number
        # What all contain does not change.
        matrix = np.vstack([tangent - np.eye(8), np.ones(8)])
        change = np.linalg.lstsq(matrix, np.append(volumes - state, 0.0), rcond=None)[0]
        if np.abs(change).max() < 1e-6 * circulation.stroke_volume:
            return Steady(volumes, mean, arterial)
        volumes = volumes + change
    raise LoopError("The circulation has no steady beat: change the heart or loop.circulation less.")
