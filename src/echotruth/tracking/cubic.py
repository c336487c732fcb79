"""The cubic B-spline: shares of four neighbouring coefficients at a fraction u of the way between the middle two.

Double precision; u may be a number, in compiled code too, or an array.
"""

from numba.extending import register_jitable


@register_jitable
def shares(u):
    """Values."""
    v = 1 - u
    return v * v * v / 6, 2 / 3 - u * u * (1 - u / 2), 2 / 3 - v * v * (1 - v / 2), u * u * u / 6


@register_jitable
def slopes(u):
    """First derivatives."""
    v = 1 - u
    return -v * v / 2, u * (1.5 * u - 2), v * (2 - 1.5 * v), u * u / 2


@register_jitable
def bends(u):
    """Second derivatives."""
    v = 1 - u
    return v, 3 * u - 2, 3 * v - 2, u
