"""Conditions leave out cases, and are nothing of Python but comparisons."""

import time

import pytest

from echotruth.cases import expand
from echotruth.cases.conditions import Condition
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate

VALUES = {"a.x": 3, "a.y": 4.5, "b.name": "mouse", "b.on": True, "b.none": None, "b.list": [7, 8]}


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("a.x < a.y", True),
        ("a.x + 2 * a.y >= 12", True),
        ("a.x ** 2 + a.y ** 2 > 100", False),
        ("1 < a.x < a.y < 4", False),
        ("-a.x < 0 and not a.y == 4", True),
        ("a.x % 2 == 1 or a.y / 0 > 1", True),
        ("b.name == 'mouse'", True),
        ("b.name in ['rat', 'human']", False),
        ("8 in b.list and 9 not in b.list", True),
        ("b.on and b.none is null and a.y is 4.5 and a.y is not 5", True),
        ("b.on == true and b.on", True),
        ("b.none == None", True),
        ("b.list == [7, 8]", True),
        (" (a.x\n < a.y) ", True),
    ],
)
def test_condition_has_the_truth_that_it_has_in_arithmetic(text, holds):
    assert Condition(text, "my.yaml").holds(VALUES.__getitem__, "row 1") is holds


REFUSED = (
    *("__import__('os').system('true')", "abs(a.x) < 3", "(lambda: a.x)() < 3", "[x for x in a.x]", "a.x[0] < 1"),
    *("a.x if b.on else a.y", "f'{a.x}' == '3'", "{1: 2} == a.x", "(y := 3) < a.x", "~a.x < 3", "a.x // 2 == 1"),
    *("a.x @ a.y > 1", "'a'.upper() == 'A'", "'a'.b == 1", "(a.x + 1).real > 3", "a.x < b'3'", "a.x < 3j", "a.x < ..."),
    *("*a.x", "a.x =", "", "a.x < 1; b", "import os", "x" * 1001, "(" * 900, "-" * 900 + "1"),
)


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: text[:30])
def test_anything_else_of_python_is_refused_unseen(text):
    def lookup(key):
        raise AssertionError("nothing is looked up")

    with pytest.raises(ConfigError):
        Condition(text, "my.yaml").holds(lookup, "row 1")


@pytest.mark.parametrize(
    "text",
    [
        *("9 ** 9 ** 9 ** 9 > a.x", "2 ** (2 ** 40) > a.x", "10.0 ** 400 > a.x", "a.x / 0 > 1", "a.x % 0 > 1"),
        *("'ab' * 10 ** 9 == b.name", "b.list * 10 ** 9 == b.list", "(-8) ** 0.5 > a.x", "b.name < 3", "b.none > 1"),
        *("a.x", "b.on and a.x", "a.x in 7", "1e400 > a.x * 1e300 * 1e300 ** 2"),
    ],
)
def test_what_has_no_truth_is_refused_at_once(text):
    start = time.process_time()
    with pytest.raises(ConfigError):
        Condition(text, "my.yaml").holds(VALUES.__getitem__, "row 1")
    assert time.process_time() - start < 1


def ids(cases):
    return [case.parameters for case in expand(validate({"cases": cases}, "my.yaml"), "my.yaml")]


def test_cases_that_meet_all_conditions_are_left():
    cases = {"seed": [1, 2, 3], "fibres.endo_deg": [60, 70], "where": ["seed < 3", "fibres.endo_deg > 60 * seed"]}
    assert ids(cases) == [{"seed": 1, "fibres.endo_deg": 70}]
    assert len(ids(cases | {"where": "seed < 3 or fibres.endo_deg == 70"})) == 5


def test_condition_leaves_out_what_is_not_valid():
    volumes = {"loop.edv_uL": [40, 50], "loop.esv_uL": [20, 45]}
    with pytest.raises(ConfigError, match="must be smaller than edv_uL"):
        ids(volumes)
    assert len(ids(volumes | {"where": "loop.esv_uL < loop.edv_uL"})) == 3


def test_values_follow_the_preset_of_the_case():
    kept = ids({"geometry.preset": ["mouse", "rat", "human"], "where": "geometry.wall_mm < 5"})
    assert kept == [{"geometry.preset": "mouse"}, {"geometry.preset": "rat"}]


def test_parameter_that_the_law_of_a_case_does_not_have_is_null():
    laws = {"mechanics.material.law": ["guccione", "neo_hooke"]}
    assert ids(laws | {"where": "mechanics.material.fibre != null"}) == [{"mechanics.material.law": "guccione"}]
    with pytest.raises(ConfigError, match=r"needs numbers to compute or compare: mechanics.material.fibre = null"):
        ids(laws | {"where": "mechanics.material.fibre > 1"})


def test_ids_do_not_depend_on_conditions():
    cases = {"seed": [1, 2, 3]}
    everyone = [case.id for case in expand(Config(cases=cases))]
    assert [case.id for case in expand(Config(cases=cases | {"where": ["seed != 2"]}))] == everyone[::2]


def test_labels_of_the_table_can_be_asked_for():
    table = "case,seed,label.group,label.age\na,1,sham,12\nb,2,MI,14\nd,3,MI,\n"
    assert ids({"table": table, "where": "label.group == 'MI'"}) == [{"seed": 2}, {"seed": 3}]
    assert ids({"table": table, "where": "label.age != null and label.age > 12"}) == [{"seed": 2}]


@pytest.mark.parametrize(
    ("where", "sentence"),
    [
        ("sed > 1", "cases.where = 'sed > 1': sed is not a key: did you mean seed?"),
        ("seed.real > 1", "seed.real is not a key"),
        ("fibres == 1", "fibres is a section: name one of its keys"),
        ("label.group == 1", "label.group is not a column of the table"),
        ("seed > 5", "cases.where leaves out all 2 cases: widen a condition"),
        ("loop.edv_uL > 5", "in {'seed': 1}: needs numbers to compute or compare: loop.edv_uL = null"),
        ("seed", "in {'seed': 1}: is 1 and neither true nor false"),
        ([3], "cases.where.0 = 3: must be text: put it in quotes"),
        (["seed > 0"] * 101, "should have at most 100 items"),
    ],
)
def test_condition_that_cannot_be_asked_is_refused_in_a_sentence(where, sentence):
    with pytest.raises(ConfigError) as error:
        ids({"seed": [1, 2], "where": where})
    assert str(error.value).startswith("my.yaml: cases") and sentence in str(error.value)
    assert "\n" not in str(error.value)
