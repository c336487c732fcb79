"""Motion of the heart as a whole relative to the probe: a closed form in the image, and no strain."""

from dataclasses import replace

import finished_repository
import numpy as np
import pytest

from benchmarks.difficulty.floors import difficulty
from echotruth.cases import expand
from echotruth.config import Config, Motion, View
from echotruth.config.building import configure
from echotruth.config.imaging import Excursion, ViewMotion
from echotruth.config.motion import Rigid
from echotruth.evaluation.points import ground_truth, read_truth
from echotruth.evaluation.scoring import score
from echotruth.fem.location import locate
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.surroundings import SurroundingsMotion, outside_heart
from echotruth.imaging.truth import material_truth, pixel_truth
from echotruth.imaging.view import before_probe
from echotruth.learning.point_tracks import PointTracks
from echotruth.repository.reader import Repository
from echotruth.repository.rounding import STRAIN, length_quantum
from echotruth.tracking.point_grid import grid_positions

FRAMES = 6
MOTION = {
    "drift": {"lateral_mm": 0.8, "axial_mm": -0.4, "elevation_mm": 0.2},
    "breathing": {"axial_mm": 0.5, "rate_per_min": 150.0, "phase_deg": 60.0},
    "beat": {"lateral_mm": -0.3, "axial_mm": 0.4, "elevation_mm": -0.1},
    "rocking_deg": 6.0,
}
POSE = {"tilt_deg": 8.0, "angle_deg": -15.0, "offset": {"lateral_mm": -0.3, "axial_mm": 0.2}}
AXIS = (np.arange(96) + 0.5) / 96 * 12e-3


def config(frames, motion):
    views = {"mid": POSE | {"motion": motion}, "long": POSE | {"plane": "long_axis", "motion": motion}}
    return Config.model_validate(
        {"loop": {"frames": frames, "heart_rate_per_min": 500.0}, "views": views, "tracking": {"grid": 0.016}}
    )


def turn_and_shift(frame):
    """Rotation on the screen as a complex factor, and displacement: on the screen, and out of the plane, m.

    A beat takes 0.12 s, in which there is 0.3 of a breath.
    """
    beats = frame / FRAMES
    within = np.sin(np.pi * beats) ** 2
    turn = np.exp(1j * np.radians(6) * within)
    breath = np.sin(np.pi * 0.3 * beats + np.radians(30)) ** 2 - np.sin(np.radians(30)) ** 2
    shift = (0.8 + 0.4j) * 1e-3 * beats - 0.5e-3j * breath - (0.3 + 0.4j) * 1e-3 * within
    return turn, shift, 0.2e-3 * beats - 0.1e-3 * within


@pytest.fixture(scope="module")
def still(twisting_heart):
    return replace(twisting_heart, displacement=np.zeros((FRAMES, len(twisting_heart.nodes), 3)))


@pytest.mark.parametrize("view", ["mid", "long"])
def test_tissue_at_rest_moves_in_the_image_as_the_rigid_motion_of_the_closed_form(still, view):
    setting = config(FRAMES, MOTION)
    heart, plane = before_probe(still, setting, view)
    grid = grid_positions(setting)
    found = material_truth(heart, plane, grid, setting.views[view].plane)
    inside = found["layer"] > 0
    at_ed = grid[inside] @ [1, -1j]
    assert inside.sum() > 100 and not found["true_displacement"][0][inside].any()
    for frame in range(FRAMES):
        turn, shift, out = turn_and_shift(frame)
        # Truth is kept in single precision.
        displacement = found["true_displacement"][frame][inside] @ [1, -1j]
        assert np.abs(displacement - (turn * at_ed + shift - at_ed)).max() < 2e-10
        assert np.abs(found["through_plane"][frame][inside] - out).max() < 1e-10
        assert np.abs(found["heart_strain"][frame][inside]).max() < 1e-6
        assert np.abs(found["plane_strain"][frame][inside]).max() < 1e-6


