"""Shaded pictures of surfaces, drawn triangle by triangle; needs neither a screen nor OpenGL.

A z-buffer and Gouraud shading under parallel projection: Foley, van Dam, Feiner and Hughes,
Computer Graphics: Principles and Practice, chapters 15 and 16.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

AMBIENT = 0.42
"""Light that reaches every surface, of 1."""


@dataclass(frozen=True)
class Surface:
    """A coloured triangulated surface.

    Attributes
    ----------
    points : ndarray of shape (point, 3)
        m.
    normals : ndarray of shape (point, 3)
        Of unit length, to either side.
    triangles : ndarray of shape (triangle, 3), integer
    colours : ndarray of shape (point, 3)
        RGB, 0 to 1.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    colours: np.ndarray


@dataclass(frozen=True)
class Camera:
    """A parallel projection.

    Attributes
    ----------
    direction : ndarray of shape (3,)
        From the scene to the eye; z is up on the picture.
    middle : ndarray of shape (3,)
        What is in the middle of the picture, m.
    half : float
        Half the height of the picture, m.
    size : tuple of int
        Width and height, px.
    """

    direction: np.ndarray
    middle: np.ndarray
    half: float
    size: tuple[int, int]

    @property
    def axes(self) -> np.ndarray:
        """Right, up and towards the eye, rows of unit length."""
        eye = np.asarray(self.direction, float) / np.linalg.norm(self.direction)
        right = np.cross((0, 0, 1), eye)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(eye, right), eye])


def render(surface: Surface, camera: Camera, finer: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Draw a surface.

    Parameters
    ----------
    surface : Surface
    camera : Camera
    finer : int
        Samples along a pixel's side, whose mean is the pixel.

    Returns
    -------
    colour : ndarray of shape (height, width, 3)
        RGB, 0 to 1, black where there is no surface; multiplied by the cover.
    cover : ndarray of shape (height, width)
        Share of the pixel that the surface covers.
    """
    width, height = (finer * n for n in camera.size)
    axes, scale = camera.axes, height / (2 * camera.half)
    right, up, near = axes @ (surface.points - camera.middle).T * scale
    screen = np.stack([width / 2 + right, height / 2 - up, near], -1)
    # The lamp is at the eye; both sides of a surface are lit alike.
    light = AMBIENT + (1 - AMBIENT) * np.abs(surface.normals @ axes[2])
    image = np.zeros((height, width, 4))
    _fill(screen, surface.triangles.astype(np.int64), surface.colours * light[:, None], image)
    image = image.reshape(height // finer, finer, width // finer, finer, 4).mean((1, 3))
    return image[..., :3], image[..., 3]


@numba.njit(cache=True)
def _fill(screen: np.ndarray, triangles: np.ndarray, colours: np.ndarray, image: np.ndarray) -> None:
    """Keep for every pixel centre the colour of the nearest triangle over it."""
    height, width = image.shape[:2]
    depth = np.full((height, width), -np.inf)
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = screen[a], screen[b], screen[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        for row in range(max(0, int(min(ay, by, cy))), min(height, int(max(ay, by, cy)) + 1)):
            for column in range(max(0, int(min(ax, bx, cx))), min(width, int(max(ax, bx, cx)) + 1)):
                x, y = column + 0.5, row + 0.5
                u = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                v = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                z = az + u * (bz - az) + v * (cz - az)
                if u >= 0 and v >= 0 and u + v <= 1 and z > depth[row, column]:
                    depth[row, column] = z
                    for k in range(3):
                        mean = (1 - u - v) * colours[a, k] + u * colours[b, k] + v * colours[c, k]
                        image[row, column, k] = mean
                    image[row, column, 3] = 1.0
