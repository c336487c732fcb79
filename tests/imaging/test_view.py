"""Views: the probe stands where the conventions say."""

import numpy as np
import pytest

from echotruth.aha import segment
from echotruth.config import Bmode, Config, Geometry, Probe, Rf, View
from echotruth.config.imaging import Offset, ViewMotion
from echotruth.config.loading import ConfigError, validate
from echotruth.echo.wall import LEFT_AND_RIGHT, SEPTAL_AND_FREE
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import bmode_clip, pixel_centres
from echotruth.imaging.view import imaging_plane
from echotruth.mechanics.geometry.ellipsoid import semi_axes

ENDO = np.array([[0, 0, -6e-3], [1e-3, 0, 0], [-1e-3, 0, -1e-3]])


def test_short_axis_shows_anterior_above_and_septum_on_the_left():
    positions = imaging_plane(View(position=0.5), Rf(), ENDO).to_image(np.array([[0, 2e-3, -3e-3], [2e-3, 0, -3e-3]]))
    anterior, septum = positions
    assert np.allclose(anterior, [0, 4.5e-3, 0])  # 2 mm nearer to the probe than the axis at 6.5 mm
    assert np.allclose(septum, [-2e-3, 6.5e-3, 0])


def test_long_axis_looks_from_the_apex_to_the_base():
    long_axis = imaging_plane(View(plane="long_axis"), Rf(), ENDO)
    apex, base = long_axis.to_image(np.array([[0, 0, -6e-3], [0, 0, 0.0]]))
    assert apex[1] < base[1]
    assert apex[0] == base[0] == 0


def test_image_and_heart_coordinates_are_inverse():
    long_axis = imaging_plane(View(plane="long_axis", rotation_deg=35.0), Rf(), ENDO)
    positions = np.random.default_rng(0).normal(size=(10, 3)) * 1e-3
    assert np.allclose(long_axis.to_heart(long_axis.to_image(positions)), positions, atol=1e-17)


@pytest.mark.parametrize("tilt", [-20.0, 15.0])
@pytest.mark.parametrize("view", [View(position=0.3), View(plane="long_axis", rotation_deg=60.0)])
def test_tilted_plane_turns_about_its_lateral_axis_with_its_upper_edge_along_the_elevation_axis(view, tilt):
    straight = imaging_plane(view, Rf(), ENDO).axes
    axes = imaging_plane(view.model_copy(update={"tilt_deg": tilt}), Rf(), ENDO).axes
    assert np.allclose(axes @ axes.T, np.eye(3)) and np.allclose(np.cross(axes[0], axes[1]), axes[2])
    assert np.allclose(axes[0], straight[0])
    assert np.degrees(np.arcsin(-axes[1] @ straight[2])) == pytest.approx(tilt)


def test_oblique_short_axis_cuts_a_cylinder_in_the_ellipse_that_geometry_gives_about_the_same_point():
    radius, tilt, angle = 2e-3, np.radians(25), np.linspace(0, 2 * np.pi, 50)
    oblique = imaging_plane(View(position=0.4, tilt_deg=25.0), Rf(), ENDO)
    ellipse = np.stack([radius * np.cos(angle), 6.5e-3 + radius / np.cos(tilt) * np.sin(angle), 0 * angle], axis=-1)
    cut = oblique.to_heart(ellipse)
    assert np.allclose(np.hypot(cut[:, 0], cut[:, 1]), radius)
    assert cut[:, 2].mean() == pytest.approx(0.4 * -6e-3, rel=0.02)
    anterior = cut[np.argmax(cut[:, 1])]
    assert anterior[2] == pytest.approx(0.4 * -6e-3 + radius * np.tan(tilt), rel=1e-2)  # nearer to the base


@pytest.mark.parametrize(("rotation", "side"), [(0.0, [0, 1.0, 0]), (90.0, [-1.0, 0, 0])])
def test_foreshortened_long_axis_holds_the_middle_of_the_base_and_passes_the_apex_at_the_sine_of_its_tilt(
    rotation, side
):
    length, tilt = 6e-3, np.radians(12)
    plane = imaging_plane(View(plane="long_axis", rotation_deg=rotation, tilt_deg=12.0), Rf(), ENDO)
    base, apex = plane.to_image(np.array([[0, 0, 0.0], [0, 0, -length]]))
    assert np.allclose(base, [0, 6.5e-3 + length / 2, 0])
    assert np.allclose(apex, [0, base[1] - length * np.cos(tilt), -length * np.sin(tilt)])
    # The point of the plane in front of the apex lies on the stated side of it.
    in_front = plane.to_heart(np.array([0, apex[1], 0]))
    assert np.allclose(in_front - [0, 0, -length], length * np.sin(tilt) * plane.axes[2], atol=1e-12)
    assert (in_front - [0, 0, -length]) @ np.array(side) > 0


def test_views_of_an_echo_show_the_segments_that_they_do_in_life():
    """Long axes have the walls at the left and at the right that the AHA names, short axes one level each."""
    views = Config(views={"preset": "echo"}).views
    assert set(views) == {*LEFT_AND_RIGHT, *SEPTAL_AND_FREE}
    levels = -6e-3 * np.array([1, 3, 5]) / 6
    for name, sides in LEFT_AND_RIGHT.items():
        plane, middle = imaging_plane(views[name], Rf(), ENDO), np.array([0, 0, -3e-3])
        depth = plane.to_image(middle)[1]
        for lateral, expected in zip((-3e-3, 3e-3), sides, strict=True):
            wall = plane.to_heart(np.array([[lateral, depth + z - middle[2], 0] for z in levels]))
            assert sorted(segment(wall, -6e-3)) == sorted(expected), name
    for name, walls in SEPTAL_AND_FREE.items():
        around = np.arange(0, 2 * np.pi, 0.1)
        height = np.full_like(around, views[name].position * -6e-3)
        ring = np.column_stack([3e-3 * np.cos(around), 3e-3 * np.sin(around), height])
        assert set(segment(ring, -6e-3)) == {*walls[0], *walls[1]}


