"""Plane sections of a beating heart, coloured by the circumferential strain of its wall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pyvista
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from echotruth.fem.tetrahedra import EDGES, NODE_XI, PARTS, Mesh, shape
from echotruth.heart import SHORT_AXIS, Heart
from echotruth.loop.phases import CONTRACTION, EJECTION, FILLING
from echotruth.mechanics import fibres, kinematics
from echotruth.report import style
from echotruth.report.clip import round_length

Floats = NDArray[np.float64]

CC = ((1, 1),)
"""The component of strain that is shown."""

HALVINGS = 3
"""Of the edges of an element, so that the sections of curved elements look curved."""

AZIMUTH = np.radians(30)
"""Of the long axis, from septal to anterior: it cuts the anteroseptal and the inferolateral wall, as a parasternal or
apical long axis does."""

SCALE = ScalarMappable(Normalize(-style.STRAIN_LIMIT, style.STRAIN_LIMIT), style.SIGNED)
"""Colours of strain, %."""

AT_ED: dict[str, Any] = {"color": style.MUTED, "linewidth": 0.8, "linestyle": (0, (2, 2))}
"""Look of the wall at end-diastole."""


class Plane(NamedTuple):
    """A plane that stays in space.

    Attributes
    ----------
    origin : ndarray of shape (3,), m
    axes : ndarray of shape (2, 3)
        Unit vectors to the right and up on the page.
    """

    origin: Floats
    axes: Floats


def planes(heart: Heart) -> tuple[Plane, Plane]:
    """The long axis, apex up, and the short axis halfway from base to apex at end-diastole, anterior up."""
    cos, sin = np.cos(AZIMUTH), np.sin(AZIMUTH)
    middle = np.array([0, 0, heart.endo_at_ed[:, 2].min() / 2])
    long_axis = np.array([[-cos, -sin, 0], [0, 0, -1.0]])
    return Plane(middle, long_axis), Plane(middle, SHORT_AXIS[:2] * [[1], [-1]])


def instants(heart: Heart) -> dict[str, int]:
    """Name -> frame of what matters in a beat."""
    phase, volume = heart.arrays["mechanics"]["phase"], heart.arrays["mechanics"]["volume"]
    closed = int(np.flatnonzero(phase == CONTRACTION)[-1])
    half = (volume[0] + volume.min()) / 2
    nearest = {name: np.where(phase == name, abs(volume - half), np.inf).argmin() for name in (EJECTION, FILLING)}
    return {
        "Mid-isovolumic\ncontraction": -(-closed // 2),
        "Mid-ejection": int(nearest[EJECTION]),
        "End-systole": heart.es,
        "Mid-filling": int(nearest[FILLING]),
    }


def nodal_strain(heart: Heart, frames: Sequence[int]) -> Floats:
    """E_CC since end-diastole at the nodes, mean over the cells that share them, (frame, node)."""
    mesh = Mesh(*(heart.arrays["geometry"][name] for name in ("node_position", "cell_node", "endo", "epi", "base")))
    gradient = kinematics.deformation_gradient(mesh, heart.displacement[[0, *frames]], NODE_XI)
    axes = kinematics.deformed_wall_axes(fibres.wall_axes(mesh, heart.wall_depth, NODE_XI), gradient[0])
    strain = kinematics.strain(gradient[1:] @ np.linalg.inv(gradient[0]), axes, CC)[..., 0]
    cells = np.bincount(mesh.cells.ravel())
    return np.stack([np.bincount(mesh.cells.ravel(), values.ravel()) / cells for values in strain])


def refined(cells: NDArray[np.integer], values: Floats) -> Floats:
    """Nodal values (node, n) at the corners of small straight tetrahedra in the quadratic ones, (small, 4, n)."""
    xi = NODE_XI[None, :4]
    for _ in range(HALVINGS):
        xi = np.concatenate([xi, xi[:, EDGES].mean(axis=2)], axis=1)[:, PARTS].reshape(-1, 4, 3)
    return np.einsum("qa,can->cqn", shape(xi.reshape(-1, 3)), values[cells]).reshape(-1, 4, values.shape[1])


class Section(NamedTuple):
    """Section of the wall, mm on the page.

    Attributes
    ----------
    triangles : Triangulation
    strain : ndarray of shape (point,)
        E_CC, %.
    borders : list of ndarray of shape (n, 2)
        Lines around the wall.
    """

    triangles: Triangulation
    strain: Floats
    borders: list[Floats]


def section(heart: Heart, frame: int, strain: Floats, plane: Plane) -> Section:
    """Cut the wall in a frame, with the strain (node,) there."""
    nodes = heart.positions(frame)
    corners = refined(heart.cells, np.column_stack([nodes, 100 * strain])).reshape(-1, 4)
    wall = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: np.arange(len(corners)).reshape(-1, 4)}, corners[:, :3])
    wall.point_data["strain"] = corners[:, 3]
    curved = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: heart.cells.astype(np.int64)}, nodes)
    surface = curved.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=HALVINGS)
    inside, around = (each.slice(normal=np.cross(*plane.axes), origin=plane.origin) for each in (wall, surface))
    triangles = Triangulation(*_on_page(inside, plane).T, inside.triangulate().faces.reshape(-1, 4)[:, 1:])
    lines = around.clean().strip(join=True, max_length=100_000).cell
    return Section(triangles, np.asarray(inside.point_data["strain"]), [_on_page(line, plane) for line in lines])


def _on_page(cut: Any, plane: Plane) -> Floats:
    return np.asarray(1e3 * (cut.points - plane.origin) @ plane.axes.T)


@style.styled
def draw(hearts: dict[str, Heart]) -> Figure:
    """Draw long and short axis of each heart, by its name, at the instants of its beat, all on one scale."""
    cuts = {name: _cuts(heart) for name, heart in hearts.items()}
    limits = [_limits([row[k] for row in cuts.values()]) for k in range(2)]
    (left, right), heights = limits[0][0], [np.ptp(vertical) for _, vertical in limits]
    count = len(instants(next(iter(hearts.values()))))
    figure = style.figure(1.6 * count + 0.3, 3.0 * len(hearts) + 1.2)
    ratios = {"width_ratios": [0.12] + [1] * count, "height_ratios": heights * len(hearts)}
    grid = figure.add_gridspec(2 * len(hearts), 1 + count, **ratios)
    panels = [[figure.add_subplot(grid[row, 1 + column]) for column in range(count)] for row in range(2 * len(hearts))]
    for number, (name, heart) in enumerate(hearts.items()):
        label = figure.add_subplot(grid[2 * number : 2 * number + 2, 0])
        label.text(0.5, 0.5, name, rotation=90, ha="center", va="center", fontweight="bold", fontsize=10)
        label.axis("off")
        for k, row in enumerate(cuts[name]):
            for axes, cut in zip(panels[2 * number + k], row[1:], strict=True):
                _wall(axes, cut, row[0].borders)
                axes.set(xlim=(left, right), ylim=limits[k][1], aspect="equal")
        for axes, frame in zip(panels[2 * number + 1], instants(heart).values(), strict=True):
            time = 1e3 * heart.arrays["mechanics"]["time"][frame]
            axes.set_xlabel(f"{time:.0f} ms", color=style.MUTED, fontsize=8)
    _scale_bar(panels[0][0])
    for axes, instant in zip(panels[0], instants(heart), strict=True):
        axes.set_title(instant, fontsize=9)
    bar: dict[str, Any] = {"orientation": "horizontal", "shrink": 0.7, "aspect": 40, "pad": 0.01, "extend": "both"}
    figure.colorbar(SCALE, ax=np.ravel(panels), **bar).set_label(style.QUANTITIES["CC"].label)
    figure.legend(handles=[Line2D([], [], **AT_ED, label="wall at end-diastole")], loc="outside lower center")
    return figure


def _scale_bar(axes: Axes) -> None:
    """Draw a bar of a round length at the open end of a long axis, between the walls."""
    (left, right), low = axes.get_xlim(), axes.get_ylim()[0]
    length = 1e3 * round_length(1e-3 * (right - left))
    middle, height = (left + right) / 2, low + 0.04 * (right - left)
    axes.plot([middle - length / 2, middle + length / 2], [height] * 2, color=style.INK, solid_capstyle="butt")
    axes.text(middle, height + 0.03 * (right - left), f"{length:g} mm", ha="center", va="bottom", fontsize=8)


def _cuts(heart: Heart) -> list[list[Section]]:
    """Sections of both planes, at end-diastole and at the instants."""
    frames = [0, *instants(heart).values()]
    strains = nodal_strain(heart, frames)
    return [
        [section(heart, frame, strain, plane) for frame, strain in zip(frames, strains, strict=True)]
        for plane in planes(heart)
    ]


def _limits(rows: list[list[Section]]) -> tuple[Floats, Floats]:
    """Limits to the right and up that hold all sections."""
    points = np.concatenate([border for row in rows for cut in row for border in cut.borders])
    margin = 0.03 * np.ptp(points[:, 0])
    return np.array([points.min(0) - margin, points.max(0) + margin]).T


def _wall(axes: Axes, cut: Section, at_ed: list[Floats]) -> None:
    look: dict[str, Any] = {"cmap": SCALE.cmap, "norm": SCALE.norm, "shading": "gouraud", "rasterized": True}
    axes.tripcolor(cut.triangles, cut.strain, **look)
    for border in at_ed:
        axes.plot(*border.T, **AT_ED)
    for border in cut.borders:
        axes.plot(*border.T, color=style.INK, linewidth=0.9)
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
