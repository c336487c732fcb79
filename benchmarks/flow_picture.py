"""The picture of docs/flow.md: flow to the next frame, what of it leaves the plane, and points followed.

python benchmarks/flow_picture.py out/default -o docs/gallery/flow.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

import echotruth as et
from echotruth.report import style

SPACING = 14
"""Pixels from one arrow to the next."""
POINTS = 24
MARGIN = 12


def crop(clip: xr.Dataset) -> tuple[slice, slice]:
    """Rows and columns around the wall in all frames."""
    wall = clip["mask"].values.any(0)
    rows, columns = (np.flatnonzero(wall.any(axis)) for axis in (1, 0))
    return tuple(slice(max(each[0] - MARGIN, 0), each[-1] + MARGIN) for each in (rows, columns))


def arrows(axes: Axes, clip: xr.Dataset, frame: int) -> None:
    """Flow to the next frame on the image."""
    flow = clip["flow"].sel(to="next").values[frame]
    rows, columns = np.mgrid[SPACING // 2 : len(flow) : SPACING, SPACING // 2 : len(flow) : SPACING].reshape(2, -1)
    spacing = float(clip["axial"][1] - clip["axial"][0])
    moved = flow[rows, columns] / spacing
    axes.imshow(clip["image"].values[frame], cmap="gray")
    axes.quiver(columns, rows, *moved.T[:2], color="#ffc400", angles="xy", scale_units="xy", scale=0.35, width=0.005)
    axes.set_title("Flow to the next frame")


def elevation(axes: Axes, clip: xr.Dataset, frame: int) -> None:
    """Motion out of the plane to the next frame, and where it leaves the slice."""
    out = 1e6 * clip["flow"].sel(to="next", vector="elevation").values[frame]
    drawn = axes.imshow(out, cmap="RdBu_r", vmin=-100, vmax=100)
    axes.figure.colorbar(drawn, ax=axes, shrink=0.75, label="elevation of flow (µm)")
    leaves = clip["leaves"].values[frame]
    if leaves.any() and not leaves.all():
        axes.contour(leaves, levels=[0.5], colors="black", linewidths=1)
    thickness = 1e6 * float(clip["thickness"].values[clip["mask"].values[frame]].mean())
    axes.set_title(f"Out of the plane (slice {thickness:.0f} µm thick)")


def tracks(axes: Axes, heart: et.Heart, clip: xr.Dataset) -> None:
    """Points of end-diastole followed to end-systole: solid where they are visible."""
    rows, columns = np.nonzero(clip["mask"].values[0])
    chosen = np.random.default_rng(3).choice(len(rows), POINTS, replace=False)
    found = et.point_tracks(heart, clip, np.column_stack([columns, rows])[chosen])
    pixel, visible = found["pixel"].values[: heart.es + 1], found["visible"].values[: heart.es + 1]
    axes.imshow(clip["image"].values[heart.es], cmap="gray")
    for point in range(POINTS):
        axes.plot(*pixel[:, point].T, color="#ff5a4d", lw=1, ls=":")
        seen = np.where(visible[:, point, None], pixel[:, point], np.nan)
        axes.plot(*seen.T, color="#27c4ff", lw=1.8)
        shown = visible[-1, point]
        axes.plot(*pixel[-1, point], "o", color="#27c4ff" if shown else "#ff5a4d", ms=4, mfc=None if shown else "none")
    axes.set_title("Points from end-diastole to end-systole")


@style.styled
def draw(path: Path, heart: et.Heart, clip: xr.Dataset, frame: int) -> None:
    """The three panels."""
    figure = style.figure(11, 3.9)
    panels = figure.subplots(1, 3)
    arrows(panels[0], clip, frame)
    elevation(panels[1], clip, frame)
    tracks(panels[2], heart, clip)
    rows, columns = crop(clip)
    for axes in panels:
        axes.set(xlim=(columns.start, columns.stop), ylim=(rows.stop, rows.start), xticks=[], yticks=[])
        axes.grid(False)
    style.save(figure, path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository, as out/default")
    parser.add_argument("--case", default="heart")
    parser.add_argument("--view", default="long_axis")
    parser.add_argument("--frame", type=int, help="default: that of the largest motion to the next")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery/flow.png"))
    arguments = parser.parse_args()
    names = ("image", "mask", "flow")
    clip = et.Repository(arguments.repository).clip(arguments.case, arguments.view, variables=names)
    heart = et.Repository(arguments.repository).heart(arguments.case)
    motion = np.abs(clip["flow"].sel(to="next", vector=["lateral", "axial"])).mean(("axial", "lateral", "vector"))
    frame = int(np.nanargmax(motion.values)) if arguments.frame is None else arguments.frame
    draw(arguments.output, heart, clip, frame)


if __name__ == "__main__":
    main()
