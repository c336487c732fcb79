"""The active tension at which a heart in fenicsx-pulse has a given pressure and volume: outer root-finds.

Pulse takes one of the two and gives the other; it has no mode for both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from pulse_heart import PulseHeart
from scipy.optimize import brentq

TOLERANCE = 1e-4
"""Relative error of what follows, pressure or volume, at which a tension is taken as found."""

_LEAST_SHARE = 1 / 64
_MOST_SECANTS = 15
_ISOVOLUMIC = 0.01
_FIRST_STEP = 1e3  # Pa
_BRACKET = 0.05
_LEAST_BRACKET = 200.0  # Pa


class Failed(ArithmeticError):
    """A load or a tension that could not be reached."""


@dataclass
class Count:
    """What a search cost."""

    newton_steps: int = 0
    solves: int = 0
    failures: int = 0


class Frame(NamedTuple):
    """A frame that is solved: active tension, pressure, volume (Pa, m^3) and unknowns."""

    tension: float
    pressure: float
    volume: float
    state: list


@dataclass
class Course:
    """A heart on its way through the loop.

    Attributes
    ----------
    heart : PulseHeart
    count : Count
    """

    heart: PulseHeart
    count: Count = field(default_factory=Count)

    def __post_init__(self) -> None:
        self._good = self.heart.state()
        first = self.heart.volume if self.heart.control == "volume" else 0.0
        self._load = np.array([0.0, first])
        self._frames: list[Frame] = []
        self._slope = 0.0

    @property
    def load(self) -> tuple[float, float]:
        """Tension, and pressure or volume, that were reached last."""
        return tuple(self._load.tolist())

    def go(self, tension: float, prescribed: float, guess: list | None = None) -> None:
        """Solve at a load, in steps that are halved where Newton fails."""
        target, start, done, step = np.array([tension, prescribed]), self._load, 0.0, 1.0
        if guess is not None:
            self._start_nearer(guess, tension, prescribed)
        while done < 1:
            load = start + (done + step) * (target - start)
            if not self._solved(load):
                step /= 2
                if step < _LEAST_SHARE:
                    raise Failed(f"no step converges towards a load of {tension:.5g} Pa and {prescribed:.5g}")
                continue
            done += step
            step = min(2 * step, 1 - done)
            self._good, self._load = self.heart.state(), load

    def _solved(self, load: np.ndarray) -> bool:
        """Solve at a load; puts the last solution back if that fails."""
        self.heart.load(*load)
        steps = self.heart.solve()
        self.count.solves += 1
        self.count.newton_steps += steps if steps >= 0 else -steps - 1
        if steps < 0:
            self.count.failures += 1
            self.heart.restore(self._good)
        return steps >= 0

    def _start_nearer(self, guess: list, tension: float, prescribed: float) -> None:
        """Start from a guess if it is nearer to equilibrium than the last solution."""
        self.heart.load(tension, prescribed)
        here = self.heart.residual()
        self.heart.restore(guess)
        if not self.heart.residual() < here:
            self.heart.restore(self._good)

    def begin(self) -> None:
        """Take the present state as the first frame."""
        self._keep(0.0)

    def frame(self, pressure: float, volume: float, method: str) -> float:
        """Find the tension of the next frame, and return it (Pa); the methods are `secant` and `brentq`."""
        follows = "pressure" if self.heart.control == "volume" else "volume"
        given, wanted = (volume, pressure) if follows == "pressure" else (pressure, volume)

        def miss(tension: float, guess: list | None = None) -> float:
            self.go(tension, given, guess)
            relative = getattr(self.heart, follows) / wanted - 1
            return 0.0 if abs(relative) < TOLERANCE else relative

        if method == "brentq":
            tension = self._bracketed(miss)
        else:
            tension = self._secant(miss, *self._predicted(pressure, volume))
        self._keep(tension)
        return tension

    def _keep(self, tension: float) -> None:
        frame = Frame(tension, self.heart.pressure, self.heart.volume, self.heart.state())
        self._frames = [*self._frames[-1:], frame]

    def _predicted(self, pressure: float, volume: float) -> tuple[float, list | None]:
        """Tension and unknowns straight on from the last two frames: over pressure at constant volume, else in time."""
        if len(self._frames) < 2:
            return self._frames[-1].tension, None
        first, last = self._frames
        share = 1.0
        if max(abs(last.volume - first.volume), abs(volume - last.volume)) < _ISOVOLUMIC * volume:
            share = (pressure - last.pressure) / (last.pressure - first.pressure)
        tension = last.tension + share * (last.tension - first.tension)
        return tension, [n + share * (n - o) for o, n in zip(first.state, last.state, strict=True)]

    @property
    def _sign(self) -> int:
        """A larger tension raises the pressure, and lowers the volume."""
        return 1 if self.heart.control == "volume" else -1

    def _secant(self, miss: Callable[..., float], tension: float, guess: list | None) -> float:
        """Secant steps from a predicted tension and unknowns; the first slope is that of the last frame."""
        error = miss(tension, guess)
        for _ in range(_MOST_SECANTS):
            if error == 0:
                return tension
            step = -error / self._slope if self._slope else -self._sign * np.sign(error) * _FIRST_STEP
            following = miss(tension + step)
            slope = (following - error) / step
            # Where the miss is small the quotient may be noise; the slope has a known sign.
            self._slope = slope if slope * self._sign > 0 else self._slope
            tension, error = tension + step, following
        raise Failed(f"the secant does not converge near {tension:.5g} Pa")

    def _bracketed(self, miss: Callable[..., float]) -> float:
        """Brent's method in a bracket that is widened from the last tension until it holds the root."""
        seen: dict[float, float] = {}

        def known(tension: float) -> float:
            if tension not in seen:
                seen[tension] = miss(tension)
            return seen[tension]

        near = far = self._frames[-1].tension
        width = max(_BRACKET * near, _LEAST_BRACKET)
        error = known(near)
        upward = -np.sign(error) * self._sign
        while error * known(far) > 0:
            near, far = far, far + upward * width
            width *= 2
        return float(brentq(known, near, far, xtol=1e-3)) if error else near
