"""Valves and papillary muscles: their shape, how they move, and where they are."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import scene

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium import arc
from echotruth.imaging.medium.annulus import ANTERIOR, Rim
from echotruth.imaging.medium.aortic_root import aortic_tissue
from echotruth.imaging.medium.aortic_valve import AorticCusps, AorticValve
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.medium import bodies
from echotruth.imaging.medium.mitral_valve import ANNULUS, LEAFLETS, Leaflets, MitralValve, Part
from echotruth.imaging.medium.papillary_muscles import AZIMUTHS, PapillaryMuscle, PapillaryMuscles
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.medium.tricuspid_valve import TricuspidValve
from echotruth.imaging.view import imaging_plane
from echotruth.units import per_mm3

CONFIG = Config.model_validate(
    {"phantom": {"density_per_mm3": 3000.0}, "realism": {"preset": "mouse"}, "views": {"preset": "echo"}}
)
EJECTED = np.array([0.0, 0.0, 0.5, 1.0, 1.0, 0.6, 0.2, 0.1])
"""Course of a cycle: isovolumic, ejection, isovolumic, filling."""
SHUT, OPEN, EJECTING = 1, 4, 2
SHRUNK = np.diag([0.8, 0.8, 0.85])
"""Deformation at end-systole."""


@pytest.fixture(scope="module")
def beating(twisting_heart, coarse_mesh):
    """Function of displacements (frame, n_nodes, 3), m: a heart."""
    arrays = {"geometry": {"endo": coarse_mesh.endo, "epi": coarse_mesh.epi}}
    return lambda displacement: replace(twisting_heart, displacement=displacement, es=3, arrays=arrays)


@pytest.fixture(scope="module")
def heart(beating, coarse_mesh):
    """A ventricle that narrows by a fifth, and shortens by 15 %, as it empties."""
    return beating(EJECTED[:, None, None] * (coarse_mesh.nodes @ (SHRUNK - np.eye(3))))


@pytest.mark.parametrize(("first", "last"), [(0.3, 1.2), (1.5, 1.1), (0.7, 0.7 + 1e-6), (-0.4, 2.5)])
def test_an_arc_is_as_long_as_it_should_be_and_its_inverse_leads_back(first, last):
    share = np.linspace(0, 1, 2001)
    points = arc.points(first, last, share)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(1, abs=1e-6)
    assert np.linalg.norm(points[-1]) == pytest.approx(arc.chord(last - first), rel=1e-12)
    tangent = np.gradient(points, share, axis=0)
    np.testing.assert_allclose(np.sum(tangent * arc.normals(first, last, share), axis=1), 0, atol=1e-3)
    found, distance = arc.inverse(first, last, points + 0.05 * arc.normals(first, last, share))
    np.testing.assert_allclose(found, share, atol=1e-6)
    np.testing.assert_allclose(distance, 0.05, atol=1e-6)


def test_leaflets_keep_their_length_as_they_open(heart):
    valve, share = MitralValve(heart), np.linspace(0, 1, 401)
    for side in LEAFLETS:
        for commissural in (-0.8, -0.3, 0.0, 0.5, 0.9):
            lines = [valve.leaflet(frame, side, commissural + 0 * share, share) for frame in (SHUT, 5, 6, OPEN)]
            lengths = [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines]
            # Waves of the surface are shorter on the inner side of an arc.
            assert np.ptp(lengths) / np.mean(lengths) < 0.02, lengths


def test_leaflets_meet_below_the_annulus_when_shut_and_leave_the_way_free_when_open(heart):
    valve, commissural = MitralValve(heart), np.linspace(-0.9, 0.9, 19)
    edges = {side: valve.leaflet(SHUT, side, commissural, np.ones(19)) for side in LEAFLETS}
    np.testing.assert_allclose(edges[Part.ANTERIOR], edges[Part.POSTERIOR], atol=1e-9)
    assert (edges[Part.ANTERIOR][:, 2] < 0).all()
    # Of 748 adults, per height of the body: an annulus of 20 mm/m from front to back, tenting, lengths of both leaflets
    # (PMC10257802, table 4), within a standard deviation.
    share, hinges, lengths = np.linspace(0, 1, 201), [], []
    for side in LEAFLETS:
        line = valve.leaflet(SHUT, side, 0 * share, share)
        hinges.append(line[0, 0])
        lengths.append(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    diameter, depth = hinges[0] - hinges[1], -line[-1, 2]
    assert depth / diameter == pytest.approx(5.8 / 20, abs=1.7 / 20)
    assert lengths[0] / diameter == pytest.approx(16 / 20, abs=2 / 20)
    assert lengths[1] / diameter == pytest.approx(9 / 20, abs=2 / 20)
    ends = [valve.leaflet(OPEN, side, np.zeros(1), np.ones(1))[0] for side in LEAFLETS]
    assert ends[0][0] - ends[1][0] > 0.9 * diameter and max(end[2] for end in ends) < -0.3 * diameter


def test_shut_leaflets_are_convex_towards_the_atrium_and_half_open_ones_towards_the_ventricle(heart):
    valve, share = MitralValve(heart), np.linspace(0, 1, 101)
    valve.opening = np.array([0.0, 0.35])
    for frame, above in ((0, True), (1, False)):
        line = valve.leaflet(frame, Part.ANTERIOR, np.zeros(101), share)
        straight = line[0] + share[:, None] * (line[-1] - line[0])
        assert ((line - straight)[:, 2].mean() > 0) == above


def test_all_in_the_cavity_turns_with_the_base(beating, coarse_mesh):
    """A heart that is turned by 15 degrees about an oblique axis has all of it turned likewise."""
    axis, angle = np.array([0.6, -0.4, 0.69282]), np.radians(15)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    turned = beating(np.stack([0 * coarse_mesh.nodes, coarse_mesh.nodes @ turn.T - coarse_mesh.nodes]))
    at = scene(CONFIG, turned)
    for body in (Leaflets.seed(at), PapillaryMuscles.seed(at)):
        np.testing.assert_allclose(body.in_heart(1), body.in_heart(0) @ turn.T, atol=2e-8)
    valve, muscle = MitralValve(turned), PapillaryMuscle(turned, AZIMUTHS[0])
    for place, box in ((valve, (-2e-3, 1e-3)), (muscle, muscle.extent)):
        points = np.random.default_rng(2).uniform(*box, (20000, 3))
        points = muscle.to_heart(0, points) if place is muscle else points
        inside = place.contains(0, points)
        assert inside.sum() > 30 and np.array_equal(place.contains(1, points @ turn.T), inside)


def test_leaflets_are_in_the_cavity_or_its_wall_and_chordae_lead_to_papillary_muscles(heart):
    leaflets, cavity = Leaflets.seed(scene(CONFIG, heart)), Cavity(heart.endo)
    assert {*np.unique(leaflets.part)} == {*Part}
    muscles = [PapillaryMuscle(heart, azimuth) for azimuth in AZIMUTHS]
    for frame in (0, EJECTING, 3, OPEN, 6):
        nodes, position, rim = heart.positions(frame), leaflets.in_heart(frame), Rim(heart)(frame)
        inside = locate(nodes, heart.cells, position).cell >= 0
        inside |= locate(cavity.positions(nodes), cavity.cells, position).cell >= 0
        # The rest is on the annulus; of the circle that is the rim, as much as the polygon has not.
        outside = position[~inside]
        height = rim.to_ring(outside)[:, 2]
        assert (height > -0.05).all() and (height < 1.01 * ANNULUS).all()
        assert not (~inside & (leaflets.part == Part.CHORDA)).any()
        chorda = leaflets.part == Part.CHORDA
        begins = chorda & (leaflets.place[:, 1] < 0.02)
        tips = np.stack([muscle.tip(frame) for muscle in muscles])
        nearest = np.linalg.norm(position[begins][:, None] - tips, axis=2).min(axis=1)
        assert begins.sum() > 2 and nearest.max() < 0.1e-3


def test_leaflets_have_the_echo_of_their_area_when_the_rim_is_narrower_too(heart):
    leaflets = Leaflets.seed(scene(CONFIG, heart))
    radii = [Rim(heart)(frame).radius for frame in (0, 3)]
    assert radii[1] / radii[0] == pytest.approx(0.8, rel=1e-6)
    before, narrowed = (leaflets.amplitudes(frame).sum() for frame in (0, 3))
    assert narrowed / before == pytest.approx(0.64, rel=1e-6)


def test_papillary_muscles_shorten_as_the_wall_beside_them_and_keep_their_volume(heart):
    muscles = PapillaryMuscles.seed(scene(CONFIG, heart))
    assert 10 * np.log10((muscles.amplitude**2).mean()) == pytest.approx(
        CONFIG.realism.neighbours.papillary_muscles_dB, abs=0.8
    )
    for number, azimuth in enumerate(AZIMUTHS):
        ed, es = (muscles.in_heart(frame)[muscles.muscle == number] for frame in (0, 3))
        assert len(ed) > 300
        spread = [np.sqrt(np.linalg.eigvalsh(np.cov(each.T))) for each in (ed, es)]
        # The wall there is nearly parallel to the axis, along which all shortens by 15 %, and 20 % across.
        assert 0.83 < spread[1][2] / spread[0][2] < 0.86
        assert spread[1].prod() / spread[0].prod() == pytest.approx(1, rel=1e-6)
        assert PapillaryMuscle(heart, azimuth).stretch[3] == pytest.approx(0.845, abs=0.01)


def test_papillary_muscles_are_as_dense_as_muscle_in_the_cavity_and_attached_to_its_wall(heart):
    muscles, cavity = PapillaryMuscles.seed(scene(CONFIG, heart)), Cavity(heart.endo)
    nodes = heart.positions(0)
    assert (locate(cavity.positions(nodes), cavity.cells, muscles.in_heart(0)).cell >= 0).all()
    for number, azimuth in enumerate(AZIMUTHS):
        one = muscles.position[muscles.muscle == number]
        box = (np.abs(one - one.mean(axis=0)) < 0.1e-3).all(axis=1).sum()
        expected = CONFIG.phantom.density_per_mm3 * per_mm3 * 0.2e-3**3
        assert abs(box - expected) < 4 * np.sqrt(expected)
        # From its root outwards is muscle; beside its tip is blood.
        radial = np.array([np.cos(azimuth), np.sin(azimuth), 0])
        lowest, tip = one[one[:, 2].argmin()], PapillaryMuscle(heart, azimuth).tip(0)
        steps = np.linspace(0, 0.5e-3, 11)[:, None] * radial
        is_wall = [(locate(nodes, heart.cells, point + steps).cell >= 0) for point in (lowest, tip)]
        assert is_wall[0].any() and not is_wall[1][:4].any()


def test_cusps_meet_on_the_axis_when_shut_and_stand_beside_the_walls_when_open(heart):
    valve, azimuth = AorticValve(heart), np.linspace(0, 2 * np.pi, 12, endpoint=False)
    places = {frame: valve.ring(frame).to_ring(valve.leaflet(frame, azimuth, np.ones(12))) for frame in (0, EJECTING)}
    radius = {frame: np.hypot(*place[:, :2].T) for frame, place in places.items()}
    assert radius[0].max() < 0.05 and (radius[EJECTING] > 0.9).all() and (radius[EJECTING] < 1).all()
    assert (places[EJECTING][:, 2] > places[0][:, 2]).all()


def test_cusps_are_in_the_root_with_the_tissue_around_it(heart):
    cusps = AorticCusps.seed(scene(CONFIG, heart))
    position = cusps.in_heart(0)
    nodes = heart.positions(0)
    seen = locate(nodes, heart.cells, position).cell < 0
    above = Rim(heart)(0).to_ring(position)[:, 2] > 0
    tissue = aortic_tissue(heart, position)
    assert seen.sum() > 300 and (tissue[above] == TissueLabel.AORTIC_ROOT).mean() > 0.97


@pytest.mark.parametrize(
    ("view", "is_seen"), [("three_chamber", True), ("four_chamber", False), ("two_chamber", False)]
)
def test_the_aortic_root_is_seen_in_the_three_chamber_view_alone(heart, view, is_seen):
    plane = imaging_plane(CONFIG.views[view], CONFIG.rf, heart.endo_at_ed)
    axial = (np.arange(200) + 0.5) * 14e-3 / 200
    lateral = axial - 7e-3
    for frame in (0, EJECTING, 3):
        image = TissueImages(CONFIG, heart, plane, axial, lateral)(frame)
        found = {*np.unique(image).tolist()}
        root = {TissueLabel.AORTIC_ROOT, TissueLabel.AORTIC_WALL, TissueLabel.AORTIC_CUSP}
        assert root <= found if is_seen else not root & found
        if is_seen:
            # From left to right: atrium, wall, root, wall.
            row = image[(image == TissueLabel.AORTIC_ROOT).sum(axis=1).argmax()]
            lumen, atrium = (
                np.flatnonzero(row == TissueLabel.AORTIC_ROOT),
                np.flatnonzero(row == TissueLabel.LEFT_ATRIUM),
            )
            walls = np.flatnonzero(row == TissueLabel.AORTIC_WALL)
            assert atrium.max() < lumen.min() and walls.min() < lumen.min() and walls.max() > lumen.max()


def test_there_are_no_cusps_without_a_root_and_no_chordae_without_papillary_muscles(heart):
    alone = {"preset": "mouse", "neighbours": {"chambers_dB": None, "papillary_muscles_dB": None}}
    config = Config.model_validate({"realism": alone, "views": {"preset": "echo"}})
    assert {AorticCusps, PapillaryMuscles}.isdisjoint(bodies(config)) and Leaflets in bodies(config)
    assert Part.CHORDA not in Leaflets.seed(scene(config, heart)).part
    plane = imaging_plane(config.views["three_chamber"], config.rf, heart.endo_at_ed)
    axial = (np.arange(200) + 0.5) * 14e-3 / 200
    found = np.unique(TissueImages(config, heart, plane, axial, axial - 7e-3)(0))
    assert TissueLabel.MITRAL_LEAFLET in found and TissueLabel.AORTIC_CUSP not in found


def test_the_anterior_leaflet_is_beside_the_root(heart):
    valve = MitralValve(heart)
    base = valve.rim(0).to_heart(valve.leaflet(0, Part.ANTERIOR, np.zeros(1), np.zeros(1)))
    outwards = np.array([np.cos(ANTERIOR), np.sin(ANTERIOR), 0.3])
    near = base + np.linspace(0, 0.2e-3, 21)[:, None] * outwards
    assert TissueLabel.AORTIC_WALL in aortic_tissue(heart, near)


def test_tricuspid_leaflets_meet_when_shut_and_point_into_the_ventricle_when_open(heart):
    valve = TricuspidValve(heart)
    across, ends = np.zeros(2), np.ones(2)
    shut, open_ = int(np.argmin(valve.opening)), int(np.argmax(valve.opening))
    septal, free = valve.leaflet(shut, np.array([-1.0, 1.0]), across, ends)
    assert np.linalg.norm(septal - free) < 1e-9
    assert valve.ring(shut).to_ring(septal[None])[0, 2] == pytest.approx(-2 * 0.15, rel=1e-9)
    septal, free = valve.ring(open_).to_ring(valve.leaflet(open_, np.array([-1.0, 1.0]), across, ends))
    assert septal[2] < -0.9 and np.linalg.norm(septal - free) > 1.4
    for frame in (shut, open_):  # Lengths are kept.
        share = np.linspace(0, 1, 200)
        line = valve.ring(frame).to_ring(valve.leaflet(frame, np.ones(200), np.full(200, 0.3), share))
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        start = valve.ring(shut).to_ring(valve.leaflet(shut, np.ones(200), np.full(200, 0.3), share))
        assert length == pytest.approx(np.linalg.norm(np.diff(start, axis=0), axis=1).sum(), rel=1e-3)


def test_tricuspid_leaflets_are_where_their_scatterers_are(heart):
    valve, random_ = TricuspidValve(heart), np.random.default_rng(2)
    side = random_.choice([-1.0, 1.0], 300)
    across, share = random_.uniform(-0.9, 0.9, 300), random_.uniform(0.05, 0.95, 300)
    for frame in range(len(valve.opening)):
        place = valve.leaflet(frame, side, across, share)
        assert valve.contains(frame, place).all()
        low, high = valve.box
        assert ((place >= low) & (place <= high)).all()
        assert not valve.contains(frame, place + 0.3 * valve.ring(frame).radius * np.array([0, 0, 1.0])).all()
