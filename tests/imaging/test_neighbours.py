"""What lies around the left ventricle and in its cavity: where it is, how loud, and how it moves."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import medium, scene

from echotruth.config import Config
from echotruth.config.loading import override
from echotruth.fem.location import locate
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.anatomy import Anatomy
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.filling import aortic_opening, course, emptied, opening, volumes
from echotruth.imaging.medium.medium import bodies
from echotruth.imaging.medium.surroundings import Surroundings, tissues
from echotruth.units import per_mm3

LEVELS = {
    "chambers_dB": 0.0,
    "lung_dB": 2.0,
    "posterior_dB": 5.0,
    "chest_wall_dB": 3.0,
    "leaflets_dB": 4.0,
    "papillary_muscles_dB": 0.0,
}
REALISM = {"blood": {"level_dB": -25.0}, "surroundings": {"level_dB": -20.0, "density": 0.3}, "neighbours": LEVELS}
CONFIG = Config.model_validate({"phantom": {"density_per_mm3": 1500.0}, "realism": REALISM})
EJECTED = np.array([0.0, 0.0, 0.5, 1.0, 1.0, 0.6, 0.2, 0.1])
"""Course of a cycle: isovolumic, ejection, isovolumic, filling."""


@pytest.fixture(scope="module")
def heart(twisting_heart, coarse_mesh):
    """A ventricle that narrows by a fifth, and whose base descends by 0.5 mm, as it empties."""
    narrows = coarse_mesh.nodes * [-0.2, -0.2, 0] + [0, 0, -0.5e-3]
    displacement = EJECTED[:, None, None] * narrows
    arrays = {"geometry": {"endo": coarse_mesh.endo, "epi": coarse_mesh.epi}}
    return replace(twisting_heart, displacement=displacement, es=3, arrays=arrays)


@pytest.fixture(scope="module", params=["mid", "long_axis"])
def at(request, heart):
    return scene(CONFIG, heart, request.param)


def power_dB(around, box, volume):
    """Echo power in a box of the image (lateral, axial), relative to muscle, and its standard error, dB."""
    lateral, axial, elevation = around.positions(0).T
    inside = box(lateral, axial) & (np.abs(elevation) < 0.15e-3)
    power = around.amplitude[inside] ** 2
    relative = power.sum() / volume / (CONFIG.phantom.density_per_mm3 * per_mm3)
    return 10 * np.log10(relative), 10 / np.log(10) * np.sqrt((power**2).sum()) / power.sum()


def test_the_right_ventricle_is_a_cavity_of_blood_on_the_septal_side(heart):
    around = Surroundings.seed(scene(CONFIG, heart))
    # The septum is at the left; its epicardium is 2.4 mm from the long axis, which is 6.5 mm deep.
    found, error = power_dB(
        around, lambda x, z: (np.abs(x + 3.1e-3) < 0.4e-3) & (np.abs(z - 6.5e-3) < 0.4e-3), 0.8e-3**2 * 0.3e-3
    )
    assert found == pytest.approx(-25, abs=4 * error + 0.3)
    opposite = around.scene.plane.to_heart(np.array([[3.1e-3, 6.5e-3, 0.0]]))
    anatomy = Anatomy(heart)
    assert anatomy.chambers(opposite, anatomy.place(opposite)) == TissueLabel.OTHER


def test_the_nearest_point_of_a_sphere_is_on_the_ray_from_its_centre(half_sphere, hemispherical_heart):
    heart = hemispherical_heart(np.zeros((1, *half_sphere.nodes.shape)))
    angle, height = np.random.default_rng(1).uniform([0, -0.9], [2 * np.pi, -0.1], (500, 2)).T
    ray = np.column_stack([np.cos(angle) * np.sqrt(1 - height**2), np.sin(angle) * np.sqrt(1 - height**2), height])
    for distance in (0.3e-3, 1.5e-3, 4e-3):
        place = Anatomy(heart).place((3e-3 + distance) * ray)
        # The mesh is a sphere within 2 um, and its normals are off by up to 0.015.
        assert np.abs(place.distance - distance).max() < 2e-6
        assert np.linalg.norm(place.outward - ray, axis=1).max() < 0.02


def test_walls_of_chambers_have_their_level(at):
    around = Surroundings.seed(at)
    position = around.positions(0)
    walls = np.isin(around.tissue, (TissueLabel.RIGHT_FREE_WALL, TissueLabel.ATRIAL_WALL))
    near = np.abs(position[:, 2]) < 0.15e-3
    assert (walls & near).sum() > 20
    # Power of a scatterer over that of one of the connective tissue beside it, which has the same density.
    range_ = np.linalg.norm(position[:, :2], axis=1)
    scaled = around.amplitude**2 / range_
    rest = around.tissue == TissueLabel.OTHER
    middle = np.abs(range_ - 6.5e-3) < 1.5e-3
    ratio = scaled[walls & near & middle].mean() / scaled[rest & near & middle & (scaled > 0)].min()
    assert 10 * np.log10(ratio) == pytest.approx(20, abs=4)


def test_what_lies_behind_the_atria_is_brightest_at_their_roof(heart):
    view = scene(CONFIG, heart, "long_axis")
    anatomy, beyond = Anatomy(heart), np.array([0.1, 1.0, 2.0])
    above = anatomy.base + np.outer(anatomy.roof - anatomy.base[2] + (0.08 + beyond) * anatomy.radius, [0, 0, 1.0])
    beside = anatomy.base + np.outer(anatomy.radius * (1.5 + beyond), [-1.0, 0, 0.3])
    level = 10 * np.log10(tissues(CONFIG, heart, view.plane, np.concatenate([above, beside]))[1])
    np.testing.assert_allclose(level[:3], 5 - 20 * beyond, atol=0.6)
    assert (level[3:] < -10).all()


def test_the_medium_has_nothing_of_them_in_the_wall_nor_in_the_cavity(heart, at):
    (whole, seeded), plane = medium(at), at.plane
    around = Surroundings.restored(at, seeded)
    for frame in (0, 3, 6):
        nodes, cavity = heart.positions(frame), Cavity(heart.endo)
        position = around.positions(frame)
        position = plane.to_heart(position[around.present(frame, position)])
        assert len(position) > 1000
        assert (locate(nodes, heart.cells, position).cell < 0).all()
        assert (locate(cavity.positions(nodes), cavity.cells, position).cell < 0).all()
        others = plane.to_heart(whole(frame)[0][len(seeded["wall_cell"]) :])
        assert (locate(nodes, heart.cells, others).cell < 0).all()


def test_neighbours_leave_the_wall_and_its_bytes_as_they_are(heart):
    def made(**realism):
        config = Config.model_validate({"phantom": {"density_per_mm3": 100.0}, "realism": realism})
        return medium(scene(config, heart, "long_axis"))[0](3)

    alone, together, again = made(), made(**REALISM), made(**REALISM)
    for bare, full, same in zip(alone, together, again, strict=True):
        assert full[: len(bare)].tobytes() == bare.tobytes()
        assert full.tobytes() == same.tobytes() and len(full) > len(bare)


def test_last_bits_of_the_motion_change_neither_tissues_nor_random_numbers(heart):
    """Neither by which of two facets is nearest, nor by how many scatterers are blood."""
    config = override(CONFIG, {"realism.decorrelation.time_ms": 10.0})
    bits = 1 + 1e-12 * np.random.default_rng(8).standard_normal((*heart.displacement.shape[:2], 1))
    nearly = replace(heart, displacement=heart.positions(0) * (bits - 1) + bits * heart.displacement)
    around, other = (Surroundings.seed(scene(config, one)) for one in (heart, nearly))
    np.testing.assert_array_equal(around.tissue, other.tissue)
    np.testing.assert_allclose(around(3)[1], other(3)[1], rtol=1e-6)

    some = np.arange(len(around.tissue)) < 5
    bloody = replace(around, tissue=np.where(some, TissueLabel.RIGHT_VENTRICLE, around.tissue))
    np.testing.assert_array_equal(around._amplitudes(3)[~some], bloody._amplitudes(3)[~some])


def test_the_free_wall_moves_inwards_and_the_chest_wall_stays(heart):
    around = Surroundings.seed(scene(CONFIG, heart))
    start, end = around.positions(0), around.positions(3)
    free = (around.tissue == TissueLabel.RIGHT_FREE_WALL) & (np.abs(start[:, 1] - 6.5e-3) < 0.5e-3)
    free &= start[:, 0] < -2.6e-3
    septum, height = 0.2 * 2.33e-3, (3.4 / 7.6) / 0.85
    # Two fifths of its width, which falls from 2.5 mm at the base, besides the motion of the septum.
    expected = septum + 0.4 * 2.5e-3 * (1 - height**3)
    assert free.sum() > 20 and (end - start)[free, 0].mean() == pytest.approx(expected, rel=0.1)
    chest = around.tissue == TissueLabel.CHEST_WALL
    assert chest.sum() > 100 and np.array_equal(start[chest], end[chest])
    assert np.array_equal(start[:, 2], end[:, 2])


def test_the_valve_is_open_while_the_cavity_fills(heart):
    volume = volumes(heart)
    np.testing.assert_allclose(volume / volume[0], (1 - 0.2 * EJECTED) ** 2, rtol=1e-9)
    assert emptied(volume)[3] == 1 and emptied(volume)[0] == 0
    open_ = opening(volume)
    assert (open_[[0, 1, 2, 3]] == 0).all() and (open_[[4, 5]] == 1).all() and 0 < open_[6] < 1
    assert (opening(np.full(8, 30e-9)) == 0).all()
    # It empties by 8/25 in the two frames after the first two.
    aortic = aortic_opening(volume)
    assert (aortic[[1, 2]] == 1).all() and (aortic[[0, 3, 4, 5, 6]] == 0).all()


def test_the_mitral_valve_is_shut_while_the_cavity_empties_though_it_fills_a_little_before():
    open_ = opening(np.array([97.0, 100, 100, 85, 65, 50, 50, 60, 75, 85, 92, 97]))
    assert (open_[:6] == 0).all() and open_[7] == 1


def test_the_mitral_valve_opens_in_each_of_several_beats(heart):
    """The second one ejects half as much, so that the smallest volume of all is in the first."""
    both = np.concatenate([heart.displacement, heart.displacement * 0.5])
    config = Config.model_validate({"loop": {"frames": 16, "beats": [{}, {"stroke": 0.5}]}})
    open_ = course(opening, replace(heart, displacement=both, config=config))
    np.testing.assert_array_equal(open_[:8], opening(volumes(heart)))
    assert (open_[8:12] == 0).all() and (open_[[12, 13]] == 1).all() and 0 < open_[14] < 1


def test_there_are_no_valves_of_chambers_without_chambers():
    config = Config.model_validate({"realism": REALISM | {"neighbours": {"leaflets_dB": 3.0}}})
    assert {body.name for body in bodies(config)} == {"wall", "blood", "surroundings", "leaflets"}


def test_the_mitral_valve_opens_twice_and_is_half_open_between():
    """Filling in two waves, of which the second is half as fast, after an ejection of 12 frames."""
    frame = np.arange(48)
    wave = lambda middle, width: np.exp(-0.5 * ((frame - middle) / width) ** 2)  # noqa: E731
    rate = -1.0 * wave(7, 3) + wave(22, 2.5) + 0.5 * wave(40, 2.5)
    rate *= np.where(frame < 15, 1, -rate[:15].sum() / rate[15:].sum())
    open_ = opening(100 + np.concatenate([[0], np.cumsum(rate)[:-1]]))
    assert (open_[:16] == 0).all() and open_[22] == 1 and open_[40] > 0.8
    assert 0.2 < open_[28:34].min() < 0.5 and (open_[46:] < 0.1).all()
