"""Figures 2 to 4 of the paper, of the hearts that were run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import paper_resolutions
import pyvista
from mpl_toolkits.mplot3d import Axes3D
from paper_heart import SLICES, Heart

from echotruth.report import bullseye, error, style
from echotruth.report.heart import add, show

Hearts = Mapping[str, Heart]

SECTION_HALF_WIDTH = 0.04
"""Of the midsection that is drawn, over the distance from base to apex."""
GREY, BLUE = (0.80, 0.76, 0.74), (0.16, 0.36, 0.72)


@style.styled
def draw_geometry(path: Path, hearts: Hearts) -> None:
    """Half of every heart at end-diastole with its midsection in blue, on one scale, apex up (figure 2A)."""
    figure = style.figure(2.6 * len(hearts), 4.3)
    projection = {"projection": "3d", "computed_zorder": False}
    panels = figure.subplots(1, len(hearts), squeeze=False, subplot_kw=projection)[0]
    for panel, (name, heart) in zip(panels, hearts.items(), strict=True):
        _add_half(panel, heart)
        panel.set_title(name, y=1.12)
    show(panels, np.concatenate([heart.mesh.positions(0) for heart in hearts.values()]))
    style.save(figure, path, dpi=110)


def _add_half(panel: Axes3D, heart: Heart) -> None:
    """Add the anterior half."""
    mesh, apex = heart.mesh, heart.mesh.endo_at_ed[:, 2].min()
    cells = {pyvista.CellType.QUADRATIC_TETRA: mesh.cells.astype(np.int64)}
    grid = pyvista.UnstructuredGrid(cells, mesh.positions(0))
    half = grid.clip("-y", origin=(0, 0, 0)).extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    half = half.triangulate().subdivide_adaptive(max_edge_len=half.length / 40)
    upper, lower = ((0, 0, apex * (0.5 + side * SECTION_HALF_WIDTH)) for side in (-1, 1))
    above, below = half.clip("-z", origin=upper), half.clip("z", origin=lower)
    section = half.clip("z", origin=upper).clip("-z", origin=lower)
    parts = [(part.triangulate(), colour) for part, colour in ((above, GREY), (section, BLUE), (below, GREY))]
    points = np.cumsum([0, *(part.n_points for part, _ in parts)])
    whole = pyvista.PolyData.from_regular_faces(
        np.concatenate([part.points for part, _ in parts]),
        np.concatenate([part.regular_faces + first for (part, _), first in zip(parts, points, strict=False)]),
    )
    add(panel, whole, np.concatenate([np.tile(colour, (part.n_points, 1)) for part, colour in parts]))


def draw_figures(folder: Path, hearts: Hearts, printed: str, mended: str) -> None:
    """Figures 2B, 3 and 4 of every heart, as the report draws them, for two trackers."""
    for name, heart in hearts.items():
        clips = [heart.read.read(f"bmode/{size}/image", heart.case, "mid", 0) for size in heart.sizes[:2]]
        style.save(paper_resolutions.draw(clips, heart.field_of_view), folder / f"paper_bmode_{name}.png")
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
