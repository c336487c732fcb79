"""A ring of speckle that contracts, of which the motion is known."""

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from echotruth.echo.wall import Wall

SIDE, CENTRE = 160, 79.5
ENDO, EPI = 36.0, 60.0
FRAMES, LEAST = 10, 0.3
"""Number of frames of a cycle, and the share by which the area of the cavity falls."""


class Ring:
    """A wall that keeps its area: tissue at radius r is at sqrt(r^2 - a) when the square of the radius has lost a."""

    def __init__(self):
        self.lost = LEAST * ENDO**2 * np.sin(np.pi * np.arange(FRAMES) / FRAMES) ** 2
        noise = np.random.default_rng(3).normal(size=(SIDE, SIDE))
        texture = gaussian_filter(noise, 1.2)
        self.texture = 128 + 45 * texture / texture.std()
        self.frames = np.stack([self._frame(lost) for lost in self.lost])

    def _frame(self, lost):
        axial, lateral = np.mgrid[:SIDE, :SIDE] - CENTRE
        radius = np.hypot(lateral, axial)
        first = np.sqrt(radius**2 + lost)
        stretch = first / np.maximum(radius, 1e-9)
        values = map_coordinates(self.texture, [CENTRE + axial * stretch, CENTRE + lateral * stretch], order=3)
        inside = (first > ENDO) & (first < EPI)
        return np.clip(np.where(inside, values, 10), 0, 255).astype(np.uint8)

    def line(self, radius, frames=slice(None)):
        """Relative change of the length of a line of tissue."""
        return np.sqrt(1 - self.lost[frames] / radius**2) - 1

    def wall(self, view="mid"):
        angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        turned = np.radians([-120.0, 120.0])  # of the insertions: above and below at the left
        insertions = CENTRE + EPI * np.column_stack([np.cos(turned), np.sin(turned)])
        return Wall(CENTRE + ENDO * circle, CENTRE + EPI * circle, view, insertions)
