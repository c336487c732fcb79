"""The image sizes of one view side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echotruth.report import style


@style.styled
def draw(path: str | Path, images: Sequence[np.ndarray], field_of_view: float) -> Path:
    """Draw one frame at every image size.

    Parameters
    ----------
    path : str or Path
        File to write.
    images : sequence of ndarray of shape (axial, lateral)
        8-bit grey levels, the largest first.
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.

    Returns
    -------
    Path
        The file.
    """
    figure = style.figure(3.1 * len(images) + 0.4, 3.75)
    panels = figure.subplots(1, len(images), sharey=True, squeeze=False)[0]
    side = 1e3 * field_of_view
    for panel, image in zip(panels, images, strict=True):
        panel.imshow(
            image, cmap="gray", vmin=0, vmax=255, extent=(-side / 2, side / 2, side, 0), interpolation="nearest"
        )
        rows, columns = image.shape
        panel.set(title=f"{rows} × {columns} px, {1e6 * field_of_view / columns:.0f} µm/px", xlabel="Lateral (mm)")
        panel.grid(False)
        panel.set_xticks(np.arange(-np.floor(side / 6) * 3, side / 2 + 0.1, 3))
        panel.set_yticks(np.arange(0, side + 0.1, 3))
    panels[0].set_ylabel("Axial (mm)")
    return style.save(figure, path)
