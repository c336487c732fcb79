"""The image sizes of one view side by side, where the wall is."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from echotruth.report import style


@style.styled
def draw(images: Sequence[np.ndarray], field_of_view: float) -> Figure:
    """Draw one frame at every image size.

    Parameters
    ----------
    images : sequence of ndarray of shape (axial, lateral)
        8-bit grey levels, the largest first.
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.
    """
    figure = style.figure(3.1 * len(images) + 0.4, 3.75)
    panels = figure.subplots(1, len(images), sharey=True, squeeze=False)[0]
    side = 1e3 * field_of_view
    left, right, bottom, top = _bright(images[0], side)
    for panel, image in zip(panels, images, strict=True):
        extent, (rows, columns) = (-side / 2, side / 2, side, 0), image.shape
        panel.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="nearest")
        panel.set(title=f"{rows} × {columns} px, {1e6 * field_of_view / columns:.0f} µm/px", xlabel="Lateral (mm)")
        panel.grid(False)
        panel.set(xlim=(left, right), ylim=(bottom, top))
    panels[0].set_ylabel("Axial (mm)")
    return figure


def _bright(image: np.ndarray, side: float) -> tuple[float, float, float, float]:
    """Square around what is bright, within the image: left, right, bottom, top, mm."""
    rows, columns = np.nonzero(image >= 0.35 * max(int(image.max()), 1))
    middle = np.array([rows.min() + rows.max(), columns.min() + columns.max()]) / 2
    count = len(image) - 1
    half = min(0.58 * max(int(np.ptp(rows)), int(np.ptp(columns)), 8), count / 2)
    row, column = np.clip(middle, half, count - half)
    low, high = (np.array([-half, half]) + row) / count * side
    left, right = (np.array([-half, half]) + column) / count * side - side / 2
    return float(left), float(right), float(high), float(low)
