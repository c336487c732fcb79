"""Section `realism`: off by default, invalid combinations are refused, and power does not depend on density."""

import pytest

from echotruth.config import Config
from echotruth.config.loading import ConfigError, load


def test_nothing_is_on_by_default():
    realism = Config().realism
    assert realism.blood.level_dB is realism.surroundings.level_dB is realism.haze.level_dB is None
    assert not any(level is not None for level in realism.neighbours.model_dump().values())
    assert realism.decorrelation.time_ms is realism.noise.snr_dB is None
    assert realism.shadow.side == "none"


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


def test_the_realistic_preset_is_the_demo_with_all_of_it_on():
    preset = load("config/realistic.yaml")
    demo = load("config/demo.yaml")
    off = Config().realism
    assert all(getattr(preset.realism, name) != getattr(off, name) for name in type(off).model_fields)
    assert preset.rf == demo.rf.model_copy(update={"focal_zones": 1})
    same = {"realism": off, "name": demo.name, "rf": demo.rf, "loop": demo.loop, "tracking": demo.tracking}
    assert preset.model_copy(update=same) == demo
