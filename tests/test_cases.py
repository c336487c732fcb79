"""Cases: stable ids, independent seeds, and a table with one column per parameter."""

import itertools
import json
from contextlib import suppress

import numpy as np
import pytest

import echotruth as et
from echotruth.cases import case_id, expand
from echotruth.config import Cases, Config
from echotruth.config.loading import ConfigError, override
from echotruth.seeds import generator

SWEEP = {"fibres.endo_deg": [60.0, 84.0], "seed": [1, 2]}


def ids(sweep, config=None):
    return [case.id for case in expand((config or Config()).model_copy(update={"cases": Cases(**sweep)}))]


def test_ids_are_what_they_were_when_first_published():
    assert ids(SWEEP) == ["endo60_b4b41c", "endo60_seed2_1dc8c8", "endo84_1815ba", "endo84_seed2_22f2a4"]
    assert ids({}) == ["heart"]


def test_adding_a_value_renames_no_case():
    assert set(ids(SWEEP)) < set(ids(SWEEP | {"fibres.endo_deg": [48.0, 60.0, 84.0]}))


PRESENT = {
    "fibres.epi_deg": Config().fibres.epi_deg,
    "mechanics.material.fibre": Config().mechanics.material.fibre,
    "geometry.wall_mm": Config().geometry.resolved().wall_mm,
    "probe.sampling_MHz": Config().probe.sampling_MHz,
    "pathology.infarct.segments": Config().pathology.infarct.segments,
}
"""Key -> the value that it has without a sweep: given, of a law, of a preset, computed, or a list."""


@pytest.mark.parametrize(("key", "value"), PRESENT.items())
def test_an_axis_added_at_its_present_value_renames_no_case_and_draws_the_same_numbers(key, value):
    before, after = expand(Config(cases=SWEEP)), expand(Config(cases=SWEEP | {key: [value]}))
    assert [case.id for case in after] == [case.id for case in before]
    for old, new in zip(before, after, strict=True):
        assert np.array_equal(generator(old, "mid", "rf").random(4), generator(new, "mid", "rf").random(4))


def test_a_second_value_of_an_axis_renames_no_case_nor_does_its_removal():
    present = PRESENT["fibres.epi_deg"]
    one, two = SWEEP | {"fibres.epi_deg": [present]}, SWEEP | {"fibres.epi_deg": [-30, present]}
    assert set(ids(SWEEP)) == set(ids(one)) < set(ids(two))
    assert ids({"seed": [1]}) == ids({}) == ["heart"]


FOLLOWED = {
    "law": {"mechanics.material.law": ["guccione", "fung"], "mechanics.material.fibre": [5.0, 9.2, 8.0]},
    "preset": {
        "probe.preset": ["mouse_25MHz", "mouse_40MHz"],
        "probe.pitch_um": [46.0, 38.0],
        "probe.frequency_MHz": [25, 27],
        "probe.sampling_MHz": [100.0, 108.0],
    },
}
"""Keys of which some follow others: the parameters of a law, the lengths of a preset, a rate of sampling."""


@pytest.mark.parametrize("followed", FOLLOWED.values(), ids=FOLLOWED)
def test_one_heart_has_one_id_and_one_id_one_heart_in_all_sweeps_of_a_configuration(followed):
    """Also where the value of a key without a sweep depends on other swept keys."""
    hearts, names = {}, {}
    for number in range(len(followed) + 1):
        for keys in itertools.combinations(followed, number):
            for case in valid_cases({key: followed[key] for key in keys}):
                material, probe = case.config.mechanics.material.model_dump(), case.config.probe.resolved().model_dump()
                heart = json.dumps([material, probe])
                assert hearts.setdefault(case.id, heart) == heart, case.parameters
                assert names.setdefault(heart, case.id) == case.id, case.parameters
    assert len(hearts) > 5


