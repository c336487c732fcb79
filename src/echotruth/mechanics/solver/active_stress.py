"""Active stress of the muscle along an axis of the wall, and its derivative by the strain there."""

from math import sqrt

from numba import njit


@njit(cache=True, error_model="numpy")
def active_stress(c: float, beta: float, power: float) -> tuple[float, float]:
    """Second Piola-Kirchhoff stress S = [1 + beta (lambda - 1)] / lambda^power along an axis, for a tension of one.

    Power 2 is the tension per deformed area of the paper's equations 2 and 3; power 0 the tension as second
    Piola-Kirchhoff stress, as in Land et al. 2015. The tension of every cell is that of
    :class:`.activation.Activation`, the axes and their shares of it those of :func:`.stress_point.evaluate`.

    Parameters
    ----------
    c : float
        Component of the right Cauchy-Green tensor along the axis, the square of the stretch lambda.
    beta : float
        Dependence on the length of the fibres.
    power : float

    Returns
    -------
    stress, tangent : float
        S and its derivative by the strain (c - 1) / 2.
    """
    stretch = sqrt(c)
    stress = (1 + beta * (stretch - 1)) * stretch**-power
    return stress, (beta * stretch ** (-power) - power * stress / stretch) / stretch
