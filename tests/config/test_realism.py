"""Section `realism`: off by default, invalid combinations are refused, and power does not depend on density."""

import numpy as np
import pytest

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.building import configure
from echotruth.config.loading import ConfigError, load
from echotruth.config.realism import Realism
from echotruth.section import value_of


@pytest.mark.parametrize("tissue", ["blood", "surroundings"])
def test_what_fills_a_space_is_refused_beside_a_phantom_in_a_plane(tissue, tmp_path):
    file = tmp_path / "flat.yaml"
    file.write_text(f"phantom: {{in_plane_only: true}}\nrealism: {{{tissue}: {{level_dB: -20}}}}\n")
    with pytest.raises(ConfigError, match=f"realism.{tissue}.level_dB.*must be null if phantom.in_plane_only"):
        load(file)


@pytest.mark.parametrize("name", ["chambers_dB", "lung_dB", "chest_wall_dB"])
def test_tissues_of_the_surroundings_are_refused_without_them(name, tmp_path):
    file = tmp_path / "alone.yaml"
    file.write_text(f"realism: {{neighbours: {{{name}: 0}}}}\n")
    with pytest.raises(ConfigError, match=f"realism.neighbours.{name}.*needs realism.surroundings.level_dB"):
        load(file)


def test_atria_that_would_be_at_rest_beside_moving_valves_are_refused(tmp_path):
    file = tmp_path / "rest.yaml"
    file.write_text("realism: {preset: mouse, surroundings: {motion_decay_mm: 0}}\n")
    with pytest.raises(ConfigError, match=r"realism.surroundings.motion_decay_mm = 0.*must exceed 0 where there are"):
        load(file)
    file.write_text("realism: {preset: mouse, surroundings: {motion_decay_mm: 0}, neighbours: {chambers_dB: null}}\n")
    assert load(file).realism.surroundings.motion_decay_mm == 0


@pytest.mark.parametrize("other", ["phantom: {in_plane_only: true}", "geometry: {shape: tube}\nmotion: {kind: rigid}"])
def test_bodies_in_the_cavity_are_refused_where_there_is_none(other, tmp_path):
    file = tmp_path / "open.yaml"
    file.write_text(f"{other}\nrealism: {{neighbours: {{leaflets_dB: 0}}}}\n")
    with pytest.raises(ConfigError, match=r"realism.neighbours.leaflets_dB.*must be null"):
        load(file)


@pytest.mark.parametrize("density", [0.1, 1.0])
def test_the_power_in_a_volume_does_not_depend_on_the_density(density):
    blood = Config.model_validate({"realism": {"blood": {"level_dB": -20.0, "density": density}}}).realism.blood
    assert blood.amplitude_std**2 * density == pytest.approx(0.01)


@pytest.mark.parametrize("name", ["realistic", "realistic_human"])
def test_realistic_configuration_is_ideal_without_one_key(name):
    realistic = configure(name)
    off = configure(realistic, realism={"preset": "none"})
    species = realistic.realism.preset
    assert off == configure(geometry={"preset": species}, views=off.views, name=name) and off.realism == Realism()
    assert realistic.probe.bandwidth < off.probe.bandwidth
    # A longer pulse, and as many scatterers in it and across the beam.
    density, frequency = (
        value_of(realistic, key) / value_of(off, key) for key in ("phantom.density_per_mm3", "probe.frequency_MHz")
    )
    assert density == pytest.approx(realistic.probe.bandwidth / off.probe.bandwidth * frequency**3, rel=1e-3)


def test_preset_of_realism_fills_in_all_keys_but_those_that_are_given():
    given = {"preset": "mouse", "blood": {"level_dB": None}, "haze": {"level_dB": -30.0}}
    found, preset = Realism.model_validate(given), Realism(preset="mouse")
    assert found.blood.level_dB is None and found.blood.density == preset.blood.density
    assert found.haze.level_dB == -30 and found.neighbours == preset.neighbours
    # A configuration that is written out keeps its values, and another preset brings its own.
    config = Config(realism=found)
    assert Config.model_validate(config.model_dump()) == config
    human = configure(config, realism={"preset": "human"}).realism
    assert human.surroundings == Realism(preset="human").surroundings
    assert human.blood.level_dB is None and human.haze.level_dB == -30


def test_cases_change_the_preset_of_realism():
    keys = {"realism.preset": ["none", "mouse"], "realism.noise.snr_dB": [None, 20.0]}
    realisms = [case.config.realism for case in expand(configure(cases=keys))]
    assert [each.blood.level_dB for each in realisms] == [None] * 2 + [Realism(preset="mouse").blood.level_dB] * 2
    assert [each.noise.snr_dB for each in realisms] == [None, 20.0] * 2