def valid_cases(sweep):
    """Cases of all combinations that are valid."""
    for values in itertools.product(*sweep.values()):
        with suppress(ConfigError):
            yield from expand(Config(cases={key: [value] for key, value in zip(sweep, values, strict=True)}))


def test_cases_have_the_configuration_that_each_has_alone():
    sweep = {
        "mechanics.material.law": ["guccione", "fung"],
        "probe.preset": ["mouse_25MHz", "mouse_40MHz"],
        "seed": [3, 1],
    }
    config = Config(cases=sweep)
    for case in expand(config):
        assert case.config.model_dump() == override(Config(), case.parameters).model_dump()


def test_cases_are_valid_together_even_if_each_value_is_valid_alone():
    sweep = {"rf.focus_mm": [6.5, 9.0], "rf.focal_spacing_mm": [1.0, 2.0]}
    with pytest.raises(ConfigError, match=r"rf.focus_mm = 9.0: must be smaller than 8"):
        expand(Config(cases=sweep))


def test_ids_of_many_axes_are_told_apart_by_more_digits():
    values = {f"mechanics.material.{letter * 12}": 1.5 for letter in "abcdefgh"}
    assert len(case_id(values).rpartition("_")[2]) == 16
    assert len(case_id(values)) <= 57


def test_ids_of_drawn_values_have_four_digits_of_each_and_differ_if_only_others_do():
    values = {"fibres.endo_deg": 66.26123456789, "geometry.wall_mm": 0.9123456789}
    others = values | {"geometry.wall_mm": 0.9123456788}
    assert case_id(values).rpartition("_")[0] == case_id(others).rpartition("_")[0] == "endo66.26_wall0.9123"
    assert case_id(values) != case_id(others)


def test_order_of_axes_and_spelling_of_numbers_do_not_enter_the_id():
    assert case_id({"seed": 1, "fibres.endo_deg": 60}) == case_id({"fibres.endo_deg": 60.0, "seed": 1})


def test_random_numbers_differ_between_views_and_repeat_in_any_order():
    first, second = expand(Config(cases=SWEEP))[:2]
    draws = {
        (case.id, view): generator(case, view, "phantom").random(4)
        for case in (first, second)
        for view in ("mid", "apex")
    }
    assert len({tuple(values) for values in draws.values()}) == 4
    assert np.array_equal(generator(first, "mid", "phantom").random(4), draws[first.id, "mid"])


@pytest.mark.parametrize(
    ("sweep", "sentence"),
    [
        ({"fibres.endo": [60.0]}, "fibres.endo is not a key"),
        ({"fibres": [1]}, "fibres is a section"),
        ({"loop.frames": [20, 40]}, "loop.frames cannot be swept"),
        ({"geometry.transmural_elements": [2, 3]}, "cannot be swept"),
        ({"seed": [1, 1]}, "gives a value twice, 1: list each value once"),
        ({"fibres.endo_deg": [70, 70.0]}, "gives a value twice, 70.0"),
        ({"probe.pitch_um": [None, 46.0]}, "are the same heart, heart: leave one of them out"),
        ({"fibres.endo_deg": [60.0, 99.0]}, "fibres.endo_deg = 99.0: should be less than or equal to 90"),
        ({"loop.file": ["nowhere.csv"]}, "nowhere.csv"),
    ],
)
def test_a_sweep_that_cannot_be_run_is_refused(sweep, sentence):
    with pytest.raises(ConfigError, match=sentence):
        expand(Config(cases=sweep))


def test_a_loop_is_checked_with_the_size_of_its_heart():
    """The end-systolic volume that is not given is in proportion to the cavity."""
    assert len(et.expand(et.configure(geometry={"scale": 0.7}, loop={"edv_uL": 15.0}))) == 1
    large = et.configure(geometry={"scale": 1.4}, loop={"edv_uL": 40.0})
    with pytest.raises(ConfigError, match=r"loop: .*end-systolic volume is 49\.\d+ uL and the end-diastolic 40 uL"):
        et.expand(large)