def test_pixels_of_a_frame_are_in_the_wall_where_the_motion_undone_leads_into_it(still):
    heart, plane = before_probe(still, config(FRAMES, MOTION), "mid")
    truth, frame = pixel_truth(heart, plane, AXIS, AXIS - 6e-3), FRAMES - 1
    turn, shift, out = turn_and_shift(frame)
    pixels = (AXIS - 6e-3) - 1j * AXIS[:, None]
    before = (pixels - shift) / turn
    at_ed = np.stack([before.real, -before.imag, np.full(before.shape, -out)], axis=-1).reshape(-1, 3)
    expected = locate(still.positions(0), still.cells, plane.to_heart(at_ed)).cell.reshape(before.shape) >= 0
    known = np.isfinite(truth["displacement"][frame, ..., 0])
    assert known.sum() > 500 and np.array_equal(known, expected)
    displacement = truth["displacement"][frame][known] @ [1, -1j, 0]
    assert np.abs(displacement - (pixels - before)[known]).max() < 2e-10
    assert np.abs(truth["strain"][frame][known]).max() < 1e-6


STRAIN_SCORES = ("strain_bias", "strain_rms", "frame_strain_rms", "segment_strain_error")
STRAINS = ("tracked_region_strain", "tracked_segment_strain", "tracked_line_strain")


@pytest.mark.parametrize("view", ["mid", "long"])
def test_strain_and_its_scores_do_not_know_the_motion(twisting_heart, view):
    """Displacement is stored to 0.06 um, which at points 0.19 mm apart is 3e-4 of strain, and 1e-4 in the mean."""
    strains, scores = [], []
    for motion in ({}, MOTION):
        setting = config(2, motion)
        (heart, plane), kind = before_probe(twisting_heart, setting, view), setting.views[view].plane
        truth = ground_truth(heart, plane, kind, setting)
        exact = material_truth(heart, plane, grid_positions(setting), kind)["true_displacement"][:, truth.inside]
        strains.append([*truth.strain[:2, 1], truth.operator.strain(exact)[1]])
        tracked = np.full((2, *truth.inside.shape, 2), np.nan)
        tracked[:, truth.inside] = truth.displacement
        scores.append(score(tracked, truth))
    (alone, moved), (before, after) = strains, scores
    assert np.nanmax(np.abs(alone[2])) > 0.05
    np.testing.assert_allclose(moved[:2], alone[:2], atol=1.01 * STRAIN)
    np.testing.assert_allclose(moved[2], alone[2], atol=2e-6)
    assert before["nrmse_all"] == after["nrmse_all"] == 0
    assert np.nanmax(np.abs(after["true_segment_displacement"] - before["true_segment_displacement"])) > 5e-4
    for name in (*STRAIN_SCORES, *STRAINS):
        np.testing.assert_allclose(after[name], before[name], atol=1e-4)
    if view == "mid":  # turned in the image by the whole rocking, at the middle of the beat
        assert after["tracked_rotation"][1] - before["tracked_rotation"][1] == pytest.approx(np.radians(6), abs=1e-4)


def test_what_lies_around_moves_with_the_heart_and_less_towards_the_array_and_the_chest_wall_not(still):
    heart, plane = before_probe(still, config(FRAMES, MOTION), "long")
    nearest = np.linalg.norm(plane.to_image(still.positions(0)), axis=1).min()
    deep, near = (nearest * np.array([[0.3, depth, 0.0], [-0.5, depth, 0.0]]) for depth in (1.2, 0.4))
    place, frame = np.concatenate([deep, near]), 4
    position, start, (turn, shift, _) = plane.to_heart(place), place @ [1, -1j, 0], turn_and_shift(frame)
    share = np.minimum(np.abs(start) / nearest, 1)
    chest_wall = np.full(len(place), TissueLabel.CHEST_WALL, np.uint8)
    for decay, tissue in ((0.0, None), (1e-3, None), (0.0, chest_wall)):  # the heart does not beat
        moved = plane.to_image(SurroundingsMotion(heart, position, decay, tissue)(frame)) @ [1, -1j, 0]
        follows = share if tissue is None else 0
        assert np.abs(moved - start - follows * (turn * start + shift - start)).max() < 1e-12


def test_what_is_outside_the_heart_and_the_column_above_its_lid_stays_so_as_the_probe_rocks(still):
    heart, plane = before_probe(still, config(FRAMES, MOTION), "long")
    before = plane.to_heart(np.random.default_rng(0).uniform([-4e-3, 1e-3, -2e-3], [4e-3, 12e-3, 2e-3], (4000, 3)))
    after = before + heart.rigid.displacement(4, before)
    outside = outside_heart(still, 0, before)
    assert 0.2 < outside.mean() < 0.95 and np.array_equal(outside_heart(heart, 4, after), outside)
    assert np.abs(heart.rigid.undone(4, after) - before).max() < 1e-15


