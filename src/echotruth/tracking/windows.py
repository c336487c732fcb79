"""Square windows on an image, interpolation between them, and the grid of points.

Pixel coordinates count pixel centres: 0 is the centre of the first row or column.
"""

from dataclasses import dataclass

import numpy as np

MIN_WINDOW_SIDE = 8
"""px; a smaller window holds too little speckle."""


@dataclass(frozen=True)
class Windows:
    """A rectangular arrangement of square windows.

    Attributes
    ----------
    side : int
        Side of a window, px.
    top : ndarray of shape (rows,)
        First image row of each row of windows.
    left : ndarray of shape (columns,)
        First image column of each column of windows.
    """

    side: int
    top: np.ndarray
    left: np.ndarray

    def extract(self, image: np.ndarray) -> np.ndarray:
        """Pixels of the windows.

        Parameters
        ----------
        image : ndarray of shape (axial, lateral)

        Returns
        -------
        ndarray of shape (rows, columns, side, side), float64
        """
        windows = np.lib.stride_tricks.sliding_window_view(image, (self.side, self.side))
        return windows[np.ix_(self.top, self.left)].astype(float)

    def interpolate(self, field: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Bilinear interpolation between the window centres; outside them the nearest value.

        Windows without a value (NaN) are left out and the weights of the others rescaled to a sum of one, so that the
        black background does not erase the wall beside it.

        Parameters
        ----------
        field : ndarray of shape (rows, columns, k)
            Values at the window centres, any unit; NaN in all k entries where there are none.
        points : ndarray of shape (n, 2)
            Lateral, axial coordinates, px.

        Returns
        -------
        ndarray of shape (n, k)
            NaN where no window around the point has a value, or the point itself is NaN.
        """
        column, right = _interval(points[:, 0] - (self.side - 1) / 2, self.left)
        row, down = _interval(points[:, 1] - (self.side - 1) / 2, self.top)
        total, total_weight = np.zeros((len(points), field.shape[-1])), np.zeros(len(points))
        for i, j in np.ndindex(2, 2):
            value = field[np.minimum(row + i, len(self.top) - 1), np.minimum(column + j, len(self.left) - 1)]
            weight = np.abs(1 - i - down) * np.abs(1 - j - right) * np.isfinite(value).all(-1)
            total += np.where(weight[:, None] > 0, weight[:, None] * value, 0)
            total_weight += weight
        known = total_weight > 1e-9
        result = np.full_like(total, np.nan)
        result[known] = total[known] / total_weight[known, None]
        return result


def _interval(position: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the interval between corners that contains a position, and the fraction (0 to 1) of it passed."""
    step = corners[1] - corners[0] if len(corners) > 1 else 1
    index = np.clip((position - corners[0]) / step, 0, len(corners) - 1)
    interval = np.minimum(np.nan_to_num(index).astype(int), max(len(corners) - 2, 0))
    return interval, index - interval


def arrange(shape: tuple[int, int], side: int, stride: float) -> Windows:
    """As many windows as fit, centred on the image.

    Parameters
    ----------
    shape : tuple of int
        Axial and lateral size of the image, px.
    side : int
        Side of a window, px.
    stride : float
        Step between windows over their side; the step is rounded to a pixel.

    Returns
    -------
    Windows

    Raises
    ------
    ValueError
        If a window does not fit into the image.
    """
    if side > min(shape):
        raise ValueError(f"The tracking window of {side} px is larger than the image of {shape[0]} x {shape[1]} px.")
    step = max(1, round(side * stride))
    corners = []
    for size in shape:
        last = (size - side) // step
        # The remainder is split between both borders, so that neither is favoured.
        corners.append((size - side - last * step) // 2 + step * np.arange(last + 1))
    return Windows(side, *corners)


def grid(shape: tuple[int, int], step: int) -> np.ndarray:
    """Points on every `step`-th pixel, starting half a step from the border.

    Parameters
    ----------
    shape : tuple of int
        Axial and lateral size of the image, px.
    step : int
        Spacing of the points, px.

    Returns
    -------
    ndarray of shape (axial points, lateral points, 2)
        Lateral, axial pixel coordinates (whole numbers, as float).

    Raises
    ------
    ValueError
        If no point falls on the image.
    """
    if step < 1 or step // 2 >= min(shape):
        raise ValueError(f"A grid of {step} px has no point on an image of {shape[0]} x {shape[1]} px.")
    axial, lateral = (np.arange(step // 2, size, step, dtype=float) for size in shape)
    return np.stack(np.meshgrid(lateral, axial), axis=-1)
