"""Pictures of docs/physiology.md: loops, segments, activation and sections of the healthy heart and of diseased ones.

    python benchmarks/physiology_pictures.py

The hearts have 12 x 6 x 1 elements and 24 frames, as in the tables of the page. All but the loops are of the mouse, or
of the species that is named: `python benchmarks/physiology_pictures.py human -o out/human`. `default_pictures.py` draws
the default heart, from a repository.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import heart_sections
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.tri import Triangulation
from numpy.typing import NDArray
from PIL import Image
from scipy.interpolate import PchipInterpolator

import echotruth as et
from echotruth.config import Config
from echotruth.fem.tetrahedra import Mesh, straight_triangles
from echotruth.mechanics.activation_map import SITES, activation_times
from echotruth.mechanics.bounds import CC
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import left_ventricle
from echotruth.report import bullseye, style

Floats = NDArray[np.float64]

ELEMENTS = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
LOOPS, SPECIES = ("mouse", "human"), ("mouse", "rat", "human")
"""Species whose loops are drawn, and all."""


class State(NamedTuple):
    """A state of the heart: its name, the section `pathology` that makes it, and the colour of its loop."""

    name: str
    pathology: dict[str, Any]
    colour: str


STATES = (
    State("Healthy", {}, style.INK),
    State("Fresh infarct", {"infarct": {"age": "fresh", "segments": [7, 8, 12, 13, 14]}}, style.SERIES[1]),
    State("Left bundle branch block", {"activation": {"preset": "lbbb"}}, style.SERIES[2]),
    State("Dilated cardiomyopathy", {"preset": "dcm"}, style.SERIES[0]),
    State("Hypertension", {"preset": "hypertension"}, style.SERIES[4]),
)
SECTIONS = 3
"""Number of states whose sections are drawn, the first ones."""

ORDERS = {"normal": "Normal", "lbbb": "Left bundle branch block", "rv_pacing": "Right ventricular pacing"}
SURFACES = {"endo": ("Endocardium", 0.0), "epi": ("Epicardium", 1.0)}
"""Surface -> its name and wall depth."""
STAR = {"color": style.PAPER, "markeredgecolor": style.INK, "markersize": 11}


def solved(species: str, state: State) -> et.Heart:
    """The heart of a species in a state, in a circulation."""
    loop = {"kind": "circulation", "frames": 24}
    geometry = {"preset": species, **ELEMENTS}
    return et.beat({"geometry": geometry, "loop": loop, "pathology": state.pathology}, progress=False)


@style.styled
def draw_loops(hearts: dict[str, list[et.Heart]]) -> Figure:
    """Draw the loops of all states, a panel for each species."""
    figure = style.figure(8.4, 3.9)
    for axes, (species, beaten) in zip(figure.subplots(1, len(hearts), squeeze=False)[0], hearts.items(), strict=True):
        volume, pressure = style.volume(beaten[0].arrays["mechanics"]["volume"].max()), style.QUANTITIES["pressure"]
        for state, heart in zip(STATES, beaten, strict=True):
            _loop(axes, heart, state, (volume, pressure))
        axes.set(xlabel=volume.label, ylabel=pressure.label, title=species.capitalize())
        axes.set(xlim=(0, None), ylim=(0, 1.45 * axes.get_ylim()[1]))
        axes.legend(loc="upper right", labelcolor="linecolor", fontsize=8.5, labelspacing=0.3)
    return figure


def _loop(axes: Axes, heart: et.Heart, state: State, shown: tuple[style.Quantity, style.Quantity]) -> None:
    """The closed curve through the frames, which goes beyond none of them, and the points of end-systole and ED."""
    mechanics = heart.arrays["mechanics"]
    points = np.column_stack(
        [one.factor * mechanics[name] for one, name in zip(shown, ("volume", "pressure"), strict=True)]
    )
    frames = np.arange(-2, len(points) + 3)
    curve = PchipInterpolator(frames, points[frames % len(points)])(np.linspace(0, len(points), 481))
    fraction = 100 * float(heart.arrays["physiology"]["ejection_fraction"])
    axes.plot(*curve.T, color=state.colour, label=f"{state.name}, EF {fraction:.0f} %")
    axes.plot(*points[[0, heart.es]].T, "o", color=state.colour, markersize=4)


@style.styled
def draw_segments(hearts: list[et.Heart]) -> Figure:
    """Draw E_CC of the segments at end-systole, a bullseye for each state."""
    strains = [100 * heart.arrays["physiology"]["segment_strain_es"][:, CC] for heart in hearts]
    limit = 5 * np.ceil(np.nanmax(np.abs(strains)) / 5)
    scale = TwoSlopeNorm(0, -limit, limit)
    figure = style.figure(7.8, 5.5)
    *discs, rest = figure.subplots(2, 3).ravel()
    for axes, state, values in zip(discs, STATES, strains, strict=True):
        bullseye.disc(axes, values, scale)
        axes.set_title(state.name)
    rest.axis("off")
    place = rest.inset_axes((0.05, 0.5, 0.9, 0.06))
    bar = figure.colorbar(ScalarMappable(scale, bullseye.COLOURMAP), cax=place, orientation="horizontal")
    bar.set_label(style.QUANTITIES["CC"].label + "\nsince end-diastole,\nat end-systole")
    return figure


def on_disc(azimuth: Floats, height: Floats) -> Floats:
    """Points (n, 2) of a wall on a unit disc as a bullseye has them: anterior up, septum left, apex inside.

    Parameters
    ----------
    azimuth : ndarray of shape (n,)
        From septal to anterior, rad.
    height : ndarray of shape (n,)
        From the base, 0, to the apex, 1. The radius is the angle from the apex, arccos(height), over that of the base.
    """
    radius = np.arccos(np.clip(height, 0, 1)) / (np.pi / 2)
    return radius[:, None] * np.column_stack([-np.cos(azimuth), np.sin(azimuth)])


@style.styled
def draw_activation(config: Config) -> Figure:
    """Draw when endocardium and epicardium are activated, a column for each order of activation."""
    mesh = left_ventricle(config.geometry)
    depth = wall_depth(mesh)
    times = {}
    for order in ORDERS:
        activation = config.pathology.activation.model_copy(update={"preset": order})
        times[order] = 1e3 * activation_times(mesh, depth, activation, config.fibres, config.seed)
    last = max(float(values.max()) for values in times.values())
    step = float(min((1, 2, 5, 10, 20), key=lambda each: abs(last / each - 14)))
    levels = np.arange(0, last + step, step)
    figure = style.figure(8.0, 5.2)
    panels = figure.subplots(len(SURFACES), len(ORDERS))
    for column, (order, name) in zip(panels.T, ORDERS.items(), strict=True):
        column[0].set_title(name)
        for axes, (surface, (_, at)) in zip(column, SURFACES.items(), strict=True):
            filled = _isochrones(axes, mesh, surface, times[order], levels)
            sites = [(np.radians(site.azimuth_deg), site.position) for site in SITES[order] if site.depth == at]
            if sites:
                axes.plot(*on_disc(*np.transpose(sites)).T, "*", **STAR)
    for axes, (name, _) in zip(panels[:, 0], SURFACES.values(), strict=True):
        axes.text(-1.3, 0, name, rotation=90, va="center", ha="center", fontweight="bold", fontsize=10)
    figure.colorbar(filled, ax=panels, shrink=0.6, aspect=30).set_label("Time of activation (ms)")
    return figure


def _isochrones(axes: Axes, mesh: Mesh, surface: str, times: Floats, levels: Floats) -> ContourSet:
    """Fill the time between isochrones on a surface of the wall."""
    facets, (x, y, z) = getattr(mesh, surface), mesh.nodes.T
    points = on_disc(np.arctan2(y, x), z / z[facets].min())
    triangles = Triangulation(*points.T, straight_triangles(facets))
    filled = axes.tricontourf(triangles, times, levels, cmap="viridis_r")
    lines = axes.tricontour(triangles, times, levels, colors=style.INK, linewidths=0.6)
    for label in axes.clabel(lines, levels[4::2], fontsize=7, fmt="%g"):
        label.set_visible(bool(np.hypot(*label.get_position()) < 0.9))  # not across the rim
    for drawn in (filled, lines):  # the borders of the elements are straight
        drawn.set_clip_path(Circle((0, 0), 0.995, transform=axes.transData))
    bullseye.names(axes)
    return filled


def save(figure: Figure, path: Path) -> None:
    """Write a picture with a palette, which differs by less than one can see and takes a third of the room."""
    picture = Image.open(style.save(figure, path, dpi=150)).convert("RGB")
    picture.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE).save(path, optimize=True)
    print(path, f"{path.stat().st_size / 1e3:.0f} kB")


def main() -> None:
    """Solve the hearts and draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("species", nargs="?", default="mouse", choices=SPECIES, help="of all but the loops")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    arguments = parser.parse_args()
    hearts = {species: [solved(species, state) for state in STATES] for species in LOOPS}
    shown = hearts.get(arguments.species) or [solved(arguments.species, state) for state in STATES]
    names = [state.name for state in STATES[:SECTIONS]]
    pictures = {
        "disease_loops": draw_loops(hearts),
        "disease_segments": draw_segments(shown),
        "activation": draw_activation(et.configure(geometry={"preset": arguments.species})),
        "circulation": heart_sections.draw(dict(zip(names, shown, strict=False))),
    }
    for name, figure in pictures.items():
        save(figure, arguments.output / f"{name}.png")


if __name__ == "__main__":
    main()
