"""The mesh against the analytic ellipsoids."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.cavity import cavity_volume, triangle_shape
from echotruth.mechanics.geometry import GeometryError, cell_volumes, left_ventricle
from echotruth.mechanics.quadrature import triangle

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}


def cap(radius, length, base):
    """Volume of an ellipsoid of revolution below a plane `base` above its centre."""
    return np.pi * radius**2 * (base + length - (base**3 + length**3) / (3 * length**2))


def flux(nodes, facets):
    """Flux of the position through quadratic triangles."""
    xi, weight = triangle()
    value, slope = triangle_shape(xi)
    x = nodes[facets]
    tangents = np.einsum("qak,fai->kfqi", slope, x)
    return np.einsum("qa,fai,fqi,q->", value, x, np.cross(*tangents), weight)


@pytest.mark.parametrize(("elements", "tolerance"), [({}, 1e-4), (COARSE, 1e-3)])
def test_volumes_are_those_of_the_ellipsoids(elements, tolerance):
    mesh = left_ventricle(Geometry(**elements))
    inner, outer = cap(1.45e-3, 5.4e-3, 1.4e-3), cap(2.45e-3, 6.2e-3, 1.4e-3)
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(inner, rel=tolerance)
    assert cell_volumes(mesh).sum() == pytest.approx(outer - inner, rel=tolerance)
    assert inner == pytest.approx(32.8e-9, rel=5e-3)
    assert outer - inner == pytest.approx(71e-9, rel=5e-3)


def test_facets_close_the_wall_and_point_out_of_it():
    mesh = left_ventricle(Geometry(**COARSE))
    whole = sum(flux(mesh.nodes, facets) for facets in (mesh.endo, mesh.epi, mesh.base)) / 3
    assert whole == pytest.approx(cell_volumes(mesh).sum(), rel=1e-12)


def test_base_is_plane_and_the_wall_below_it():
    mesh = left_ventricle(Geometry(scale=1.1))
    assert np.all(mesh.nodes[mesh.base, 2] == 0)
    assert mesh.nodes[:, 2].max() == 0
    assert mesh.nodes[:, 2].min() == pytest.approx(-1.1 * 7.6e-3)


def test_every_node_of_the_sides_lies_on_its_ellipsoid():
    mesh = left_ventricle(Geometry(**COARSE))
    for facets, radius, length in ((mesh.endo, 1.45e-3, 5.4e-3), (mesh.epi, 2.45e-3, 6.2e-3)):
        x, y, z = mesh.nodes[np.unique(facets)].T
        level = (x**2 + y**2) / radius**2 + ((z + 1.4e-3) / length) ** 2
        np.testing.assert_allclose(level, 1, rtol=1e-12)


@pytest.mark.parametrize("around", [6, 12, 18, 36])
def test_numbers_of_elements_are_as_asked(around):
    mesh = left_ventricle(Geometry(circumferential_elements=around, longitudinal_elements=8, transmural_elements=2))
    assert len(mesh.base) == 2 * 2 * around
    assert np.unique(mesh.cells).size == len(mesh.nodes)


def test_wall_that_turns_inside_out_is_refused_in_one_sentence():
    flat = Geometry(endo_radius_mm=0.05, epi_radius_mm=30.0, endo_length_mm=5.4, epi_length_mm=5.41, base_mm=5.3)
    with pytest.raises(GeometryError, match="inside out: raise longitudinal_elements"):
        left_ventricle(flat)
