"""The heart in three dimensions: fibres and circumferential strain, unloaded, at end-diastole and at end-systole."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyvista
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from echotruth.fem.tetrahedra import shape
from echotruth.mechanics.fibres import CENTROID
from echotruth.report import style
from echotruth.report.raster import Camera, Surface, render

VIEWPOINT = (-0.75, 1.6, 0.75)
"""Direction to the eye in the heart frame: anterior and somewhat above, the septum on the left."""

PIXELS = (490, 760)
"""Width and height of the picture of one heart, px."""

WALL_OPACITY = 0.12
"""Opacity of the wall in front of its fibres."""

GROUND = 0.62
"""Brightness of the wall between its fibres, over theirs."""

MARGIN = 1.03
"""Half the width of a picture over that of the heart, at least."""

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
    camera = _camera(states)
    figure = style.figure(8.6, 7.6)
    panels = figure.subplots(2, len(states), squeeze=False)
    for column, state in zip(panels.T, states, strict=True):
        wall = _cut(_grid(state.nodes, cells, {"strain": 100 * state.strain, "helix": np.degrees(helix)}))
        rods = _coloured(_rods(state, cells, helix), scales[0], "helix")
        column[0].imshow(_on_wall(rods, _coloured(wall, scales[0], "helix"), camera))
        column[1].imshow(_rgba(*render(_coloured(wall, scales[1], "strain"), camera)))
        column[0].set_title(state.name)
    for panel in panels.flat:
        panel.axis("off")
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
    """Surface of the wall without the anterior lateral quarter, with sharp edges."""
    anterior_septal = grid.clip("y", origin=(0, 0, 0), invert=False).clip("-x", origin=(0, 0, 0))
    remaining = grid.clip("y", origin=(0, 0, 0)) + anterior_septal
    surface = remaining.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2).triangulate()
    return surface.compute_normals(cell_normals=False, split_vertices=True, feature_angle=40)


def _rods(state: State, cells: np.ndarray, helix: np.ndarray) -> pyvista.PolyData:
    """Short rods along the fibres, outside the quarter that is cut away."""
    position = shape(CENTROID)[0] @ state.nodes[cells]
    shown = (position[:, 1] <= 0) | (position[:, 0] >= 0)
    points = pyvista.PolyData(position[shown])
    points["direction"] = state.fibre[shown]
    points["helix"] = np.degrees(helix[shown])
    rod = pyvista.Cylinder(radius=0.055, height=1.0, resolution=6)
    length = ROD_LENGTH * np.ptp(state.nodes[:, 2])
    rods = points.glyph(orient="direction", scale=False, factor=length, geom=rod)
    return rods.triangulate().compute_normals(cell_normals=False, split_vertices=True, feature_angle=70)


def _coloured(mesh: pyvista.PolyData, scale: ScalarMappable, name: str) -> Surface:
    colours = scale.to_rgba(np.asarray(mesh.point_data[name]))[:, :3]
    triangles = mesh.faces.reshape(-1, 4)[:, 1:]
    return Surface(np.asarray(mesh.points, float), np.asarray(mesh.point_data["Normals"], float), triangles, colours)


def _camera(states: Sequence[State]) -> Camera:
    """One camera for all pictures, so that they share a scale."""
    nodes = np.concatenate([state.nodes for state in states])
    low, high = nodes.min(0), nodes.max(0)
    half_height = 0.5 * float(high[2] - low[2]) + 0.17 * float(high[0] - low[0])
    camera = Camera(np.array(VIEWPOINT), (low + high) / 2, half_height, PIXELS)
    # A wide heart would be cut off at the sides.
    half_width = MARGIN * float(np.abs((nodes - camera.centre) @ camera.axes[0]).max())
    return replace(camera, half_height=max(half_height, half_width * PIXELS[1] / PIXELS[0]))


def _on_wall(rods: Surface, wall: Surface, camera: Camera) -> np.ndarray:
    """Rods before the wall, which fills the gaps between them: RGBA.

    The wall is darker than its rods, so that these are told from it. A thin grey haze, where the wall lies before its
    rods, shows its edges.
    """
    colour, alpha = render(replace(wall, colours=GROUND * wall.colours), camera)
    rod_colour, rod_alpha = render(rods, camera)
    rod_alpha = rod_alpha * (alpha > 0)  # rods of quadratic cells end a little outside
    joined = rod_colour * (rod_alpha > 0)[..., None] + (1 - rod_alpha)[..., None] * colour
    haze = render(replace(wall, colours=np.full_like(wall.colours, 0.75)), camera)[0]
    return _rgba((1 - WALL_OPACITY) * joined + WALL_OPACITY * haze, alpha)


def _rgba(colour: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Picture of colours that are multiplied by their opacity."""
    plain = colour / np.maximum(alpha, 1e-6)[..., None]
    return np.dstack([plain, alpha]).clip(0, 1)
