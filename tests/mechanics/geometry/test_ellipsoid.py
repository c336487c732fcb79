"""The mesh against the analytic ellipsoids."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import shape, shape_gradient
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics.geometry.ellipsoid import ellipsoid, semi_axes
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.solver.cavity import cavity_volume

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}


def cap(radius, length, base):
    """Volume of an ellipsoid of revolution below a plane `base` above its centre."""
    return np.pi * radius**2 * (base + length - (base**3 + length**3) / (3 * length**2))


def flux(nodes, facets):
    """Flux of the position through quadratic triangles."""
    xi, weight = triangle()
    value, slope = shape(xi), shape_gradient(xi)
    x = nodes[facets]
    tangents = np.einsum("qak,fai->kfqi", slope, x)
    return np.einsum("qa,fai,fqi,q->", value, x, np.cross(*tangents), weight)


@pytest.mark.parametrize(("elements", "tolerance"), [({}, 1e-4), (COARSE, 1e-3)])
def test_volumes_are_those_of_the_ellipsoids(elements, tolerance):
    mesh = ellipsoid(Geometry(**elements))
    inner, outer = cap(1.45e-3, 5.4e-3, 1.4e-3), cap(2.54e-3, 5.64e-3, 1.4e-3)
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(inner, rel=tolerance)
    assert cell_volumes(mesh.nodes, mesh.cells).sum() == pytest.approx(outer - inner, rel=tolerance)
    assert inner == pytest.approx(32.8e-9, rel=5e-3)
    assert outer - inner == pytest.approx(71e-9, rel=5e-3)


@pytest.mark.parametrize("preset", ["rat", "human"])
def test_other_species_are_meshed_as_well(preset):
    mesh = ellipsoid(Geometry(preset=preset))
    (radius, length, base), outer = semi_axes(Geometry(preset=preset))
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(cap(radius, length, base), rel=1e-4)
    assert cell_volumes(mesh.nodes, mesh.cells).sum() == pytest.approx(
        cap(*outer) - cap(radius, length, base), rel=1e-4
    )


def test_facets_close_the_wall_and_point_out_of_it():
    mesh = ellipsoid(Geometry(**COARSE))
    whole = sum(flux(mesh.nodes, facets) for facets in (mesh.endo, mesh.epi, mesh.base)) / 3
    assert whole == pytest.approx(cell_volumes(mesh.nodes, mesh.cells).sum(), rel=1e-12)


def test_base_is_plane_and_the_wall_below_it():
    mesh = ellipsoid(Geometry(scale=1.1))
    assert np.all(mesh.nodes[mesh.base, 2] == 0)
    assert mesh.nodes[:, 2].max() == 0
    assert mesh.nodes[:, 2].min() == pytest.approx(-1.1 * 7.04e-3)


def test_every_node_of_the_sides_lies_on_its_ellipsoid():
    mesh = ellipsoid(Geometry(**COARSE))
    for facets, radius, length in ((mesh.endo, 1.45e-3, 5.4e-3), (mesh.epi, 2.54e-3, 5.64e-3)):
        x, y, z = mesh.nodes[np.unique(facets)].T
        level = (x**2 + y**2) / radius**2 + ((z + 1.4e-3) / length) ** 2
        np.testing.assert_allclose(level, 1, rtol=1e-12)


def test_hypertrophy_thickens_the_wall_outwards():
    endo, epi = semi_axes(Geometry(hypertrophy=1.5))
    assert endo == pytest.approx((1.45e-3, 5.4e-3, 1.4e-3))
    assert epi == pytest.approx((3.085e-3, 5.76e-3, 1.4e-3))


def test_dilation_widens_the_cavity_at_its_wall_thickness():
    endo, epi = semi_axes(Geometry(dilation=1.2))
    assert endo == pytest.approx((1.74e-3, 6.48e-3, 1.68e-3))
    assert epi == pytest.approx((2.83e-3, 6.72e-3, 1.68e-3))


def test_elongation_lengthens_the_cavity_only():
    endo, epi = semi_axes(Geometry(elongation=0.9))
    assert endo == pytest.approx((1.45e-3, 4.86e-3, 1.26e-3))
    assert epi == pytest.approx((2.54e-3, 5.1e-3, 1.26e-3))


def test_wall_with_inverted_elements_is_refused_in_one_sentence():
    flat = Geometry(endo_radius_mm=0.05, wall_mm=29.95, endo_length_mm=5.4, apex_wall_mm=0.01, base_mm=5.3)
    with pytest.raises(GeometryError, match="inverted: raise longitudinal_elements"):
        ellipsoid(flat)


def test_metres_written_as_millimetres_are_refused():
    with pytest.raises(GeometryError, match=r"the cavity holds 3\.28e-\d+ uL, which no heart does: set geometry.scale"):
        ellipsoid(Geometry(endo_radius_mm=1.45e-3, endo_length_mm=5.4e-3, wall_mm=1e-3, base_mm=1.4e-3))
