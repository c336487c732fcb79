"""The heart in three dimensions, apex up: its fibres at end-diastole, and strain along its wall at end-systole."""

from collections.abc import Iterable
from typing import Any

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

ELEVATION, AZIMUTH, ROLL = -20.0, -115.0, 180.0
"""Direction to the eye in the heart frame, degrees: inferior, and somewhat beyond the apex. The picture is upside down:
the apex is up and the septum on the left, as in an apical echo."""

STRAINS = {"CC": 1, "LL": 2}
"""Component that is shown -> its number in the arrays."""

AMBIENT = 0.5
"""Fraction of the light that is ambient; the rest comes from the eye."""

GROUND = 0.62
"""Brightness of the wall between its fibres, over theirs."""

SCALES = (90, "turbo"), (style.STRAIN_LIMIT, style.SIGNED)
"""End to either side and colour map of the helix angle, degrees, and of strain, %."""

ROD_LENGTH = 0.075
"""Length of the rods that show fibres, over that of the heart."""


@style.styled
def draw(cells: np.ndarray, nodes: np.ndarray, fibre: np.ndarray, helix: np.ndarray, strain: np.ndarray) -> Figure:
    """Draw the fibres and each strain side by side, a quarter of the wall cut away.

    Parameters
    ----------
    cells : ndarray of shape (cell, 10)
        Nodes of the quadratic tetrahedra, in VTK's order.
    nodes : ndarray of shape (2, node, 3)
        Their positions at end-diastole and at end-systole, m.
    fibre : ndarray of shape (cell, 3)
        Directions of the fibres at the cell centroids at end-diastole, of any length.
    helix : ndarray of shape (cell,)
        Helix angle of the fibres, unloaded, rad.
    strain : ndarray of shape (cell, 6)
        At end-systole since end-diastole.
    """
    angle, percent = (ScalarMappable(Normalize(-end, end), name) for end, name in SCALES)
    figure = style.figure(8.6, 4.2)
    projection = {"projection": "3d", "computed_zorder": False}
    panels = figure.subplots(1, 1 + len(STRAINS), squeeze=False, subplot_kw=projection)[0]
    for panel, title in zip(panels, ("Fibres at end-diastole", "End-systole", "End-systole"), strict=True):
        panel.set_title(title, y=1.12)
    show(panels, np.concatenate(nodes))
    bar: dict[str, Any] = {"orientation": "horizontal", "shrink": 0.8, "pad": 0.12, "aspect": 22}
    names = ("Helix angle (°)", *(style.QUANTITIES[name].label for name in STRAINS))
    for panel, scale, name in zip(panels, (angle, percent, percent), names, strict=True):
        figure.colorbar(scale, ax=panel, **bar).set_label(name)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # which would draw all triangles once more to find no room for them
    wall = _cut(_grid(nodes[0], cells, {"helix": np.degrees(helix)}))
    add(panels[0], wall, GROUND * angle.to_rgba(wall.point_data["helix"])[:, :3])
    rods = _rods(nodes[0], fibre, cells, helix)
    add(panels[0], rods, angle.to_rgba(rods.point_data["helix"])[:, :3])
    for panel, number in zip(panels[1:], STRAINS.values(), strict=True):
        wall = _cut(_grid(nodes[1], cells, {"strain": 100 * strain[:, number]}))
        add(panel, wall, percent.to_rgba(wall.point_data["strain"])[:, :3])
    return figure


def _grid(nodes: np.ndarray, cells: np.ndarray, values: dict[str, np.ndarray]) -> pyvista.UnstructuredGrid:
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: cells.astype(np.int64)}, nodes)
    for name, of_cells in values.items():
        grid.cell_data[name] = of_cells
    return grid.cell_data_to_point_data(pass_cell_data=True)


def _cut(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    """Surface of the wall without the inferior lateral quarter."""
    inferior_septal = grid.clip("-y", origin=(0, 0, 0), invert=False).clip("-x", origin=(0, 0, 0))
    remaining = grid.clip("-y", origin=(0, 0, 0)) + inferior_septal
    surface = remaining.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2).triangulate()
    return surface.subdivide_adaptive(max_edge_len=surface.length / 32)  # small triangles can be sorted by their depth


def _rods(nodes: np.ndarray, fibre: np.ndarray, cells: np.ndarray, helix: np.ndarray) -> pyvista.PolyData:
    """Short rods along the fibres, outside the quarter that is cut away."""
    position = shape(CENTROID)[0] @ nodes[cells]
    shown = (position[:, 1] >= 0) | (position[:, 0] >= 0)
    points = pyvista.PolyData(position[shown])
    points["direction"] = fibre[shown]
    points["helix"] = np.degrees(helix[shown])
    rod = pyvista.Cylinder(radius=0.055, height=1.0, resolution=6)
    length = ROD_LENGTH * np.ptp(nodes[:, 2])
    return points.glyph(orient="direction", scale=False, factor=length, geom=rod).triangulate()


def show(panels: Iterable[Axes3D], nodes: np.ndarray) -> None:
    """Show what is within the bounds of nodes (n, 3), m, on one scale from one direction."""
    low, high = 1e3 * nodes.min(0), 1e3 * nodes.max(0)
    for panel in panels:
        panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        panel.set_proj_type("ortho")
        panel.set_box_aspect(high - low, zoom=1.45)
        panel.view_init(ELEVATION, AZIMUTH, ROLL)
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
