"""Software rasterizer of shaded triangulated surfaces, which needs neither a display nor OpenGL.

VTK renders only with EGL or OSMesa of the operating system, and ends the process where there is neither.

A z-buffer and Gouraud shading under parallel projection: Foley, van Dam, Feiner and Hughes,
Computer Graphics: Principles and Practice, chapters 15 and 16.
"""

from dataclasses import dataclass

import numba
import numpy as np

AMBIENT = 0.42
"""Fraction of the light that is ambient."""
SUPERSAMPLING = 2
"""Number of samples along the side of a pixel, which are averaged."""


@dataclass(frozen=True)
class Surface:
    """A coloured triangulated surface.

    Attributes
    ----------
    points : ndarray of shape (point, 3)
        m.
    normals : ndarray of shape (point, 3)
        Unit vectors, to either side.
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
        From the scene to the eye; z points up in the picture.
    centre : ndarray of shape (3,)
        Point in the middle of the picture, m.
    half_height : float
        Half the height of the picture, m.
    size : tuple of int
        Width and height, px.
    """

    direction: np.ndarray
    centre: np.ndarray
    half_height: float
    size: tuple[int, int]

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors right, up and towards the eye, as rows."""
        eye = np.asarray(self.direction, float) / np.linalg.norm(self.direction)
        right = np.cross((0, 0, 1), eye)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(eye, right), eye])


def render(surface: Surface, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Draw a surface with ambient and diffuse light from the eye.

    Parameters
    ----------
    surface : Surface
    camera : Camera

    Returns
    -------
    colour : ndarray of shape (height, width, 3)
        RGB, 0 to 1, multiplied by `alpha`.
    alpha : ndarray of shape (height, width)
        Fraction of the pixel that the surface covers.
    """
    width, height = (SUPERSAMPLING * n for n in camera.size)
    axes, scale = camera.axes, height / (2 * camera.half_height)
    right, up, depth = axes @ (surface.points - camera.centre).T * scale
    screen = np.stack([width / 2 + right, height / 2 - up, depth], -1)
    # a + (1 - a) |n . e|: both sides of a surface are lit.
    light = AMBIENT + (1 - AMBIENT) * np.abs(surface.normals @ axes[2])
    image = np.zeros((height, width, 4))
    _fill(screen, surface.triangles.astype(np.int64), surface.colours * light[:, None], image)
    n = SUPERSAMPLING
    image = image.reshape(height // n, n, width // n, n, 4).mean((1, 3))
    return image[..., :3], image[..., 3]


@numba.njit(cache=True)
def _fill(screen: np.ndarray, triangles: np.ndarray, colours: np.ndarray, image: np.ndarray) -> None:
    """Fill every pixel centre with the interpolated colour of the nearest triangle (z-buffer).

    u and v are the barycentric coordinates of the pixel centre with respect to b and c.
    """
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
