"""The heart in three dimensions: fibres and circumferential strain, unloaded, at end-diastole and at end-systole."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pyvista
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from echotruth.fem.tetrahedra import shape
from echotruth.mechanics.fibres import CENTROID
from echotruth.report import style

ELEVATION, AZIMUTH = 23.0, 115.0
"""Direction to the eye in the heart frame, degrees: anterior and somewhat above, the septum on the left."""

AMBIENT = 0.42
"""Fraction of the light that is ambient; the rest comes from the eye."""

GROUND = 0.62
"""Brightness of the wall between its fibres, over theirs."""

ROD_LENGTH = 0.075
"""Length of the rods that show fibres, over that of the heart."""


@dataclass(frozen=True)
class State:
    """The heart in one state.

    Attributes
    ----------
    nodes : ndarray of shape (node, 3)
        Positions of the nodes, m.
    fibre : ndarray of shape (cell, 3)
        Directions of the fibres at the cell centroids, of any length.
    strain : ndarray of shape (cell,)
        Circumferential strain from unloaded.
    """

    name: str
    nodes: np.ndarray
    fibre: np.ndarray
    strain: np.ndarray


@style.styled
def draw(cells: np.ndarray, helix: np.ndarray, states: Sequence[State]) -> Figure:
    """Draw the states side by side, fibres above and strain below, a quarter of the wall cut away.

    Parameters
    ----------
    cells : ndarray of shape (cell, 10)
        Nodes of the quadratic tetrahedra, in VTK's order.
    helix : ndarray of shape (cell,)
        Helix angle of the fibres, unloaded, rad.
    states : sequence of State
        From left to right.
    """
    # In a sweep, hearts with fewer elements are padded with cells of one repeated node and NaN nodes.
    real = cells.min(1) < cells.max(1)
    cells, helix = cells[real], helix[real]
    states = [State(s.name, np.nan_to_num(s.nodes), s.fibre[real], s.strain[real]) for s in states]
    limit = max(100 * float(np.nanmax(np.abs([state.strain for state in states]))), 0.1)
    scales = ScalarMappable(Normalize(-90, 90), "turbo"), ScalarMappable(Normalize(-limit, limit), "RdBu_r")
    figure = style.figure(8.6, 7.6)
    panels = figure.subplots(2, len(states), squeeze=False, subplot_kw={"projection": "3d", "computed_zorder": False})
    for column, state in zip(panels.T, states, strict=True):
        wall = _cut(_grid(state.nodes, cells, {"strain": 100 * state.strain, "helix": np.degrees(helix)}))
        add(column[0], wall, GROUND * scales[0].to_rgba(wall.point_data["helix"])[:, :3])
        rods = _rods(state, cells, helix)
        add(column[0], rods, scales[0].to_rgba(rods.point_data["helix"])[:, :3])
        add(column[1], wall, scales[1].to_rgba(wall.point_data["strain"])[:, :3])
        column[0].set_title(state.name, y=1.25)
    show(panels.flat, np.concatenate([state.nodes for state in states]))
    labels = "Helix angle (°)", "Circumferential strain $E_{CC}$\nfrom unloaded (%)"
    for row, scale, label in zip(panels, scales, labels, strict=True):
        figure.colorbar(scale, ax=row, shrink=0.75, aspect=25).set_label(label)
    return figure


def _grid(nodes: np.ndarray, cells: np.ndarray, values: dict[str, np.ndarray]) -> pyvista.UnstructuredGrid:
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: cells.astype(np.int64)}, nodes)
    for name, of_cells in values.items():
        grid.cell_data[name] = of_cells
    return grid.cell_data_to_point_data(pass_cell_data=True)


def _cut(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    """Surface of the wall without the anterior lateral quarter."""
    anterior_septal = grid.clip("y", origin=(0, 0, 0), invert=False).clip("-x", origin=(0, 0, 0))
    remaining = grid.clip("y", origin=(0, 0, 0)) + anterior_septal
    surface = remaining.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2).triangulate()
    return surface.subdivide_adaptive(max_edge_len=surface.length / 40)  # small triangles can be sorted by their depth


def _rods(state: State, cells: np.ndarray, helix: np.ndarray) -> pyvista.PolyData:
    """Short rods along the fibres, outside the quarter that is cut away."""
    position = shape(CENTROID)[0] @ state.nodes[cells]
    shown = (position[:, 1] <= 0) | (position[:, 0] >= 0)
    points = pyvista.PolyData(position[shown])
    points["direction"] = state.fibre[shown]
    points["helix"] = np.degrees(helix[shown])
    rod = pyvista.Cylinder(radius=0.055, height=1.0, resolution=6)
    length = ROD_LENGTH * np.ptp(state.nodes[:, 2])
    return points.glyph(orient="direction", scale=False, factor=length, geom=rod).triangulate()


def show(panels: Iterable[Axes3D], nodes: np.ndarray) -> None:
    """Show what is within the bounds of nodes (n, 3), m, on one scale from one direction."""
    low, high = 1e3 * nodes.min(0), 1e3 * nodes.max(0)
    for panel in panels:
        panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        panel.set_proj_type("ortho")
        panel.set_box_aspect(high - low, zoom=1.5)
        panel.view_init(ELEVATION, AZIMUTH)
        panel.axis("off")


def add(axes: Axes3D, mesh: pyvista.PolyData, colours: np.ndarray) -> None:
    """Add triangles with the colours (point, 3), RGB, of their corners, lit from the eye: a + (1 - a) |n . e|."""
    corners = mesh.faces.reshape(-1, 4)[:, 1:]
    triangles = 1e3 * np.asarray(mesh.points, float)[corners]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    up, turn = np.radians([ELEVATION, AZIMUTH])
    eye = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    area = np.linalg.norm(normal, axis=1)
    kept = area > 1e-3 * area.mean()  # slivers of the cut have no direction
    light = AMBIENT + (1 - AMBIENT) * np.abs(normal @ eye)[kept] / area[kept]
    lit = light[:, None] * colours[corners[kept]].mean(axis=1)
    surface = Poly3DCollection(triangles[kept], facecolors=lit, edgecolors=lit, linewidths=0.3, clip_on=False)
    surface.set_rasterized(True)  # thousands of triangles would make a large SVG
    axes.add_collection3d(surface)
