"""Cases: stable ids, independent seeds, and a table with one column per parameter."""

import numpy as np
import pytest

from echotruth.cases import case_id, expand, find_case, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError
from echotruth.seeds import generator

SWEEP = {"fibres.endo_deg": [60.0, 84.0], "seed": [1, 2]}


def test_ids_are_what_they_were_when_first_published():
    assert [case.id for case in expand(Config(cases=SWEEP))] == [
        "endo60_seed1_b3a5df",
        "endo60_seed2_1dc8c8",
        "endo84_seed1_c5cdcf",
        "endo84_seed2_22f2a4",
    ]
    assert [case.id for case in expand(Config())] == ["heart"]


def test_adding_a_value_renames_no_case():
    before = {case.id for case in expand(Config(cases=SWEEP))}
    after = {case.id for case in expand(Config(cases=SWEEP | {"fibres.endo_deg": [48.0, 60.0, 84.0]}))}
    assert before < after


def test_order_of_axes_and_spelling_of_numbers_do_not_enter_the_id():
    assert case_id({"seed": 1, "fibres.endo_deg": 60}) == case_id({"fibres.endo_deg": 60.0, "seed": 1})


def test_every_case_has_its_values():
    cases = expand(Config(cases=SWEEP))
    assert [(case.config.fibres.endo_deg, case.config.seed) for case in cases] == [(60, 1), (60, 2), (84, 1), (84, 2)]
    assert find_case(Config(cases=SWEEP), cases[2].id) == cases[2]


def test_random_numbers_differ_between_views_and_repeat_in_any_order():
    first, second = expand(Config(cases=SWEEP))[:2]
    draws = {
        (case.id, view): generator(case, view, "phantom").random(4)
        for case in (first, second)
        for view in ("mid", "apex")
    }
    assert len({tuple(values) for values in draws.values()}) == 4
    assert np.array_equal(generator(first, "mid", "phantom").random(4), draws[first.id, "mid"])


def test_table_has_a_row_a_case_and_a_column_a_parameter():
    frame = table(expand(Config(cases=SWEEP)))
    assert list(frame["fibres.endo_deg"]) == [60, 60, 84, 84]
    assert list(frame["seed"]) == [1, 2, 1, 2]
    assert {"case", "probe.frequency_MHz", "mechanics.material.fibre"} <= set(frame.columns)


@pytest.mark.parametrize(
    ("sweep", "sentence"),
    [
        ({"fibres.endo": [60.0]}, "fibres.endo is not a key"),
        ({"fibres": [1]}, "fibres is a section"),
        ({"loop.frames": [20, 40]}, "loop.frames cannot be swept"),
        ({"geometry.transmural_elements": [2, 3]}, "cannot be swept"),
        ({"seed": [1, 1]}, "gives a value twice"),
        ({"fibres.endo_deg": [60.0, 99.0]}, "fibres.endo_deg = 99.0: should be less than or equal to 90"),
        ({"loop.file": ["nowhere.csv"]}, "nowhere.csv"),
    ],
)
def test_a_sweep_that_cannot_be_run_is_refused(sweep, sentence):
    with pytest.raises(ConfigError, match=sentence):
        expand(Config(cases=sweep))
