"""Pictures of the default heart, in docs/physiology.md and docs/strain.md, and the table of the latter.

    echotruth run benchmarks/default.yaml
    python benchmarks/default_pictures.py out/default

The strain is line strain of the contours, rotation and twist, tracked and true.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import report
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from physiology_pictures import save

import echotruth as et
from echotruth.report import style
from echotruth.report.figures import Figures

SIZE, TRACKER = 512, "bspline_dic"
CONTOURS = dict(zip(("endocardial", "middle", "epicardial"), style.layer_colours(3), strict=True))
ROTATIONS = ("base", "apex")
MEANS = ("gls", "gls_endocardial", "gcs", "gcs_endocardial", "radial", "twist")
"""Quantities of the table, of the heart as a whole."""


def _pair(axes: Axes, curves: xr.Dataset, name: str, label: str, colour: str) -> None:
    """A curve as it is (solid) and as it was tracked (dashed); rotation in degrees, strain in percent."""
    factor = style.FACTORS["%" if name == "line_strain" else "°"]
    time = 1e3 * curves["time"].values
    axes.plot(time, factor * curves[f"true_{name}"].values, color=colour, label=label)
    axes.plot(time, factor * curves[f"tracked_{name}"].values, color=colour, ls="--")


@style.styled
def draw_strain(repository: et.Repository) -> Figure:
    """Draw strain of the contours in a short and in the long axis, and rotation and twist."""
    figure = style.figure(9.0, 3.7)
    panels = figure.subplots(1, 3)
    curves = {view: repository.curves(view=view, tracker=TRACKER, size=SIZE) for view in repository.views}
    for axes, view in zip(panels, ("mid", "long_axis"), strict=False):
        for contour, colour in CONTOURS.items():
            _pair(axes, curves[view].sel(contour=contour), "line_strain", contour, colour)
    for view in ROTATIONS:
        _pair(panels[2], curves[view], "rotation", view, style.QUANTITIES[view].colour)
    twist = repository.twist(tracker=TRACKER, size=SIZE)
    _pair(panels[2], twist, "twist", "twist", style.QUANTITIES["twist"].colour)
    titles = "Mid short axis", "Long axis", "Rotation and twist"
    labels = *(style.QUANTITIES[name].label for name in ("GCS", "GLS")), "Counter-clockwise from apex (°)"
    es = 1e3 * curves["mid"].attrs["end_systole"]
    for axes, title, label in zip(panels, titles, labels, strict=True):
        axes.axvline(es, color=style.MUTED, lw=0.9, ls=":")
        axes.axhline(0, color=style.MUTED, lw=0.6)
        low, high = axes.get_ylim()
        axes.set(
            title=title, ylabel=label, xlabel="Time since end-diastole (ms)", ylim=(low, high + 0.08 * (high - low))
        )
        axes.text(es, 0.985, "ES ", color=style.MUTED, ha="right", va="top", transform=axes.get_xaxis_transform())
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, columnspacing=1, handlelength=1.2)
    lines = [Line2D([], [], color=style.MUTED, ls=ls, label=name) for ls, name in (("-", "true"), ("--", "tracked"))]
    style.legend_below(figure, lines)
    return figure


def table(repository: et.Repository) -> list[str]:
    """Tracked and true values of the heart at end-systole, % and degrees."""
    found = repository.summary(sizes=[SIZE], trackers=[TRACKER])
    found = found[found["quantity"].isin(MEANS) & ~found["view"].isin(repository.views)].set_index("quantity")
    rows = [[name, *(f"{found.loc[name, f'{what}_es']:.1f}" for what in ("tracked", "true"))] for name in MEANS]
    return report.table(["", "tracked", "true"], rows)


def main() -> None:
    """Draw the heart of a repository."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of the repository")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    arguments = parser.parse_args()
    repository = et.Repository(arguments.repository)
    save(Figures(repository, arguments.output).physiology(), arguments.output / "physiology.png")
    save(draw_strain(repository), arguments.output / "strain.png")
    print("\n".join(table(repository)))


if __name__ == "__main__":
    main()
