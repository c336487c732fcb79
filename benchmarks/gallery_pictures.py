"""Pictures of docs/gallery that show the demo: the clip of the first page, flow, the report and the viewer.

    echotruth run config/demo.yaml
    python benchmarks/gallery_pictures.py out/demo

The last two need Chromium and the package playwright.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from physiology_pictures import save

import echotruth as et
from echotruth.report import style
from echotruth.report.clip import webp
from echotruth.report.figures import Figures

HEIGHT = 400
"""Of the clip, px."""
VIEW, ACROSS, STEP = "long_axis", 26, 1.0
"""View of the picture of flow; arrows along its side, and how many times as long as the motion they are."""
REPORT, VIEWER = (1280, 1000), (1280, 860)
"""Sizes of the windows, px."""
ADDRESS = "?frame={es}"
"""What the viewer shows: what it opens with, at end-systole."""


@style.styled
def draw_flow(repository: et.Repository) -> Figure:
    """Draw flow in the plane and out of it where it is largest, and paths of points to end-systole."""
    heart, size = repository.heart(), repository.sizes[0]
    clip = repository.clip(view=VIEW, size=size, variables=("image", "flow", "mask"))
    clip["ever"], flow = clip["mask"].any("frame"), clip["flow"].sel(to="next")
    speed = np.hypot(flow.sel(vector="lateral"), flow.sel(vector="axial"))
    frame = int(speed[:-1].median(("axial", "lateral")).values.argmax())
    figure = style.figure(11.4, 4.7)
    plane, across, paths = figure.subplots(1, 3)
    _arrows(plane, clip.isel(frame=frame), flow.isel(frame=frame))
    _elevation(figure, across, clip.isel(frame=frame), flow.isel(frame=frame).sel(vector="elevation"))
    points = _grid(clip, size // 20)
    _paths(paths, clip.isel(frame=heart.es), et.point_tracks(heart, clip, points).isel(frame=slice(heart.es + 1)))
    handles = [
        Line2D([], [], color=style.MOTION, label="path of a point since end-diastole"),
        Line2D([], [], color=style.MOTION, ls=":", label="the same, out of the slice that the beam images"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    for axes, title in zip(
        (plane, across, paths), ("Flow to the next frame", "Flow out of the plane", "Paths to end-systole"), strict=True
    ):
        axes.set_title(title)
    return figure


def _image(axes: Axes, clip: xr.Dataset) -> None:
    """Draw the image where the wall ever is, without axes."""
    axes.imshow(clip["image"], cmap="gray", vmin=0, vmax=255)
    rows, columns = np.nonzero(clip["ever"].values)
    margin = 0.06 * len(clip["image"])
    axes.set(xlim=(columns.min() - margin, columns.max() + margin), ylim=(rows.max() + margin, rows.min() - margin))
    axes.axis("off")


def _grid(clip: xr.Dataset, step: int) -> np.ndarray:
    """Every so manieth pixel that is in the wall at end-diastole: lateral, axial."""
    rows, columns = np.nonzero(clip["mask"].isel(frame=0).values)
    chosen = (rows % step == step // 2) & (columns % step == step // 2)
    return np.stack([columns[chosen], rows[chosen]], axis=1)


def _arrows(axes: Axes, clip: xr.Dataset, flow: xr.DataArray) -> None:
    """Arrows as long as the flow, and one of a known length below."""
    _image(axes, clip)
    step, spacing = len(clip["axial"]) // ACROSS // 2, float(clip["axial"][1] - clip["axial"][0])
    rows, columns = (indices[step // 2 :: step, step // 2 :: step] for indices in np.indices(flow.shape[:2]))
    u, v = (flow.sel(vector=name).values[rows, columns] / spacing for name in ("lateral", "axial"))
    look = {"angles": "xy", "scale_units": "xy", "scale": STEP, "color": style.FLOW, "width": 0.006}
    arrows = axes.quiver(columns, rows, u, v, **look)
    key = {"labelpos": "E", "coordinates": "axes", "labelcolor": "white"}
    axes.quiverkey(arrows, 0.4, 0.06, 3e-4 / spacing, "300 µm", **key)


def _elevation(figure: Figure, axes: Axes, clip: xr.Dataset, flow: xr.DataArray) -> None:
    """Flow out of the plane in colour over the image."""
    _image(axes, clip)
    limit = float(np.ceil(np.nanpercentile(np.abs(1e6 * flow), 99) / 10) * 10)
    shown = axes.imshow(1e6 * flow, cmap=style.SIGNED, vmin=-limit, vmax=limit, alpha=0.75, interpolation="nearest")
    label = f"Elevation (µm); the slice is {1e6 * float(clip['thickness'].median()):.0f} µm thick"
    bar = figure.colorbar(shown, ax=axes, orientation="horizontal", shrink=0.8, pad=0.02)
    bar.solids.set_alpha(1)  # else its edges show
    bar.set_label(label)


def _paths(axes: Axes, clip: xr.Dataset, tracks: xr.Dataset) -> None:
    """Paths of points (frame, point), dotted where the tissue is beside the slice."""
    _image(axes, clip)
    place, visible = tracks["pixel"].values, tracks["visible"].values
    steps, seen = np.stack([place[:-1], place[1:]], axis=2), visible[:-1] & visible[1:]
    for shown, line in ((seen, "-"), (~seen, ":")):
        axes.add_collection(LineCollection(list(steps[shown]), colors=style.MOTION, linewidths=1.5, linestyles=line))
    axes.plot(*place[-1].T, "o", color=style.MOTION, markersize=3, markeredgewidth=0)


def photograph(folder: Path, es: int, output: Path) -> None:
    """Take the first screen of the report, and of the viewer."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-m", "echotruth", "show", str(folder), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        try:
            page = browser.new_page(
                viewport=dict(zip(("width", "height"), REPORT, strict=True)), reduced_motion="reduce"
            )
            page.goto((folder / "report.html").resolve().as_uri())
            page.wait_for_timeout(2000)
            page.screenshot(path=output / "report.png")
            page = browser.new_page(viewport=dict(zip(("width", "height"), VIEWER, strict=True)))
            page.goto(server.stdout.readline().split()[1] + ADDRESS.format(es=es))
            page.wait_for_function("window.echotruth && echotruth.drawn > 0", timeout=120_000)
            page.wait_for_timeout(5000)
            page.screenshot(path=output / "viewer.png")
        finally:
            browser.close()
            server.terminate()


def main() -> None:
    """Draw the pictures of a repository."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of the repository")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    arguments = parser.parse_args()
    repository, output = et.Repository(arguments.repository), arguments.output
    path = webp(output / "clip.webp", Figures(repository, output).frames(HEIGHT))
    print(path, f"{path.stat().st_size / 1e3:.0f} kB")
    save(draw_flow(repository), output / "flow.png")
    photograph(arguments.repository, repository.heart().es, output)


if __name__ == "__main__":
    main()
