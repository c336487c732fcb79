"""Figures 2 to 4 of the paper, of the hearts that were run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pyvista
from paper_heart import SLICES, Heart

from echotruth.report import bullseye, error, resolutions, style
from echotruth.report.heart import PIXELS, VIEWPOINT
from echotruth.report.raster import Camera, Surface, render

Hearts = Mapping[str, Heart]

SECTION_HALF_WIDTH = 0.04
"""Of the midsection that is drawn, over the distance from base to apex."""
GREY, BLUE = (0.80, 0.76, 0.74), (0.16, 0.36, 0.72)


@style.styled
def draw_geometry(path: Path, hearts: Hearts) -> None:
    """Half of every heart at end-diastole with its midsection in blue, on one scale (figure 2A)."""
    nodes = np.concatenate([heart.mesh.positions(0) for heart in hearts.values()])
    low, high = nodes.min(0), nodes.max(0)
    half_height = max(0.55 * (high[2] - low[2]), 0.55 * (high[0] - low[0]) * PIXELS[1] / PIXELS[0])
    camera = Camera(np.array(VIEWPOINT), (low + high) / 2, float(half_height), PIXELS)
    figure = style.figure(2.6 * len(hearts), 4.3)
    for panel, (name, heart) in zip(figure.subplots(1, len(hearts), squeeze=False)[0], hearts.items(), strict=True):
        panel.imshow(_picture(heart, camera).clip(0, 1))
        panel.set_title(name)
        panel.axis("off")
    style.save(figure, path, dpi=110)


def _picture(heart: Heart, camera: Camera) -> np.ndarray:
    """Picture of the posterior half on white."""
    mesh, apex = heart.mesh, heart.mesh.endo_at_ed[:, 2].min()
    cells = {pyvista.CellType.QUADRATIC_TETRA: mesh.cells.astype(np.int64)}
    grid = pyvista.UnstructuredGrid(cells, mesh.positions(0))
    half = grid.clip("y", origin=(0, 0, 0)).extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    half = half.triangulate()
    upper, lower = ((0, 0, apex * (0.5 + side * SECTION_HALF_WIDTH)) for side in (-1, 1))
    above, below = half.clip("-z", origin=upper), half.clip("z", origin=lower)
    section = half.clip("z", origin=upper).clip("-z", origin=lower)
    colour, alpha = render(_merged(((above, GREY), (section, BLUE), (below, GREY))), camera)
    return colour + (1 - alpha)[..., None]


def _merged(parts: Iterable[tuple[pyvista.PolyData, tuple[float, float, float]]]) -> Surface:
    """One surface of several, each of one colour."""
    points, normals, triangles, colours, count = [], [], [], [], 0
    for part, colour in parts:
        mesh = part.triangulate().compute_normals(cell_normals=False, split_vertices=True, feature_angle=40)
        points.append(np.asarray(mesh.points, float))
        normals.append(np.asarray(mesh.point_data["Normals"], float))
        triangles.append(mesh.faces.reshape(-1, 4)[:, 1:] + count)
        colours.append(np.tile(colour, (mesh.n_points, 1)))
        count += mesh.n_points
    return Surface(*map(np.concatenate, (points, normals, triangles, colours)))


def draw_figures(folder: Path, hearts: Hearts, printed: str, mended: str) -> None:
    """Figures 2B, 3 and 4 of every heart, as the report draws them, for two trackers."""
    for name, heart in hearts.items():
        clips = [heart.read.read(f"bmode/{size}/image", heart.case, "mid", 0) for size in heart.sizes[:2]]
        style.save(resolutions.draw(clips, heart.field_of_view), folder / f"paper_bmode_{name}.png")
        for tracker in (printed, mended):
            true, tracked = (1e6 * values for values in heart.segments(tracker))
            labels = "Circumferential displacement at ES (µm)", "Difference (µm)"
            segments = bullseye.Segments("Circumferential displacement", true, tracked, *labels)
            style.save(bullseye.draw([segments], tracker), folder / f"paper_bullseye_{name}_{tracker}.png")
        errors = {
            view: {
                tracker: {size: heart.layer_errors(view, tracker, size) for size in heart.sizes}
                for tracker in (printed, mended)
            }
            for view in SLICES
        }
        style.save(error.draw(errors), folder / f"paper_error_{name}.png")
