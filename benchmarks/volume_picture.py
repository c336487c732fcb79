"""Moving picture of docs/gallery: a heart in three dimensions, in three slices, with the true strain in colour.

python benchmarks/volume_picture.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

import echotruth as et
from echotruth.report import style
from echotruth.report.clip import webp

TARGET = Path(__file__).parents[1] / "docs/gallery/volume.webp"
SETTINGS: dict[str, Any] = {
    "geometry": {"circumferential_elements": 24, "longitudinal_elements": 12, "transmural_elements": 2},
    "loop": {"kind": "circulation", "frames": 20},
    "views": {"whole": {"plane": "volume"}},
    "probe": {"preset": "mouse_row_column_15MHz"},
    "realism": {"preset": "mouse", "ring_down": {"level_dB": None}},
    "bmode": {"dropout": {"loss_dB": 0.0, "edge_loss_dB": 0.0}, "gain_dB": 6.0},
}
SLICES = {"short axis": ("axial", "lateral"), "long axis, along the beam": ("axial", "elevation")}
SLICES["long axis, across the beam"] = ("elevation", "lateral")
"""Title -> the dimensions of the picture, downwards and to the right."""
STRAIN = {"short axis": "CC"}
LIMIT = 0.25


def pictures(clip: xr.Dataset, heart: Any) -> list[NDArray[np.uint8]]:
    """Every frame: above the volume, below it the strain since end-diastole."""
    found = []
    middle = {name: clip.sizes[name] // 2 for name in ("axial", "elevation", "lateral")}
    sides = {name: 1e3 * float(np.ptp(clip[name].values)) for name in middle}
    widths = [sides[across] for _, across in SLICES.values()]
    for frame in range(clip.sizes["frame"]):
        truth = et.voxel_truth(clip, heart, frame)
        figure = Figure((sum(widths) / 2.4, 2 * sides["elevation"] / 2.4 + 0.5), dpi=72, facecolor="black")
        axes = figure.subplots(2, 3, width_ratios=widths)
        for column, (title, dims) in enumerate(SLICES.items()):
            at = {name: index for name, index in middle.items() if name not in dims}
            image = clip["image"].isel(frame=frame, **at).transpose(*dims).values
            along = STRAIN.get(title, "LL")
            strain = truth["strain"].sel(strain_component=along).isel(at).transpose(*dims).values
            extent = (0, sides[dims[1]], sides[dims[0]], 0)
            for row, axis in enumerate(axes[:, column]):
                axis.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent)
                if row:
                    axis.imshow(strain, cmap=style.SIGNED, vmin=-LIMIT, vmax=LIMIT, extent=extent, alpha=0.7)
                axis.set_title(f"{title}: {along}" if row else title, color="white", fontsize=9)
                axis.axis("off")
        figure.tight_layout(pad=0.4)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return found


def main() -> None:
    heart = et.beat(et.configure(**SETTINGS))
    webp(TARGET, np.stack(pictures(et.image(heart, "whole"), heart)))


if __name__ == "__main__":
    main()
