"""Flow from frame to frame composes to the motion since end-diastole; point tracks and the slice are what they say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import echotruth as et
from echotruth.config import Config, Phantom, Probe
from echotruth.fem.tetrahedra import interpolate
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.flow import STEPS, beam_thickness, out_of_slice, slice_thickness
from echotruth.imaging.labels import LABELS, pack, unpack
from echotruth.imaging.medium.wall import seed_volume
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.tracks import follow, visible
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.repository import schema
from echotruth.repository.rounding import length_quantum, rounded
from echotruth.units import MHz, mm

CONFIG = Config()
AXIS = (np.arange(96) + 0.5) / 96 * 12e-3
PIXEL = 12e-3 / 512
NEXT, PREVIOUS = list(STEPS).index("next"), list(STEPS).index("previous")
SMALL = {"circumferential_elements": 6, "longitudinal_elements": 8, "transmural_elements": 2}
STRAIGHT = dict.fromkeys(("endo_deg", "epi_deg", "transverse_endo_deg", "transverse_epi_deg"), 0.0)
EVEN = {"regional": {"preset": "even"}, "hold": "base"}
"""Fibres along the circumference and walls alike, with which a heart does not twist: tissue keeps to its long-axis
plane."""


@pytest.fixture(scope="module")
def mid(twisting_heart):
    return imaging_plane(CONFIG.views["mid"], CONFIG.rf, twisting_heart.endo_at_ed)


@pytest.fixture(scope="module")
def affine_truth(twisting_heart, mid):
    return pixel_truth(twisting_heart, mid, AXIS, AXIS - 6e-3)


def pixels(axial, lateral):
    """Pixel centres (axial, lateral, 3), m: lateral, axial, elevation."""
    return np.stack(np.broadcast_arrays(lateral, axial[:, None], 0.0), axis=-1)


def test_flow_of_an_affine_motion_is_the_formula_to_both_sides(affine_truth, mid, affine):
    matrix, shift = affine
    now, mask = mid.to_heart(pixels(AXIS, AXIS - 6e-3)), unpack(affine_truth["labels"])["mask"]
    after, before = now @ matrix.T + shift, (now - shift) @ np.linalg.inv(matrix).T
    flow = affine_truth["flow"]
    for frame, to, where in ((0, NEXT, after), (1, PREVIOUS, before)):
        expected = ((where - now) @ mid.axes.T)[mask[frame]]
        assert np.abs(flow[frame, to][mask[frame]] - expected).max() < 1e-10  # stored in single precision
        assert np.isnan(flow[frame, to][~mask[frame]]).all()
    assert np.isnan(flow[0, PREVIOUS]).all() and np.isnan(flow[1, NEXT]).all()


class Beating:
    """A solved heart in a view: flow as it is stored at 512 px, of the left half of the image."""

    def __init__(self, heart, view):
        self.heart, config = heart, heart.config
        self.plane = imaging_plane(config.views[view], config.rf, heart.endo_at_ed)
        axial, lateral = pixel_centres(config.bmode, 512)
        lateral = lateral[:256]
        truth = pixel_truth(heart, self.plane, axial, lateral)
        self.origin = np.array([lateral[0], axial[0]])
        self.flow = rounded(truth["flow"], length_quantum(config))
        self.mask = unpack(truth["labels"])["mask"]
        self.positions = heart.nodes + heart.displacement

    def pixels(self, frame):
        """Pixels in the wall in a frame, (n, 2): lateral, axial."""
        return np.argwhere(self.mask[frame])[:, ::-1].astype(float)

    def step(self, points, frame, to):
        """Points (n, 2), px, moved by the flow between pixels; NaN where one of these is not in the wall."""
        image = np.moveaxis(self.flow[frame, to, ..., :2], -1, 0).astype(float)
        moved = [map_coordinates(each, points.T[::-1], order=1, cval=np.nan, prefilter=False) for each in image]
        return points + np.stack(moved, -1) / PIXEL

    def step_without_grid(self, points, frame):
        """Points moved to the next frame as their tissue moves in the plane, from the mesh; NaN outside the wall."""
        known = np.isfinite(points).all(axis=1)
        where, moved = self.origin + points[known] * PIXEL, np.full(points.shape, np.nan)
        moved[known] = follow(self.positions[frame : frame + 2], self.heart.cells, self.plane, where)[1, :, :2]
        return (moved - self.origin) / PIXEL

    def followed(self, points, start):
        """Positions (frame, n, 2), px, and elevation (frame, n), m, of the tissue at points, from the mesh."""
        where = follow(self.positions, self.heart.cells, self.plane, self.origin + points * PIXEL, start)
        return (where[..., :2] - self.origin) / PIXEL, where[..., 2]


@pytest.fixture(scope="module")
def solved():
    return et.beat(et.configure(geometry=SMALL, fibres=STRAIGHT, loop={"frames": 12}))


@pytest.fixture(scope="module")
def beating():
    heart = et.beat(et.configure(geometry=SMALL, fibres=STRAIGHT, mechanics=EVEN, loop={"frames": 12}))
    return Beating(heart, "long_axis")


@pytest.fixture(scope="module")
def composed(beating):
    """Largest error over all frames of flow composed since end-diastole, px, and largest elevation, m, by pixel."""
    points = beating.pixels(0)
    true, elevation = beating.followed(points, 0)
    error = np.zeros(len(points))
    for frame in range(len(beating.flow) - 1):
        points = beating.step(points, frame, NEXT)
        error = np.maximum(error, np.linalg.norm(points - true[frame + 1], axis=-1))
    return error, np.abs(elevation).max(axis=0)


@pytest.mark.slow
def test_flow_composes_to_the_motion_since_end_diastole_where_tissue_does_not_leave_the_plane(composed):
    error, elevation = composed
    kept = np.isfinite(error) & (elevation < 1e-6)
    assert kept.sum() > 1000
    assert error[kept].max() <= 0.05


@pytest.mark.slow
def test_flow_composes_nearly_so_within_the_slice_and_is_lost_only_along_the_edge_of_the_wall(composed):
    error, elevation = composed
    assert elevation.max() < 40e-6
    assert np.nanquantile(error, 0.99) <= 0.1
    assert np.isfinite(error).mean() > 0.9


def test_pixels_and_rounding_cost_less_than_a_twentieth_of_a_pixel_though_all_tissue_leaves_the_plane(solved):
    """Short-axis flow composed, against the exact motion in the plane composed."""
    beating = Beating(solved, "mid")
    points = exact = beating.pixels(0)
    assert np.abs(beating.followed(points, 0)[1]).max(axis=0).min() > 100e-6
    for frame in range(len(beating.flow) - 1):
        points, exact = beating.step(points, frame, NEXT), beating.step_without_grid(exact, frame)
        assert np.nanmax(np.linalg.norm(points - exact, axis=-1)) <= 0.05
    assert np.isfinite(points).all(axis=1).mean() > 0.8


def test_composed_flow_ends_where_the_displacement_since_end_diastole_says(beating):
    """The stored displacement of the tissue that is there in the end is the way back."""
    points, es = beating.pixels(0), beating.heart.es
    start = points
    for frame in range(es):
        points = beating.step(points, frame, NEXT)
    axial = (np.arange(512) + 0.5) * PIXEL
    ed = replace(beating.heart, displacement=beating.heart.displacement[[0, es]])
    displacement = pixel_truth(ed, beating.plane, axial, axial[:256] - 6e-3)["displacement"][1]
    image = np.moveaxis(displacement[..., :2], -1, 0).astype(float)
    back = [map_coordinates(each, points.T[::-1], order=1, cval=np.nan, prefilter=False) for each in image]
    error = np.linalg.norm(points - np.stack(back, -1) / PIXEL - start, axis=-1)
    elevation = np.abs(beating.followed(start, 0)[1]).max(axis=0)
    assert np.linalg.norm(points - start, axis=-1)[np.isfinite(error)].max() > 10  # px that tissue moves
    assert np.nanmax(error[elevation < 1e-6]) <= 0.05


def test_flow_carries_scatterers_as_the_phantom_does(beating):
    """Scatterers that are within 2 um of the plane, and the flow at the place of their echo."""
    heart = beating.heart
    points = seed_volume(Phantom(density_per_mm3=3000.0), heart.nodes, heart.cells, np.random.default_rng(0))
    for frame in (0, heart.es - 2, heart.es + 4):
        now, after = (
            beating.plane.to_image(interpolate(beating.positions[k], heart.cells, points)) for k in (frame, frame + 1)
        )
        near = np.abs(now[:, 2]) < 2e-6
        start = (now[near, :2] - beating.origin) / PIXEL
        error = beating.step(start, frame, NEXT) - (after[near, :2] - beating.origin) / PIXEL
        error = np.linalg.norm(error, axis=-1)
        assert np.isfinite(error).sum() > 50
        assert np.nanmax(error) < 0.02


def test_points_are_followed_from_any_frame_by_the_formula(twisting_heart, mid, affine, affine_truth):
    matrix, shift = affine
    places = pixels(AXIS, AXIS - 6e-3)
    chosen = [places[unpack(affine_truth["labels"])["mask"][frame]][::7] for frame in (0, 1)]
    start = np.repeat([0, 1], [len(each) for each in chosen])
    points = np.concatenate(chosen)
    positions = twisting_heart.nodes + twisting_heart.displacement
    found = follow(positions, twisting_heart.cells, mid, points[:, :2], start)
    now = mid.to_heart(points)
    after, before = mid.to_image(now @ matrix.T + shift), mid.to_image((now - shift) @ np.linalg.inv(matrix).T)
    np.testing.assert_allclose(found[0], np.where(start[:, None] == 0, points, before), atol=1e-15)
    np.testing.assert_allclose(found[1], np.where(start[:, None] == 0, after, points), atol=1e-15)


def test_point_outside_the_wall_has_no_track(twisting_heart, mid):
    positions = twisting_heart.nodes + twisting_heart.displacement
    found = follow(positions, twisting_heart.cells, mid, np.array([[0.0, 6.5e-3], [5.9e-3, 0.1e-3]]), 0)
    assert np.isnan(found).all() and not visible(CONFIG, found).any()


@pytest.mark.parametrize(
    "place, shown",
    [
        ((0.0, 6.5e-3, 0.0), True),
        ((0.0, 6.5e-3, 0.17e-3), True),  # the beam is 0.355 mm thick there
        ((0.0, 6.5e-3, -0.185e-3), False),
        ((0.0, 12.1e-3, 0.0), False),
        ((6.1e-3, 11e-3, 0.0), False),
        ((5.0e-3, 11.5e-3, 0.0), False),  # in the square, beyond the arc at which the sector ends
        ((3.0e-3, 5.0e-3, 0.0), True),
        ((3.0e-3, 4.0e-3, 0.0), False),  # outside of the sector of 64 degrees
        ((np.nan, np.nan, np.nan), False),
    ],
)
def test_point_is_visible_within_the_field_of_view_the_sector_and_the_slice(place, shown):
    assert visible(CONFIG, np.array([place]))[0] == shown


def test_slice_is_as_thick_as_a_squared_sinc_in_the_focus():
    """|E|^2 is sinc^2(H y / (lambda F)), which is half its maximum at 0.443."""
    for name in ("mouse_25MHz", "mouse_40MHz", "rat_15MHz", "human_2_7MHz"):
        p = Probe(preset=name)
        focus, wavelength = p.elevation_focus_mm * mm, p.sound_speed_m_per_s / (p.frequency_MHz * MHz)
        expected = 0.8859 * wavelength * focus / (p.height_mm * mm)
        assert beam_thickness(p, np.array([focus]))[0] == pytest.approx(expected, rel=1e-3)


def test_slice_of_a_harmonic_is_as_thick_as_a_sinc_times_the_square_of_one_twice_as_wide_in_the_focus():
    """sinc(u) sinc^2(u / 2) is half its maximum at 0.5109."""
    expected = 2 * 0.5109 * 1540 / 25e6 * 6.5
    assert beam_thickness(Probe(), np.array([6.5e-3]), harmonic=True)[0] == pytest.approx(expected, rel=1e-3)
    thickness = [slice_thickness(et.configure(**{"rf.harmonic": each}), np.array(6.5e-3)) for each in (False, True)]
    assert thickness[1] / thickness[0] == pytest.approx(0.5109 / 0.4429, rel=0.01)


@pytest.mark.parametrize("depth", [5e-3, 8e-3])
def test_echo_from_the_edge_of_the_slice_is_half_of_that_from_the_plane(depth):
    """Of the engine that makes the RF, over its whole band, of which the centre frequency stands for the beam."""
    matrix = FullMatrix(Probe(elements=3), 11e-3)
    edge = slice_thickness(CONFIG, np.array([depth]))[0] / 2
    echoes = [matrix(np.array([[0.0, depth, y]]), np.ones(1)) for y in (0.0, edge)]
    middle = len(matrix.centres) // 2
    energy = [(np.abs(each[:, middle, middle]) ** 2).sum() for each in echoes]
    assert np.sqrt(energy[1] / energy[0]) == pytest.approx(0.5, rel=0.03)


def test_slice_is_unbounded_where_scatterers_echo_at_any_elevation():
    ranges = np.array([[1e-3, 6e-3]])
    flat = et.configure(**{"rf.elevation_beam": False})
    in_plane = et.configure(**{"phantom.in_plane_only": True})
    assert all(np.isinf(slice_thickness(config, ranges)).all() for config in (flat, in_plane))
    assert np.isfinite(slice_thickness(CONFIG, ranges)).all()


def test_tissue_is_beside_the_slice_beyond_half_its_thickness():
    elevation = np.array([-0.6, -0.5, 0.0, 0.49, 0.51, np.nan])
    assert out_of_slice(elevation, np.array(1.0)).tolist() == [True, False, False, False, True, False]


def test_labels_survive_packing_in_the_order_of_the_repository():
    random = np.random.default_rng(1)
    labels = {name: random.integers(0, 4, 12).astype(np.uint8) for name in LABELS}
    found = unpack(pack(labels | {"wall_depth": np.zeros(12)}).reshape(3, 3, 4))
    assert all(np.array_equal(found[name].ravel(), labels[name]) for name in LABELS)
    assert np.array_equal(found["mask"], found["layer"] > 0)
    assert schema.LABELS["label"] == LABELS and schema.LABELS["to"] == tuple(STEPS)
