"""The image sizes of one view side by side, so near that their pixels are seen."""

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
    left, right, bottom, top = _near(images[0], side)
    for panel, image in zip(panels, images, strict=True):
        extent, (rows, columns) = (-side / 2, side / 2, side, 0), image.shape
        panel.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="nearest")
        panel.set(title=f"{rows} × {columns} px, {1e6 * field_of_view / columns:.0f} µm/px", xlabel="Lateral (mm)")
        panel.grid(False)
        panel.set(xlim=(left, right), ylim=(bottom, top))
    panels[0].set_ylabel("Axial (mm)")
    return figure


def _near(image: np.ndarray, side: float) -> tuple[float, float, float, float]:
    """Square about the upper wall, a quarter as wide as what is bright: left, right, bottom, top, mm."""
    rows, columns = np.nonzero(image >= 0.35 * max(int(image.max()), 1))
    pixel = side / len(image)
    extent, middle = 0.25 * pixel * np.ptp(columns), pixel * (columns.min() + columns.max()) / 2 - side / 2
    # Half of the bright pixels of the middle columns lie in the upper wall.
    central = np.abs(columns - columns.mean()) < 0.05 * np.ptp(columns)
    upper = pixel * float(np.quantile(rows[central], 0.25))
    return middle - extent / 2, middle + extent / 2, upper + extent / 2, upper - extent / 2
