"""An arc of a circle: the shape of a leaflet of a valve in a plane across its edge.

It begins at the origin and is 1 long; its direction turns evenly from a first to a last angle, so that it keeps its
length whatever they are. Angles are from the first coordinate towards the second one.
"""

import numpy as np

from echotruth.arrays import Floats

STRAIGHT = 1e-4
"""Turn, rad, up to which an arc is straight."""


def chord(turn: float) -> float:
    """Distance between the ends of an arc that turns by an angle, rad."""
    return float(np.sinc(turn / 2 / np.pi))


def points(first: float, last: float, share: Floats) -> Floats:
    """Points (n, 2) at shares (n,) of an arc's length, from its first angle to its last one, rad."""
    turn = (last - first) * share
    return (share * np.sinc(turn / 2 / np.pi) * np.stack([np.cos(first + turn / 2), np.sin(first + turn / 2)])).T


def normals(first: float, last: float, share: Floats) -> Floats:
    """Unit normals (n, 2) at shares (n,), by a right angle beyond the direction."""
    angle = first + (last - first) * share
    return np.column_stack([-np.sin(angle), np.cos(angle)])


def inverse(first: float, last: float, position: Floats) -> tuple[Floats, Floats]:
    """Share (n,) of the point that is nearest to a position (n, 2), and distance (n,) from it along the normal."""
    turn = last - first
    if abs(turn) < STRAIGHT:
        direction, normal = np.array([np.cos(first), np.sin(first)]), np.array([-np.sin(first), np.cos(first)])
        return position @ direction, position @ normal
    from_middle = normals(first, last, np.zeros(1)) - turn * position
    angle = np.arctan2(-from_middle[:, 0], from_middle[:, 1]) - first
    # Of the angles that differ by a whole turn, that nearest to the middle of the arc.
    angle -= 2 * np.pi * np.round((angle - turn / 2) / (2 * np.pi))
    return angle / turn, (1 - np.linalg.norm(from_middle, axis=1)) / turn