def test_the_column_above_the_lid_tilts_with_a_base_that_tilts(still):
    """As that of a heart that `mechanics.hold: apex` turns without the probe."""
    heart, plane = before_probe(still, config(FRAMES, MOTION), "long")
    before = plane.to_heart(np.random.default_rng(0).uniform([-4e-3, 1e-3, -2e-3], [4e-3, 12e-3, 2e-3], (4000, 3)))
    after, itself = before + heart.rigid.displacement(4, before), replace(heart, rigid=None)
    assert np.array_equal(outside_heart(itself, 4, after), outside_heart(still, 0, before))


def test_no_motion_leaves_the_heart_as_it_is(still):
    assert before_probe(still, config(FRAMES, {}), "mid")[0] is still


def test_probe_rocks_with_every_beat(still):
    twice = replace(still, displacement=np.concatenate([still.displacement] * 2))
    rocked = config(2 * len(still.displacement), {"rocking_deg": 6.0})
    of_two = configure(rocked, loop={"beats": [{}, {}]})
    moving, _ = before_probe(twice, of_two, "mid")
    once, _ = before_probe(still, config(len(still.displacement), {"rocking_deg": 6.0}), "mid")
    np.testing.assert_allclose(moving.displacement, np.concatenate([once.displacement] * 2), rtol=0, atol=1e-15)
    assert np.abs(once.displacement - still.displacement).max() > 1e-4


def test_breaths_are_as_slow_as_the_size_of_an_animal_makes_them(still):
    """4.5 beats a breath (Stahl 1967): after a beat from the end of expiration, sin^2(pi / 4.5) of the excursion."""
    setting = config(2, {"breathing": {"lateral_mm": 1.0}})
    heart, plane = before_probe(replace(still, displacement=still.displacement[:2]), setting, "mid")
    moved = plane.to_image(heart.positions(1)) - plane.to_image(heart.positions(0))
    assert np.allclose(moved, [1e-3 * np.sin(np.pi / 9) ** 2, 0, 0], rtol=1e-9, atol=1e-15)


@pytest.mark.slow
def test_run_has_the_motion_in_stored_truth_and_in_what_is_read_of_it(tmp_path):
    drift = np.array([0.6e-3, -0.3e-3, 0]) * np.arange(finished_repository.FRAMES)[:, None] / finished_repository.FRAMES
    view = View(angle_deg=10.0, motion=ViewMotion(drift=Excursion(lateral_mm=0.6, axial_mm=-0.3)))
    rest = Motion(kind="rigid", rigid=Rigid(lateral_um=0.0, axial_um=0.0))
    setting = finished_repository.configured(seeds=(1,), motion=rest).model_copy(update={"views": {"mid": view}})
    folder = finished_repository.finish(tmp_path / "small", setting, finished_repository.solved)
    repository, case = Repository(folder), expand(setting)[0].id
    clip, tracks = repository.clip(case, "mid"), repository.tracks(case, "mid")
    truth, points = read_truth(repository, case, "mid"), PointTracks(folder, points=20, start=0)[0]["position_m"]
    rounding = 0.51 * length_quantum(setting)
    for frame, moved in enumerate(drift):
        wall = clip["mask"].values[frame]
        of_grid = tracks["true_displacement"].values[frame][tracks["layer"].values > 0]
        for found in (clip["displacement"].values[frame][wall], of_grid):
            np.testing.assert_allclose(found, np.broadcast_to(moved, found.shape), atol=rounding)
        np.testing.assert_allclose(truth.displacement[frame] - moved[:2], 0, atol=rounding)
        np.testing.assert_allclose(points[frame] - points[0] - moved, 0, atol=1e-9)
    # Tissue stays in the plane, so that its perfect tracker has the drift: what is left is the rounding of the truth.
    found, largest = difficulty(repository, case, "mid")[0], np.linalg.norm(drift[truth.es])
    assert found["floor_plane_percent"] < 100 * np.sqrt(2) * rounding / largest
