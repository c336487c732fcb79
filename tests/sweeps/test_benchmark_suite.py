"""The suite of the benchmark: what its plan promises of hearts, split, acoustics and variations."""

from pathlib import Path

import pandas as pd
import pytest

from echotruth.cases import diagnosis, expand
from echotruth.config.loading import load
from echotruth.config.realism import Neighbours
from echotruth.repository.version import motion_hash

ROOT = Path(__file__).parents[2]
SUITES = {
    "benchmark": "echotruth-benchmark-2",
    "benchmark_human": "echotruth-benchmark-2",
    "benchmark_small": "echotruth-benchmark-2-small",
}
GROUPS = {"healthy", "infarct", "late_activation", "hypertrophy", "dilation"}


@pytest.fixture(scope="module", params=SUITES)
def suite(request):
    """Name of a suite and its cases, read as from the folder of a checkout."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return request.param, expand(load(f"config/{request.param}.yaml"))


@pytest.fixture(scope="module")
def table(suite):
    """Labels, hash of the motion and diagnosis of each case."""
    rows = [
        case.labels | {"motion": motion_hash(case.config), "diagnosis": diagnosis(case.config)} for case in suite[1]
    ]
    return pd.DataFrame(rows, index=[case.id for case in suite[1]])


def test_heart_is_one_motion_and_no_motion_is_in_both_halves(table):
    assert (table.groupby("heart")["motion"].nunique() == 1).all()
    assert (table.groupby("motion")["heart"].nunique() == 1).all()
    assert (table.groupby("heart")["split"].nunique() == 1).all() and set(table["split"]) == {"develop", "test"}


def test_group_is_what_the_configuration_makes_of_a_heart(table):
    assert (table["group"] == table["diagnosis"]).all()


def test_every_heart_has_ideal_acoustics_and_realistic_ones_have_what_clips_have(suite, table):
    for case in suite[1]:
        realism = case.config.realism
        levels = realism.blood.level_dB, realism.noise.snr_dB, realism.haze.level_dB, realism.decorrelation.time_ms
        levels += realism.surroundings.level_dB, *realism.borders.model_dump().values()
        # The tables are older than what lies behind the atria.
        levels += tuple(realism.neighbours.model_dump(exclude={"posterior_dB"}).values())
        assert all((level is None) == (case.labels["acoustics"] == "ideal") for level in levels), case.id
        backscatter = realism.backscatter
        depends = [backscatter.anisotropy_dB > 0, backscatter.fibre_strain_dB > 0]
        assert depends == [case.labels["acoustics"] == "realistic"] * 2, case.id
    plain = table[table["variation"] == "none"]
    assert not plain.duplicated(["heart", "acoustics"]).any()
    assert set(plain[plain["acoustics"] == "ideal"]["heart"]) == set(table["heart"])


def test_variation_is_beside_the_same_heart_without_it_and_changes_what_it_is_named_after(suite, table):
    name, cases = suite
    if name != "benchmark":
        assert set(table["variation"]) == {"none"}
        return
    changed = {
        "low_rate": lambda config: config.tracking.frame_step == 2,
        "oblique": lambda config: all(view.tilt_deg for view in config.views.values()),
        "array": lambda config: config.probe.preset == "mouse_30MHz" and config.phantom.density_per_mm3 == 5300,
        "through_plane": lambda config: config.views["mid"].position == 0.2,
    }
    for case in cases:
        assert {variation for variation, holds in changed.items() if holds(case.config)} == (
            {case.labels["variation"]} - {"none"}
        ), case.id
    varied = table[table["variation"] != "none"]
    assert varied.groupby(["variation", "split"]).size().unstack().to_numpy().min() >= 1


def test_hearts_of_the_small_suite_are_those_of_the_benchmark(suite, monkeypatch):
    name, cases = suite
    if name != "benchmark_small":
        return
    monkeypatch.chdir(ROOT)
    whole = {case.id: case for case in expand(load("config/benchmark.yaml"))}
    for case in cases:
        same = whole[case.id]
        assert case.parameters == same.parameters and case.config.seed == same.config.seed
        assert case.labels | {"suite": ""} == same.labels | {"suite": ""}


def test_whole_suite_has_every_group_in_both_halves_and_half_of_its_hearts_in_each(suite, table):
    if suite[0] != "benchmark":
        return
    hearts = table.drop_duplicates("heart")
    assert dict(hearts["split"].value_counts()) == {"develop": 12, "test": 12}
    assert all(set(half["group"]) == GROUPS for _, half in hearts.groupby("split"))
    laws = pd.Series({case.labels["heart"]: case.config.mechanics.material.law for case in suite[1]})
    of_split = laws.groupby(hearts.set_index("heart")["split"]).agg(set)
    assert of_split["develop"] == of_split["test"] == {"fung", "guccione", "holzapfel_ogden"}


def differences(one, other, key=""):
    """Dotted keys in which two configurations differ, but for their name, trackers and table."""
    for name in (name for name in one if f"{key}{name}" not in ("name", "tracking", "cases")):
        if isinstance(one[name], dict) and isinstance(other[name], dict):
            yield from differences(one[name], other[name], f"{key}{name}.")
        elif one[name] != other[name]:
            yield f"{key}{name}"


def test_ablation_has_hearts_of_develop_with_one_thing_taken_from_their_acoustics(monkeypatch):
    monkeypatch.chdir(ROOT)
    whole = {case.id: case for case in expand(load("config/benchmark.yaml"))}
    neighbours = {f"realism.neighbours.{key}" for key in Neighbours.model_fields if key != "posterior_dB"}
    taken = {
        "five_foci": {"rf.focal_zones"},
        "no_rib": {"realism.shadow.side"},
        "no_decorrelation": {"realism.decorrelation.time_ms"},
        "no_surroundings": {"realism.blood.level_dB", "realism.surroundings.level_dB", *neighbours},
        "no_noise": {"realism.noise.snr_dB", "realism.haze.level_dB"},
        "no_through_plane": {"phantom.in_plane_only"},
    }
    found = set()
    for case in expand(load("config/ablation.yaml")):
        heart, acoustics, variation = (case.labels[name] for name in ("heart", "acoustics", "variation"))
        same = whole[f"{heart}_{acoustics}"]
        assert same.labels["split"] == "develop" and case.id == f"{same.id}_{variation}"
        assert set(differences(case.config.model_dump(), same.config.model_dump())) == taken[variation]
        found.add(variation)
    assert found == set(taken)