@pytest.mark.parametrize("changes", [{}, {"rf": {"sector_deg": 90.0}}, {"bmode": {"field_of_view_mm": 230.0}}])
def test_arc_of_a_realistic_sector_just_fits_into_the_image(changes):
    config = configure("realistic_human", **changes)
    width = 2 * config.depth_mm * np.sin(np.radians(config.rf.sector_deg / 2))
    assert width == pytest.approx(config.bmode.field_of_view_mm, rel=1e-4) and width <= config.bmode.field_of_view_mm


def test_depth_is_the_side_of_the_image_unless_it_is_given(tmp_path):
    assert configure().depth_mm == configure().bmode.field_of_view_mm
    assert configure(rf={"depth_mm": 10.0}).depth_mm == 10
    file = tmp_path / "deep.yaml"
    file.write_text("rf: {depth_mm: 13}\n")
    with pytest.raises(ConfigError, match=r"rf.depth_mm = 13.*must not exceed bmode.field_of_view_mm = 12"):
        load(file)
    file.write_text("rf: {depth_mm: 8}\n")
    with pytest.raises(ConfigError, match=r"rf.focus_mm = 6.5.*must be smaller than 6, .* within rf.depth_mm"):
        load(file)


def test_smoothing_of_realistic_images_follows_their_size():
    small, large = (configure("realistic", bmode={"size_px": size}).bmode for size in (256, 512))
    assert large.smoothing == small.smoothing > 0
    assert large.smoothing_width_px == pytest.approx(2 * small.smoothing_width_px, rel=0.01)
    assert configure("realistic", bmode={"smoothing_width_px": 5.0}).bmode.smoothing_width_px == 5


def test_acoustics_are_drawn_by_one_key_and_given_ranges_take_precedence():
    given = {"bmode.gain_dB": {"uniform": [1, 2]}, "seed": {"integers": [1, 1000]}}
    cases = {"draw": {"number": 4, "preset": "acoustics", "keys": given}}
    config = configure("realistic", cases=cases)
    draws = [case.config for case in expand(config)]
    assert len({each.realism.blood.level_dB for each in draws}) == len({each.seed for each in draws}) == 4
    assert all(1 <= each.bmode.gain_dB <= 2 for each in draws)
    # What is stored with a repository draws the same again.
    again = configure(config.model_dump())
    assert [case.id for case in expand(again)] == [case.id for case in expand(config)]


def test_hearts_and_their_looks_are_drawn_at_once():
    cases = {"draw": {"number": 4, "preset": ["hearts", "acoustics"], "keys": {"seed": {"integers": [1, 1000]}}}}
    draws = [case.config for case in expand(configure("realistic", loop={"kind": "circulation"}, cases=cases))]
    for values in ([each.geometry.scale for each in draws], [each.bmode.gain_dB for each in draws]):
        assert len(set(values)) == 4


@pytest.mark.parametrize("species", ["mouse", "human"])
def test_acoustics_draw_the_pose_of_each_view(species):
    views = {"preset": "echo", "mine": {"position": 0.4, "offset": {"lateral_mm": 0.1}}}
    cases = {
        "draw": {"number": 16, "preset": "acoustics", "keys": {"views.mid.motion.rocking_deg": {"uniform": [3, 4]}}}
    }
    config = configure(geometry={"preset": species}, realism={"preset": species}, views=views, cases=cases)
    hearts = [case.config for case in expand(config)]
    assert len({view.angle_deg for heart in hearts for view in heart.views.values()}) == 16 * 7
    focus = config.rf.focus_mm
    for name, view in config.views.items():
        seen = [heart.views[name] for heart in hearts]
        bounds = {
            "angle": ([each.angle_deg - view.angle_deg for each in seen], 10),
            "lateral": ([each.offset.lateral_mm - view.offset.lateral_mm for each in seen], 0.08 * focus),
            "drift": ([each.motion.drift.elevation_mm for each in seen], 0.015 * focus),
        }
        for values, bound in bounds.values():
            assert 0.8 * bound < max(map(abs, values)) <= bound + 1e-6 and min(values) < 0 < max(values)
        breaths = [each.motion.breathing.axial_mm for each in seen]
        assert 0 <= min(breaths) < max(breaths) <= 0.03 * focus + 1e-6
    assert all(3 <= heart.views["mid"].motion.rocking_deg <= 4 for heart in hearts)
    # What is stored with a repository draws the same again.
    assert [case.id for case in expand(configure(config.model_dump()))] == [case.id for case in expand(config)]
