"""The mitral valve: two leaflets hinged at the rim of the cavity, open while it fills.

In every plane across the line on which they meet, a leaflet is a strip from the rim. Shut, the two meet below the base
at a third of the radius on the lateral side: the anterior leaflet, on the septal side, is twice as long as the
posterior one, as in adults (e-echocardiography.com, Anatomy of the mitral valve). Open, both point into the cavity. The
angles and the thickness were chosen by eye. There are no chordae.
"""

from math import pi

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.medium.anatomy import rim
from echotruth.imaging.medium.filling import opening, volumes

SHUT, OPEN = pi / 15, 5 * pi / 12
"""Angles of the leaflets below the base, rad."""
MEETING = -1 / 3
"""Where they meet, over half the chord of the rim; the septum is on the positive side."""
THICKNESS = 0.08
"""Thickness over the radius of the rim: 1.7 mm in the human preset."""


class Leaflets:
    """Scatterers in the leaflets.

    Parameters
    ----------
    heart : Heart
    place : ndarray of shape (n, 4)
        Coordinate along the line on which the leaflets meet, over the radius of the rim, -1 to 1; 1 in the anterior and
        -1 in the posterior leaflet; share of the length from the rim; offset across it over the radius of the rim.
    amplitude : ndarray of shape (n,)
    """

    def __init__(self, heart: Heart, place: Floats, amplitude: Floats) -> None:
        self._heart, self._place, self.amplitude = heart, place, amplitude
        self.opening = opening(volumes(heart))

    def positions(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m, in the heart frame."""
        centre, radius = rim(self._heart.positions(frame), self._heart.endo)
        along, side, share, across = self._place.T
        chord = np.sqrt(1 - along**2)
        angle = SHUT + (OPEN - SHUT) * self.opening[frame]
        # Shut, the leaflets are as long as it takes to meet.
        length = (1 - side * MEETING) * chord / np.cos(SHUT) * share
        x = side * (chord - length * np.cos(angle) - across * np.sin(angle))
        z = -length * np.sin(angle) + across * np.cos(angle)
        return centre + radius * np.column_stack([x, along, z])


def seed_leaflets(config: Config, heart: Heart, random: np.random.Generator) -> dict[str, Floats]:
    """Draw scatterers uniformly over the leaflets, as many in a volume as in muscle.

    Parameters
    ----------
    config : Config
    heart : Heart
    random : Generator

    Returns
    -------
    dict of ndarray
        place and amplitude, as :class:`Leaflets` has them. The amplitudes are normally distributed; their variance in a
        volume is that of muscle times the level.
    """
    level = config.realism.neighbours.leaflets_dB
    assert level is not None
    _, radius = rim(heart.positions(0), heart.endo)
    # Both together are as long as the chord; of the square around the rim, candidates in the circle are kept.
    volume = 4 / np.cos(SHUT) * THICKNESS * radius**3
    number = random.poisson(config.phantom.si().density * volume)
    along, across = random.uniform(-1, 1, (2, number))
    side = np.where(random.random(number) < (1 - MEETING) / 2, 1.0, -1.0)
    kept = random.random(number) < np.sqrt(1 - along**2)
    place = np.column_stack([along, side, random.random(number), THICKNESS / 2 * across])[kept]
    return {"place": place, "amplitude": 10 ** (level / 20) * random.standard_normal(len(place))}
