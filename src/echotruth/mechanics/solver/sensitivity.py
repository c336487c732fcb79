"""Derivatives of the solved states of a heart by its parameters, from the tangent that the solver factors.

Of a step from the state x_(k-1) to x_k with the residual r(x_k, x_(k-1), x_ED, q) = 0, a parameter q changes

    dx_k/dq = -J^-1 (dr/dx_(k-1) dx_(k-1)/dq + dr/dx_ED dx_ED/dq + dr/dq),    J = dr/dx_k,

x_ED being the state of end-diastole, at which the pericardium rests. The sum in brackets is a difference of two
residuals: that of the heart with q + h, whose earlier states are changed by h dx/dq, less that of this one. So any
parameter is treated alike, those of geometry and fibres too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.loop.cycle import Cycle
from echotruth.mechanics.solver.equilibrium import (
    Correction,
    Equilibrium,
    Load,
    PreviousState,
    Residual,
    State,
    Unknown,
)
from echotruth.mechanics.solver.newton import Step, linear_combination


@dataclass(frozen=True)
class Variant:
    """A heart in its measured loop, or the same with one parameter changed by a little.

    Attributes
    ----------
    equations : Equilibrium
        Without a state of end-diastole.
    cycle : Cycle
        With pressure and volume.
    tension_scale : ndarray of shape (n_cells,)
    change : float
        h, in the unit of the parameter; 0 of the heart itself.
    stiffness : float, optional, Pa
        C, if it is given and not found at end-diastole.
    """

    equations: Equilibrium
    cycle: Cycle
    tension_scale: Floats
    change: float = 0.0
    stiffness: float | None = None

    def load(self, frame: int) -> Load:
        """Load of a frame; at end-diastole nothing is active."""
        assert self.cycle.pressure is not None and self.cycle.volume is not None
        fraction = self.tension_scale if frame else 0.0
        pressure, volume = float(self.cycle.pressure[frame]), float(self.cycle.volume[frame])
        return Load(pressure, volume, fraction, time=float(self.cycle.time[frame]))

    def target(self, frame: int, step: Step) -> Load:
        """Load at the end of a step to a frame."""
        return self.load(frame - 1).toward(self.load(frame), step.ended)

    def duration(self, frame: int, step: Step) -> float:
        """Time that a step to a frame takes, s."""
        return (step.ended - step.begun) * float(self.cycle.time[frame] - self.cycle.time[frame - 1])


class Derivative(NamedTuple):
    """Derivatives by one parameter.

    Attributes
    ----------
    states : list of State
        dx/dq of each frame; `tension` and `stiffness` are those of T_Ca and C.
    volume : ndarray of shape (n_frames,), m^3
        Of the volume of the cavity.
    """

    states: list[State]
    volume: Floats


def derivatives(
    heart: Variant, steps: Sequence[Step], filled: Unknown, variants: Sequence[Variant]
) -> list[Derivative]:
    """Derivatives of a solved cycle by some parameters.

    Parameters
    ----------
    heart : Variant
        Its equations give exact corrections.
    steps : sequence of Step
        All that were solved from end-diastole on.
    filled : {"stiffness", None}
        Unknown of end-diastole: C, or the volume.
    variants : sequence of Variant
        On meshes with the same cells.

    Returns
    -------
    list of Derivative
        Of each variant.
    """
    equations, at_ed, frame = heart.equations, steps[0].before, 0
    heart = _scaled(heart, at_ed) if filled is None else heart
    tangent = equations.linearize(at_ed, heart.load(0), filled)
    base = equations.residual(at_ed, heart.load(0), filled)
    paths = [_Path(variant, at_ed, filled) for variant in variants]
    for path in paths:
        path.fill(tangent.correction, base)
    equations.rest_at(at_ed)
    solved = [at_ed]
    for step in steps:
        frame += step.begun == 0
        target = heart.target(frame, step)
        equations.set_previous(PreviousState(step.before, heart.duration(frame, step)))
        tangent = equations.linearize(step.after, target, step.unknown)
        base = equations.residual(step.after, target, step.unknown)
        for path in paths:
            path.advance(frame, step, tangent.correction, base)
        solved += [step.after] if step.ended == 1 else []
    volume = np.array([equations.volume(state) for state in solved])
    return [path.derivative(solved, volume) for path in paths]


class _Path:
    """The derivative of the states by the parameter of one variant, step after step."""

    def __init__(self, variant: Variant, at_ed: State, filled: Unknown) -> None:
        self._variant, self._at_ed, self._filled = variant, at_ed, filled
        self._states: list[State] = []

    def fill(self, correction: Callable[[Residual], Correction], base: Residual) -> None:
        """Take the derivative at end-diastole, given the residual of the heart itself there."""
        equations, given = self._variant.equations, self._variant.stiffness
        state = self._at_ed if given is None else replace(self._at_ed, stiffness=given)
        changed = equations.residual(state, self._variant.load(0), self._filled)
        stiffer = (state.stiffness - self._at_ed.stiffness) / self._variant.change
        self._last = self._divided(correction(_difference(changed, base)), self._filled, stiffer)
        self._states.append(self._last)
        filled = self._moved(self._at_ed)
        equations.rest_at(filled)
        if self._filled is None:
            self._variant = _scaled(self._variant, filled)

    def advance(self, frame: int, step: Step, correction: Callable[[Residual], Correction], base: Residual) -> None:
        """Take the derivative after a step to a frame, given the residual of the heart itself there."""
        equations, variant = self._variant.equations, self._variant
        equations.set_previous(PreviousState(self._moved(step.before), variant.duration(frame, step)))
        stiffness = step.after.stiffness + variant.change * self._last.stiffness
        after = replace(step.after, stiffness=stiffness)
        changed = equations.residual(after, variant.target(frame, step), step.unknown)
        self._last = self._divided(correction(_difference(changed, base)), step.unknown, self._last.stiffness)
        if step.ended == 1:
            self._states.append(self._last)

    def derivative(self, solved: Sequence[State], volume: Floats) -> Derivative:
        """The derivative, given the states and volumes (n_frames,), m^3, of the heart itself."""
        moved = (
            linear_combination(pair, (1.0, self._variant.change)) for pair in zip(solved, self._states, strict=True)
        )
        changed = np.array([self._variant.equations.volume(state) for state in moved])
        return Derivative(self._states, (changed - volume) / self._variant.change)

    def _moved(self, state: State) -> State:
        """The state of the variant."""
        return linear_combination((state, self._last), (1.0, self._variant.change))

    def _divided(self, change: Correction, unknown: Unknown, stiffness: float) -> State:
        h = self._variant.change
        scalar = {unknown: change.scalar / h} if unknown else {}
        return State(change.solution / h, change.cell_pressure / h, **({"stiffness": stiffness} | scalar))


def _scaled(heart: Variant, at_ed: State) -> Variant:
    """A heart of given C, whose loop has the volume to which it is filled."""
    return replace(heart, cycle=heart.cycle.scaled(heart.equations.volume(at_ed) / heart.cycle.edv))


def _difference(changed: Residual, base: Residual) -> Residual:
    """Residual of a variant less that of the heart."""
    return replace(
        base,
        force=changed.force - base.force,
        volumetric=changed.volumetric - base.volumetric,
        volume=changed.volume - base.volume,
    )
