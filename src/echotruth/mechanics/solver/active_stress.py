"""Active stress of the muscle along an axis of the wall, and its derivative by the strain there."""

from math import sqrt
from typing import NamedTuple

from numba import njit


class ActiveLaw(NamedTuple):
    """Constants of the active stress.

    Attributes
    ----------
    length_dependence : float
        beta, by which the tension grows with the stretch.
    power : float
        Of the stretch by which the tension is divided: 2 for a tension per deformed area, as in the paper's equations 2
        and 3; 0 for a tension that is the second Piola-Kirchhoff stress, as in Land et al. 2015.
    max_velocity : float, 1/s
        Shortening velocity of the unloaded muscle, in unloaded lengths; infinite for a tension that does not depend on
        the velocity.
    curvature : float
        a / F_0 of Hill's hyperbola.
    eccentric_max : float
        Force to which that of a muscle tends which is stretched ever faster, over the isometric one.
    """

    length_dependence: float = 0.0
    power: float = 2.0
    max_velocity: float = float("inf")
    curvature: float = 0.25
    eccentric_max: float = 1.5


@njit(cache=True, error_model="numpy")
def force_velocity(velocity: float, law: ActiveLaw) -> tuple[float, float]:
    """Force of a muscle over the isometric one, and its derivative by the velocity.

    Hill's hyperbola where it shortens, h = (1 + w) / (1 - w / k) with w = velocity / max_velocity and the curvature k
    (Hill, Proc R Soc B 126 (1938) 136), and no force from w = -1 on. Where it is stretched, the hyperbola that goes on
    from there with the same slope, (1 + k) / k, to its bound.

    Parameters
    ----------
    velocity : float, 1/s
        Rate of the stretch; negative where the muscle shortens.
    law : ActiveLaw

    Returns
    -------
    force, slope : float
        h, and its derivative (s).
    """
    w, k, excess = velocity / law.max_velocity, law.curvature, law.eccentric_max - 1
    slope = (1 + k) / (k * law.max_velocity)
    if w <= -1:
        return 0.0, 0.0
    if w <= 0:
        shortened = 1 - w / k
        return (1 + w) / shortened, slope / shortened**2
    stretched = excess / (excess + w * (1 + k) / k)
    return 1 + excess * (1 - stretched), slope * stretched**2


@njit(cache=True, error_model="numpy")
def active_stress(c: float, previous_c: float, rate: float, law: ActiveLaw) -> tuple[float, float]:
    """Second Piola-Kirchhoff stress S = h [1 + beta (lambda - 1)] / lambda^power along an axis, for a tension of one.

    The tension of every cell is that of :class:`.activation.Activation`, the axes and their shares of it those of
    :func:`.stress_point.evaluate`, h that of :func:`force_velocity` for the velocity since the previous state.

    Parameters
    ----------
    c, previous_c : float
        Component of the right Cauchy-Green tensor along the axis, the square of the stretch lambda, now and in the
        previous state.
    rate : float, 1/s
        One over the time since that state; 0 at rest.
    law : ActiveLaw

    Returns
    -------
    stress, tangent : float
        S and its derivative by the strain (c - 1) / 2.
    """
    stretch = sqrt(c)
    force, slope = 1.0, 0.0
    if rate > 0:
        force, slope = force_velocity((stretch - sqrt(previous_c)) * rate, law)
    per_area, falls = deformed_area(c, law)
    longer = 1 + law.length_dependence * (stretch - 1)
    isometric, growth = longer * per_area, law.length_dependence * per_area / stretch + longer * falls
    return force * isometric, force * growth + slope * rate * isometric / stretch


@njit(cache=True, error_model="numpy")
def deformed_area(c: float, law: ActiveLaw) -> tuple[float, float]:
    """Second Piola-Kirchhoff stress 1 / lambda^power of a tension of one along an axis, and its tangent by the strain.

    `c` is the square of the stretch lambda along the axis."""
    per_area = 1 / c if law.power == 2 else c ** (-law.power / 2)  # a power takes as long as all else here
    return per_area, -law.power * per_area / c
