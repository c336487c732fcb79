"""The picture and the table of docs/strain.md: line strain of the contours, rotation and twist, tracked and true.

python benchmarks/strain_picture.py out/default -o docs/gallery/strain.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import report
import xarray as xr
from matplotlib.axes import Axes

import echotruth as et
from echotruth.report import style

SIZE = 512
CONTOURS = {"endocardial": style.SERIES[1], "middle": style.SERIES[0], "epicardial": style.MUTED}
ROTATIONS = {"apex": style.SERIES[0], "base": style.MUTED}
TWIST = style.SERIES[1]
MEANS = ("gls", "gls_endocardial", "gcs", "gcs_endocardial", "radial", "twist")
"""Quantities of the table, of the heart as a whole."""


def pair(axes: Axes, curves: xr.Dataset, name: str, label: str, colour: str, scale: float) -> None:
    """One curve as it is (solid) and as it was tracked (dashed)."""
    time = 1e3 * curves["time"].values
    axes.plot(time, scale * curves[f"true_{name}"].values, color=colour, label=label)
    axes.plot(time, scale * curves[f"tracked_{name}"].values, color=colour, ls="--")


@style.styled
def draw(path: Path, repository: et.Repository, tracker: str) -> None:
    """The three panels."""
    figure = style.figure(11, 3.7)
    panels = figure.subplots(1, 3)
    curves = {view: repository.curves(view=view, tracker=tracker, size=SIZE) for view in repository.views}
    for axes, view in zip(panels, ("mid", "long_axis"), strict=False):
        for contour, colour in CONTOURS.items():
            pair(axes, curves[view].sel(contour=contour), "line_strain", contour, colour, 100)
    for view, colour in ROTATIONS.items():
        pair(panels[2], curves[view], "rotation", view, colour, np.degrees(1))
    twist = repository.twist(tracker=tracker, size=SIZE)
    pair(panels[2], twist, "twist", "twist", TWIST, np.degrees(1))
    titles = "Circumferential (short axis, mid)", "Longitudinal (long axis)", "Rotation and twist"
    labels = "Line strain (%)", "Line strain (%)", "Rotation (deg)"
    es = 1e3 * curves["mid"].attrs["end_systole"]
    for axes, title, label in zip(panels, titles, labels, strict=True):
        axes.axvline(es, color=style.MUTED, lw=0.9, ls=":")
        axes.text(es, 0.99, " ES", color=style.MUTED, va="top", transform=axes.get_xaxis_transform())
        axes.axhline(0, color=style.MUTED, lw=0.6)
        axes.set(title=title, ylabel=label, xlabel="Time since end-diastole (ms)")
    panels[0].legend(loc="lower left")
    panels[2].legend(loc="upper right")
    style.save(figure, path, dpi=100)


def table(repository: et.Repository, tracker: str) -> list[str]:
    """Tracked and true values of the heart at end-systole, % and degrees."""
    found = repository.summary(sizes=[SIZE], trackers=[tracker])
    found = found[found["quantity"].isin(MEANS) & ~found["view"].isin(repository.views)].set_index("quantity")
    rows = [[name, *(f"{found.loc[name, f'{what}_es']:.1f}" for what in ("tracked", "true"))] for name in MEANS]
    return report.table(["", "tracked", "true"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository, as out/default")
    parser.add_argument("--tracker", default="bspline_dic")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery/strain.png"))
    arguments = parser.parse_args()
    repository = et.Repository(arguments.repository)
    draw(arguments.output, repository, arguments.tracker)
    print("\n".join(table(repository, arguments.tracker)))


if __name__ == "__main__":
    main()
