"""Cubic B-spline basis functions of the four coefficients around a point, and their derivatives.

Double precision; u is the fraction of the way between the middle two coefficients, a number (in compiled code too) or
an array.
"""

from numba.extending import register_jitable


@register_jitable
def bspline_weights(u):
    """Values of the four basis functions: the weights of the coefficients."""
    v = 1 - u
    return v * v * v / 6, 2 / 3 - u * u * (1 - u / 2), 2 / 3 - v * v * (1 - v / 2), u * u * u / 6


@register_jitable
def first_derivatives(u):
    """First derivatives with respect to u."""
    v = 1 - u
    return -v * v / 2, u * (1.5 * u - 2), v * (2 - 1.5 * v), u * u / 2


@register_jitable
def second_derivatives(u):
    """Second derivatives with respect to u."""
    v = 1 - u
    return v, 3 * u - 2, 3 * v - 2, u
