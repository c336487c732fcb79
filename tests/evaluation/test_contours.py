"""Strain of contours, and rotation, of hearts whose motion is an exact formula."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipe

import echotruth as et
from echotruth.config import View
from echotruth.evaluation.contours import Contours, contours
from echotruth.evaluation.points import truth_at
from echotruth.heart import Heart
from echotruth.imaging.view import imaging_plane
from echotruth.mechanics.fibres import wall_depth
from echotruth.tracking.point_grid import grid_positions

CONTRACTION, SHORTENING, TORSION = 0.3, 0.12, 14.0
TUBE = {
    "geometry": {
        "shape": "tube",
        "endo_length_mm": 3,
        "base_mm": 1,
        "circumferential_elements": 24,
        "longitudinal_elements": 4,
        "transmural_elements": 3,
    },
    "motion": {
        "kind": "tube",
        "tube": {
            "contraction": CONTRACTION,
            "shortening": SHORTENING,
            "torsion_deg": TORSION,
            "endo_rotation_deg": 0.0,
        },
    },
    "loop": {"frames": 3},
    "views": {
        "low": {"position": 0.7},
        "high": {"position": 0.3},
        "long": {"plane": "long_axis"},
    },
    "bmode": {"size_px": 256, "downsampling": [1]},
    "tracking": {"grid": 0.008},
}


@pytest.fixture(scope="module")
def tube():
    """The heart, and the truth of each view."""
    heart = et.beat(TUBE, progress=False)
    return heart, {name: truth(heart, name) for name in TUBE["views"]}


def truth(heart, name):
    view = heart.config.views[name]
    plane = imaging_plane(view, heart.config.rf, heart.endo_at_ed)
    return truth_at(heart, plane, view.plane, grid_positions(heart.config), heart.config)


def radii(heart):
    return [np.hypot(*heart.nodes[heart.wall_depth == depth, :2].T).max() for depth in (0.0, 1.0)]


def test_circumferential_strain_of_a_tube_is_the_change_of_its_radius(tube):
    """At constant volume r^2 = r_i^2 + (R^2 - R_i^2) / (1 - shortening)."""
    heart, truths = tube
    inner, outer = radii(heart)
    radius = np.array([inner, (inner + outer) / 2, outer])
    deformed = np.sqrt((inner * (1 - CONTRACTION)) ** 2 + (radius**2 - inner**2) / (1 - SHORTENING))
    for name in ("low", "high"):
        found = truths[name].courses["line_strain"]
        np.testing.assert_allclose(found[heart.es], deformed / radius - 1, atol=1.5e-3)
        np.testing.assert_array_equal(found[0], 0)
    assert found[heart.es, 0] == pytest.approx(-CONTRACTION, abs=1e-3)


def test_longitudinal_strain_of_a_tube_is_its_shortening():
    still = {"kind": "tube", "tube": {"shortening": SHORTENING, "torsion_deg": 0.0, "endo_rotation_deg": 0.0}}
    heart = et.beat(TUBE | {"motion": still}, progress=False)
    np.testing.assert_allclose(truth(heart, "long").courses["line_strain"][heart.es], -SHORTENING, atol=1e-4)


@pytest.mark.parametrize(("wide", "long"), [(0.7, 0.85), (1.0, 0.8)])
def test_gls_and_gcs_of_a_half_sphere_that_becomes_half_an_ellipsoid(half_sphere, wide, long):
    """Half the circumference of an ellipse is 2 a E(m), with the larger half-axis a; every layer is one of them."""
    motion = np.stack([0 * half_sphere.nodes, half_sphere.nodes * [wide - 1, wide - 1, long - 1]])
    depth = wall_depth(half_sphere)
    heart = Heart(half_sphere.nodes, half_sphere.cells, motion, depth, half_sphere.endo, layers=6, es=1)
    config, larger, smaller = et.configure(), max(wide, long), min(wide, long)
    for view, expected in (
        (View(plane="long_axis"), 2 * larger * ellipe(1 - (smaller / larger) ** 2) / np.pi - 1),
        (View(position=0.3), wide - 1),
    ):
        lines = contours(heart, imaging_plane(view, config.rf, heart.endo_at_ed))
        found = lines.line_strain(lines.displacement)
        np.testing.assert_allclose(found, [[0, 0, 0], [expected] * 3], atol=1.5e-3)


def test_twist_of_a_tube_is_the_torsion_between_its_views_counter_clockwise_seen_from_the_apex(tube):
    heart, truths = tube
    for name in ("low", "high"):
        expected = TORSION * heart.config.views[name].position * np.linspace(0, 1, 2)
        found = np.degrees(truths[name].courses["rotation"])
        np.testing.assert_allclose(found[[0, heart.es]], expected, atol=0.02)


def test_operator_finds_the_strain_of_the_contours_from_the_points_of_the_grid(tube):
    heart, truths = tube
    for name, tolerance in (("low", 5e-3), ("high", 5e-3), ("long", 5e-3)):
        one = truths[name]
        pieces = one.contour_fit(one.displacement)[:, :, 0].reshape(3, -1, 2, 2)
        found = one.contours.line_strain(pieces)[heart.es]
        np.testing.assert_allclose(found, one.courses["line_strain"][heart.es], atol=tolerance, err_msg=name)


def test_rigid_motion_in_the_plane_is_no_strain_and_its_rotation_alone():
    rigid = {"kind": "rigid", "rigid": {"lateral_um": 300.0, "axial_um": -200.0, "rotation_deg": 9.0}}
    heart = et.beat(TUBE | {"motion": rigid}, progress=False)
    courses = truth(heart, "low").courses
    np.testing.assert_allclose(courses["line_strain"], 0, atol=2e-5)
    seen = courses["region_strain"][np.isfinite(courses["region_strain"])]
    np.testing.assert_allclose(seen, 0, atol=5e-4)
    assert np.degrees(courses["rotation"][heart.es]) == pytest.approx(9, abs=1e-3)
    shifted = et.beat(TUBE | {"motion": rigid | {"rigid": {"lateral_um": 300.0, "axial_um": -200.0}}}, progress=False)
    np.testing.assert_allclose(truth(shifted, "long").courses["line_strain"], 0, atol=2e-5)


def ring(count=40):
    angle = 2 * np.pi * np.arange(count + 1) / count
    circle = 1e-3 * np.stack([np.cos(angle), np.sin(angle)], -1)
    ends = np.stack([circle[:-1], circle[1:]], 1)
    position = np.concatenate([radius * ends for radius in (1, 2, 3)])
    return Contours(position, np.zeros((1, *position.shape)), np.repeat(np.arange(3), count))


def test_parts_of_a_contour_that_are_unknown_do_not_count_and_half_must_be_known():
    lines = ring()
    moved = np.stack([-0.2 * lines.position] * 3)
    moved[1, :15] = np.nan  # of 40 pieces of the inner contour
    moved[2, :25] = np.nan
    found = lines.line_strain(moved)
    np.testing.assert_allclose(found[:2], -0.2)
    assert np.isnan(found[2, 0])
    np.testing.assert_allclose(found[2, 1:], -0.2)


@pytest.mark.parametrize("count", [40, 160])
def test_noise_of_a_line_is_no_strain_however_finely_it_is_drawn(count):
    """Noise of 1 % of the radius at its points makes the line itself longer: by 0.2 % with 40 pieces, 4 % with 160."""
    lines, random, tracked, drawn = ring(count), np.random.default_rng(1), [], []
    for _ in range(20):
        noise = 1e-5 * np.arange(1, 4)[:, None, None] * random.normal(size=(3, count, 2))
        start = noise - 0.2 * lines.position[:, 0].reshape(3, count, 2)
        moved = np.stack([start, np.roll(start, -1, 1)], 2).reshape(-1, 2, 2)
        tracked.append(lines.line_strain(moved[None])[0])
        ends = lines.position + moved
        drawn.append(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).sum())
    length = np.linalg.norm(lines.position[:, 1] - lines.position[:, 0], axis=-1).sum()
    assert np.mean(drawn) / length - 1 > -0.2 + (0.001 if count == 40 else 0.02)
    np.testing.assert_allclose(np.mean(tracked, 0), -0.2, atol=2e-3)


def test_a_plane_beside_the_heart_has_no_contours_and_no_strain_of_them(tube):
    heart, _ = tube
    plane = imaging_plane(heart.config.views["low"], heart.config.rf, heart.endo_at_ed)
    beside = replace(plane, origin=plane.origin + [0, 0, 0.05])
    found = contours(heart, beside)
    assert len(found.position) == 0
    assert np.isnan(found.line_strain(found.displacement)).all()
