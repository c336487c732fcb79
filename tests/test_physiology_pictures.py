"""Sections and maps in the pictures of the page on physiology."""

from pathlib import Path

import numpy as np
import pytest

import echotruth as et
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import left_ventricle

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
STRETCH = 0.9


@pytest.fixture
def pictures(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import physiology_pictures

    return physiology_pictures


@pytest.fixture(scope="module")
def geometry():
    """Two halves of ellipsoids."""
    elements = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
    return et.configure(geometry={**elements, "base_mm": 0.0}).geometry.resolved()


@pytest.fixture(scope="module")
def heart(geometry):
    """A wall that is not loaded at end-diastole, and shrinks towards its axis."""
    mesh = left_ventricle(geometry)
    moved = np.stack([0 * mesh.nodes, (STRETCH - 1) * mesh.nodes * [1, 1, 0]])
    arrays = {
        "node_position": mesh.nodes,
        "cell_node": mesh.cells,
        **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
    }
    return et.Heart(mesh.nodes, mesh.cells, moved, wall_depth(mesh), mesh.endo, 6, 1, arrays={"geometry": arrays})


def area(triangles):
    x, y = (values[triangles.triangles] for values in (triangles.x, triangles.y))
    return np.abs((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])).sum() / 2


def test_sections_have_the_area_and_the_strain_of_the_wall(pictures, heart, geometry):
    sections = pictures.heart_sections
    strain = sections.nodal_strain(heart, [0, 1])
    expected = (STRETCH**2 - 1) / 2
    assert np.allclose(strain[0], 0, atol=1e-12) and np.allclose(strain[1], expected, rtol=1e-9)
    long_axis, short_axis = sections.planes(heart)
    radius, length, wall, apex = (
        getattr(geometry, name) for name in ("endo_radius_mm", "endo_length_mm", "wall_mm", "apex_wall_mm")
    )
    outer = (radius + wall) ** 2 * (1 - (length / 2 / (length + apex)) ** 2)
    for frame, factor in ((0, 1.0), (1, STRETCH)):
        ring, bow = (sections.section(heart, frame, strain[frame], plane) for plane in (short_axis, long_axis))
        assert area(ring.triangles) == pytest.approx(factor**2 * np.pi * (outer - radius**2 * 3 / 4), rel=2e-3)
        half_ellipses = np.pi / 2 * ((radius + wall) * (length + apex) - radius * length)
        assert area(bow.triangles) == pytest.approx(factor * half_ellipses, rel=2e-3)
        assert np.allclose(ring.strain, 100 * frame * expected, atol=1e-9)
        assert (len(ring.borders), len(bow.borders)) == (2, 1)
        assert all(np.allclose(border[0], border[-1]) for border in (*ring.borders, *bow.borders)), "they are closed"
    apical = max(bow.borders[0], key=lambda point: point[1])
    assert apical[1] == pytest.approx(length / 2 + apex, rel=1e-2), "the apex is up"


@pytest.mark.parametrize(
    "azimuth, height, place", [(0, 0, (-1, 0)), (90, 0, (0, 1)), (180, 0.5, (2 / 3, 0)), (45, 1, (0, 0))]
)
def test_the_disc_has_the_septum_left_the_anterior_wall_up_and_the_apex_inside(pictures, azimuth, height, place):
    found = pictures.on_disc(np.radians([azimuth]), np.array([height]))
    assert np.allclose(found, [place], atol=1e-12)