def on_screen(position):
    """Lateral and axial coordinates (n, 3) as complex numbers, to the right and up."""
    return position[:, 0] - 1j * position[:, 1]


POSE = {"angle_deg": 12.0, "offset": Offset(lateral_mm=1.5, axial_mm=-0.7)}
FOCUS = -6.5e-3j
"""On the screen: the middle of the heart before an upright probe."""


def posed(upright):
    """Where a turned and moved probe shows what an upright one shows, on the screen."""
    return (upright - FOCUS) * np.exp(1j * np.radians(12)) + FOCUS - (1.5e-3 + 0.7e-3j)


@pytest.mark.parametrize(
    "view", [View(position=0.3, tilt_deg=10.0), View(plane="long_axis", rotation_deg=-60.0, tilt_deg=-15.0)]
)
def test_probe_turned_and_moved_in_its_plane_shows_the_heart_turned_counter_clockwise_and_moved_back(view):
    points = np.random.default_rng(0).normal(size=(10, 3)) * 1e-3
    upright = imaging_plane(view, Rf(), ENDO).to_image(points)
    found = imaging_plane(view.model_copy(update=POSE), Rf(), ENDO).to_image(points)
    assert np.abs(on_screen(found) - posed(on_screen(upright))).max() < 1e-15
    assert np.abs(found[:, 2] - upright[:, 2]).max() < 1e-15


def test_image_of_a_point_appears_where_the_pose_of_the_probe_puts_it():
    """The lateral wall near the base, at the right of an upright long axis and 2 mm below the middle of the heart."""
    plane = imaging_plane(View(plane="long_axis", **POSE), Rf(), ENDO)
    scanner, bmode = Scanner(Probe(), Rf(lines=129), 13e-3), Bmode(size_px=256, downsampling=(1,))
    lines = scanner.lines(plane.to_image(np.array([[-2e-3, 0, -1e-3]])), np.ones(1))
    image = bmode_clip(lines[None], scanner.scan, scanner.range, bmode)[256][0].astype(float)
    axial, lateral = pixel_centres(bmode, 256)
    row, column = np.unravel_index(image.argmax(), image.shape)
    expected = posed(FOCUS + (2e-3 - 2e-3j))
    assert abs(lateral[column] - 1j * axial[row] - expected) < 12e-3 / 256


@pytest.mark.parametrize(
    ("motion", "is_closed"),
    [
        ({}, True),
        ({"rocking_deg": 5.0, "beat": {"lateral_mm": 1.0}}, True),
        ({"drift": {"elevation_mm": 0.1}}, False),
        ({"breathing": {"axial_mm": 0.1}}, False),
        ({"breathing": {"phase_deg": 90.0}}, True),
    ],
)
def test_drift_and_breathing_keep_the_cycle_from_closing(motion, is_closed):
    assert ViewMotion.model_validate(motion).is_closed == is_closed


@pytest.mark.parametrize(
    "view",
    [
        {"offset": {"axial_mm": 5.0}},
        {"offset": {"axial_mm": 2.0}, "motion": {"drift": {"axial_mm": -3.0}}},
        {"offset": {"axial_mm": 2.0}, "motion": {"beat": {"axial_mm": -3.0}}},
    ],
)
def test_probe_that_would_come_into_the_heart_is_refused(view):
    with pytest.raises(ConfigError, match=r"views\.mid\.offset\.axial_mm .*brings the array into the heart"):
        validate({"views": {"mid": view}}, "test")


@pytest.mark.parametrize("shape", [{}, {"scale": 1.1, "dilation": 1.2, "elongation": 1.3, "hypertrophy": 1.4}])
@pytest.mark.parametrize(
    ("angle", "slack"), [(0.0, 1e-3), (30.0, 0.2), (60.0, 0.4), (90.0, 1e-3), (120.0, 0.4), (-150.0, 0.5), (180.0, 0.5)]
)
def test_array_of_a_long_axis_may_come_as_near_as_the_heart_reaches_and_no_nearer(shape, angle, slack):
    (_, length, base), (radius, depth, _) = 1e3 * np.array(semi_axes(Geometry(**shape)))
    along = np.linspace(-depth, base, 20001)
    across, turn = radius * np.sqrt(1 - (along / depth) ** 2), np.radians(angle)
    # From the middle of the cavity's axis to the array, which unless it is turned stands before the apex.
    nearest = 13 - np.max(((base - length) / 2 - along) * np.cos(turn) + across * abs(np.sin(turn)))

    def given(axial):
        view = {"plane": "long_axis", "angle_deg": angle, "offset": {"axial_mm": axial}}
        field = {"rf": {"focus_mm": 13.0}, "bmode": {"field_of_view_mm": 24.0}}
        return validate(field | {"geometry": shape, "views": {"long": view}}, "test")

    with pytest.raises(ConfigError, match=r"views\.long\.offset\.axial_mm .*brings the array into the heart"):
        given(nearest + 1e-3)
    given(nearest - slack)
