"""Moving picture of docs/gallery: a heart in three dimensions, in three slices, with the true strain in colour.

python benchmarks/volume_picture.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

import echotruth as et
from echotruth.report import style
from echotruth.report.clip import webp
from echotruth.report.volume import Slice, slices

TARGET = Path(__file__).parents[1] / "docs/gallery/volume.webp"
SETTINGS: dict[str, Any] = {
    "geometry": {"circumferential_elements": 24, "longitudinal_elements": 12, "transmural_elements": 2},
    "loop": {"kind": "circulation", "frames": 20},
    "views": {"whole": {"plane": "volume"}},
    "probe": {"preset": "mouse_row_column_15MHz"},
    "realism": {"preset": "mouse", "ring_down": {"level_dB": None}},
    "bmode": {"dropout": {"loss_dB": 0.0, "edge_loss_dB": 0.0}, "gain_dB": 6.0},
}
LIMIT = 0.25


def pictures(parts: list[Slice]) -> list[NDArray[np.uint8]]:
    """Every frame: above the volume, below it the strain since end-diastole."""
    found, widths = [], [1e3 * part.sides[1] for part in parts]
    height = 1e3 * max(part.sides[0] for part in parts)
    for frame in range(len(parts[0].image)):
        figure = Figure((sum(widths) / 2.4, 2 * height / 2.4 + 0.5), dpi=72, facecolor="black")
        axes = figure.subplots(2, 3, width_ratios=widths)
        for part, column in zip(parts, axes.T, strict=True):
            extent = (0, part.sides[1], part.sides[0], 0)
            for row, axis in enumerate(column):
                axis.imshow(part.image[frame], cmap="gray", vmin=0, vmax=255, extent=extent)
                if row:
                    strain = part.strain[frame]
                    axis.imshow(strain, cmap=style.SIGNED, vmin=-LIMIT, vmax=LIMIT, extent=extent, alpha=0.7)
                axis.set_title(f"{part.name}: {part.component}" if row else part.name, color="white", fontsize=9)
                axis.axis("off")
        figure.tight_layout(pad=0.4)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return found


def main() -> None:
    heart = et.beat(et.configure(**SETTINGS))
    webp(TARGET, np.stack(pictures(list(slices(et.image(heart, "whole"), heart)))))


if __name__ == "__main__":
    main()
