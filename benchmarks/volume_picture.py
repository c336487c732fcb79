"""Moving picture of docs/gallery: a heart with an infarct in three dimensions, with its true and its tracked strain.

python benchmarks/volume_picture.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista
import xarray as xr
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray
from volumes import INFARCT, SETTINGS

import echotruth as et
from echotruth.evaluation.volume import COMPONENTS, VolumePoints, segment_strain, strain_radius
from echotruth.heart import Heart
from echotruth.notebook.volume import tracked_positions, voxel_truth
from echotruth.report import bullseye, style
from echotruth.report.clip import webp
from echotruth.repository.datasets import VOLUME, imaged_heart

TARGET = Path(__file__).parents[1] / "docs/gallery/volume.webp"
CONFIG = et.configure(et.configure(**SETTINGS), seed=22, **INFARCT | {"pathology.infarct.segments": [11, 12, 16]})
STRAIN, LIMIT = "CC", 0.2
"""Component that is shown, and the end of its scale."""
TITLES = "Echo, a quarter cut away", "True circumferential strain", "Tracked in the echo (%)", "True (%)"
SIDE = 360
"""Of a rendering, px."""
EYE = (-6.0, 11.0, -9.0)
"""From the middle of the volume to the eye, mm: lateral, elevation, axial."""
OPACITY = 0, 0, 20, 80, 180, 250
"""Of grey levels from 0 to 255, at equal steps."""


def rendering(grey: NDArray[np.uint8], colour: NDArray[np.uint8], sides: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Picture (row, column, 3) of a volume (axial, elevation, lateral) in colours (..., 3), a quarter cut away."""
    opacity = np.interp(grey, np.linspace(0, 255, len(OPACITY)), OPACITY).astype(np.uint8)
    axial, elevation, _ = grey.shape
    opacity[: axial // 2, elevation // 2 :] = 0
    grid = pyvista.ImageData(dimensions=grey.shape[::-1], spacing=sides[::-1])
    grid.point_data["shown"] = np.concatenate([colour, opacity[..., None]], -1).reshape(-1, 4)
    plotter = pyvista.Plotter(off_screen=True, window_size=[SIDE, SIDE])
    plotter.set_background("black")
    plotter.add_volume(grid, scalars="shown", shade=True)
    centre = np.array(grid.center)
    plotter.camera_position = [centre + EYE, centre, (0, 0, -1)]
    picture = plotter.screenshot(return_img=True)
    plotter.close()
    return picture


def renderings(clip: xr.Dataset, heart: Heart, frame: int) -> list[NDArray[np.uint8]]:
    """The echo of a frame, and the same with its true strain in colour."""
    grey = clip["image"].transpose("frame", *VOLUME).values[frame]
    sides = np.array([1e3 * float(clip[dim][1] - clip[dim][0]) for dim in VOLUME])
    strain = voxel_truth(clip, heart, frame)["strain"].sel(strain_component=STRAIN).transpose(*VOLUME).values
    plain = np.repeat(grey[..., None], 3, -1)
    tint = colormaps[style.SIGNED](np.nan_to_num(strain) / (2 * LIMIT) + 0.5)[..., :3]
    # As bright as the echo, but for a part by which the colour shows in dark speckle too.
    tinted = np.where(np.isnan(strain)[..., None], plain, tint * (100 + 0.6 * plain))
    return [rendering(grey, each.astype(np.uint8), sides) for each in (plain, tinted)]


def pictures(clip: xr.Dataset, heart: Heart, tracked: xr.Dataset) -> NDArray[np.uint8]:
    """Frames (frame, row, column, 3)."""
    radius = strain_radius(CONFIG)
    points = VolumePoints(*imaged_heart(clip, heart), tracked_positions(tracked), radius)
    number, scale = COMPONENTS.index(STRAIN.lower()), TwoSlopeNorm(0, -100 * LIMIT, 100 * LIMIT)
    found = []
    for frame in range(clip.sizes["frame"]):
        moved = tracked["displacement"].values[frame], points.displacement[frame]
        figure = Figure((7, 7), dpi=84, layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        for panel, title in zip(axes, TITLES, strict=True):
            panel.set_title(title, fontsize=11)
        for panel, picture in zip(axes[:2], renderings(clip, heart, frame), strict=True):
            panel.imshow(picture)
            panel.axis("off")
        for panel, displacement in zip(axes[2:], moved, strict=True):
            bullseye.disc(panel, 100 * segment_strain(displacement, points)[:, number], scale)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return np.stack(found)


def main() -> None:
    heart = et.beat(CONFIG)
    clip = et.image(heart, "whole")
    webp(TARGET, pictures(clip, heart, et.track(clip, "bspline_dic")))


if __name__ == "__main__":
    main()
