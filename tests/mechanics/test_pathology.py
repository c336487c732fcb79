"""Disease is where it was asked for, of the size asked for, and fades as asked for; so do regional factors."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from echotruth.cases import expand
from echotruth.config import Geometry, Pathology
from echotruth.config.building import configure
from echotruth.config.loading import validate
from echotruth.config.pathology import SCARS, Infarct
from echotruth.config.regional import Regional
from echotruth.fem.volume import cell_volumes, jacobians
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.pathology import PathologyError, infarct_centre, thinned, tissue

CONTRACTING, STIFF = {"tension_scale": 0.2}, {"stiffness_scale": 8.0}


class Hemisphere:
    """Half a thick sphere, radii 2 and 4 mm: volumes and distances are those of the textbook."""

    def __init__(self):
        size = {"endo_radius_mm": 2.0, "endo_length_mm": 2.0, "wall_mm": 2.0, "apex_wall_mm": 2.0, "base_mm": 0.0}
        elements = {"circumferential_elements": 36, "longitudinal_elements": 12, "transmural_elements": 6}
        self.mesh = left_ventricle(Geometry(**size, **elements))
        self.depth = (np.linalg.norm(self.mesh.nodes, axis=1) - 2e-3) / 2e-3
        self.volume = cell_volumes(self.mesh.nodes, self.mesh.cells)
        corners = self.mesh.nodes[self.mesh.cells[:, :4]]
        self.centre = corners.mean(axis=1)

    def with_(self, **infarct):
        return self.tissue(Pathology(infarct=Infarct(**infarct)))

    def tissue(self, pathology=Pathology(), **regional):  # noqa: B008, a default section does not change
        return tissue(self.mesh, self.depth, pathology, Regional(**({"preset": "even"} | regional)))


@pytest.fixture(scope="module")
def hemisphere():
    return Hemisphere()


def test_a_ball_is_centred_in_the_wall_and_has_the_volume_of_a_ball(hemisphere):
    infarct = Infarct(radius_mm=0.95, position=0.5, azimuth_deg=-120.0)
    centre = infarct_centre(hemisphere.mesh, hemisphere.depth, infarct)
    assert np.linalg.norm(centre) == pytest.approx(3e-3, abs=3e-6)
    assert centre[2] == pytest.approx(-1e-3)
    assert np.degrees(np.arctan2(centre[1], centre[0])) == pytest.approx(-120)
    ill = hemisphere.with_(radius_mm=0.95, azimuth_deg=-120.0).region == 1
    assert hemisphere.volume[ill].sum() == pytest.approx(4 / 3 * np.pi * 0.95e-3**3, rel=0.04)
    assert np.linalg.norm(hemisphere.centre[ill] - centre, axis=1).max() < 1e-3


def test_segments_have_their_volume_and_their_place(hemisphere):
    # Cut by planes above the endocardial apex, the hollow of the sphere is a cylinder: pi (16 - 4) mm2 of wall.
    ill = hemisphere.with_(segments=[1, 7]).region == 1
    assert hemisphere.volume[ill].sum() == pytest.approx(2 * np.pi * 12e-6 * (2e-3 / 3) / 6, rel=0.04)
    x, y, z = hemisphere.centre[ill].T
    assert np.all(np.abs(np.degrees(np.arctan2(y, x)) - 90) < 31)
    assert z.min() > -1.34e-3 and z.max() < 0


def test_an_infarct_is_stiff_and_does_not_contract(hemisphere):
    ill = hemisphere.with_(segments=[9])
    inside = ill.region == 1
    assert set(ill.tension_scale[inside]) == {0.0} and set(ill.stiffness_scale[inside]) == {20.0}
    assert set(ill.tension_scale[~inside]) == {1.0} and set(ill.stiffness_scale[~inside]) == {1.0}


def test_a_subendocardial_infarct_keeps_to_the_depth(hemisphere):
    ill = hemisphere.with_(segments=[1, 2, 3, 4, 5, 6], transmurality=0.5).region == 1
    assert np.linalg.norm(hemisphere.centre[ill], axis=1).max() < 3.05e-3
    # Between the planes, the inner half of the wall is the cylinder pi (9 - 4) mm2 across.
    assert hemisphere.volume[ill].sum() == pytest.approx(np.pi * 5e-6 * 2e-3 / 3, rel=0.05)


def test_the_border_zone_fades_linearly_with_the_distance(hemisphere):
    ball = {"radius_mm": 0.7, "position": 0.6, "azimuth_deg": 180.0}
    ill = hemisphere.with_(**ball, border_mm=0.8, **CONTRACTING, **STIFF)
    centre = infarct_centre(hemisphere.mesh, hemisphere.depth, Infarct(**ball))
    beyond = np.linalg.norm(hemisphere.centre - centre, axis=1) - 0.7e-3
    weight = np.clip(1 - beyond / 0.8e-3, 0, 1)
    # The samples of the infarct are a quarter of an edge apart.
    np.testing.assert_allclose(ill.stiffness_scale, 1 + 7 * weight, atol=7 * 0.15)
    np.testing.assert_allclose(ill.stiffness_scale - 1, (1 - ill.tension_scale) * 7 / 0.8, atol=1e-12)
    border = ill.region == 2
    assert np.all(beyond[border] > -0.02e-3) and np.all(beyond[border] < 0.8e-3)
    assert np.all((ill.tension_scale[border] > 0.2) & (ill.tension_scale[border] < 1))
    assert np.all(ill.region[beyond > 0.81e-3] == 0)
    assert np.std(ill.stiffness_scale[border] - 1 - 7 * weight[border]) < 0.15


def test_regional_factors_are_those_of_the_middles_of_segments_and_multiply_those_of_a_scar(hemisphere):
    healthy = hemisphere.tissue(contractility={"10": 0.5}, stiffness={10: 3.0})
    azimuth = np.degrees(np.arctan2(hemisphere.centre[:, 1], hemisphere.centre[:, 0]))
    third = -hemisphere.centre[:, 2] / (2e-3 / 3)
    inside = (third > 1.02) & (third < 1.98)
    weight = np.clip(1 - np.abs(azimuth + 90) / 60, 0, 1)  # segment 10 is inferior, at -90 deg
    np.testing.assert_allclose(healthy.tension_scale[inside], 1 - 0.5 * weight[inside], atol=2e-3)
    np.testing.assert_allclose(healthy.stiffness_scale[inside], 1 + 2 * weight[inside], atol=8e-3)
    assert np.all(healthy.tension_scale[third < 0.98] == 1) and not healthy.region.any()
    scarred = hemisphere.tissue(Pathology(infarct=Infarct(segments=[10], tension_scale=0.2)), contractility={10: 0.5})
    infarct = scarred.region == 1
    np.testing.assert_allclose(scarred.tension_scale[infarct], 0.2 * healthy.tension_scale[infarct])
    walls, weak = (hemisphere.tissue(preset="normal", contractility=given) for given in ({}, {10: 0.5}))
    np.testing.assert_allclose(weak.tension_scale, walls.tension_scale * healthy.tension_scale)


@pytest.mark.parametrize(
    ("infarct", "sentence"),
    [
        (
            {"radius_mm": 0.001},
            r"radius_mm = 0.001 at position 0.5 and azimuth_deg 90.0: no cell .*: increase radius_mm",
        ),
        ({"segments": [17], "transmurality": 0.01}, r"segments = \[17\]: no cell .*: name segments that the mesh has"),
    ],
)
def test_an_infarct_that_is_nowhere_is_refused(hemisphere, infarct, sentence):
    with pytest.raises(PathologyError, match=sentence):
        hemisphere.with_(**infarct)


def test_the_age_of_an_infarct_gives_what_is_not_given_else_however_the_heart_is_configured():
    given = {"segments": [7], "age": "fresh", "stiffness_scale": 3}
    fresh = validate({"pathology": {"infarct": given}}, "a.yaml")
    assert fresh.pathology.infarct.scar() == Infarct(**given).scar() == SCARS["fresh"] | {"stiffness_scale": 3}
    old = configure(fresh, **{"pathology.infarct.age": "old"}).pathology.infarct.scar()
    assert old == SCARS["old"] | {"stiffness_scale": 3}
    ages = configure(pathology={"infarct": {"segments": [7]}}, cases={"pathology.infarct.age": [None, "fresh", "old"]})
    assert [case.config.pathology.infarct.scar() for case in expand(ages)] == list(SCARS.values())
    none, fresh, old = (scar["taut_stiffness_kPa"] for scar in SCARS.values())
    assert old > fresh > none == 0


def test_a_scar_is_taut_and_the_muscle_away_from_it_weakens(hemisphere):
    ill = hemisphere.with_(
        segments=[9], taut_stiffness_kPa=400.0, remote_tension_scale=0.7, tension_scale=0.1, border_mm=0.5
    )
    scar, remote = ill.region == 1, ill.region == 0
    assert set(ill.taut_stiffness[scar]) == {4e5} and not ill.taut_stiffness[remote].any()
    assert set(ill.tension_scale[scar]) == {0.1} and set(ill.tension_scale[remote]) == {0.7}
    border = ill.region == 2
    np.testing.assert_allclose((0.7 - ill.tension_scale[border]) / 0.6, ill.taut_stiffness[border] / 4e5)
    assert set(hemisphere.with_(remote_tension_scale=0.7).tension_scale) == {1.0}  # remote from nothing


@pytest.mark.slow
def test_a_thin_scar_has_its_thickness_and_leaves_the_cavity_and_the_base_where_they_are(hemisphere):
    infarct = Infarct(segments=[8, 9, 10], thickness_scale=0.5)
    mesh, before = thinned(hemisphere.mesh, infarct), hemisphere.mesh
    endo, base = np.unique(mesh.endo), np.unique(mesh.base)
    np.testing.assert_allclose(mesh.nodes[endo], before.nodes[endo], atol=1e-12)
    np.testing.assert_array_equal(mesh.nodes[base, 2], before.nodes[base, 2])
    assert jacobians(mesh.nodes, mesh.cells).min() > 0
    radius = np.linalg.norm(before.nodes, axis=1)
    of_scar = np.unique(before.cells[tissue_of(hemisphere, infarct) == 1])
    edge = np.unique(before.cells[tissue_of(hemisphere, infarct) != 1])
    within = np.setdiff1d(of_scar, edge)
    thin = np.linalg.norm(mesh.nodes[within], axis=1)
    np.testing.assert_allclose(thin - 2e-3, 0.5 * (radius[within] - 2e-3), atol=2e-5)
    gap, _ = KDTree(before.nodes[of_scar]).query(before.nodes)
    far = gap > 2.5e-3  # the wall's thickness, and a cell
    assert far.any()
    np.testing.assert_array_equal(mesh.nodes[far], before.nodes[far])
    assert thinned(before, Infarct(segments=[7])) is before


def tissue_of(hemisphere, infarct):
    return hemisphere.tissue(Pathology(infarct=infarct)).region
