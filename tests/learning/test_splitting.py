"""Splits are by heart, and a heart stays where it is."""

import numpy as np
import pandas as pd
import pytest

from echotruth.learning import split

FRACTIONS = {"train": 0.7, "validation": 0.1, "test": 0.2}


def hearts(number):
    """Two cases of each heart."""
    ids = [f"heart{heart}" for heart in range(number)]
    return pd.DataFrame({"heart": ids * 2}, index=[f"{id}_seed{seed}" for seed in (1, 2) for id in ids])


def test_parts_share_no_heart_and_leave_none_out():
    parts = split(hearts(200), FRACTIONS, seed=3)
    found = [set(part["heart"]) for part in parts.values()]
    assert sum(map(len, found)) == len(set.union(*found)) == 200
    assert sum(map(len, parts.values())) == 400


def test_fractions_are_met_within_three_standard_deviations():
    number = 5000
    for name, part in split(hearts(number), FRACTIONS).items():
        expected = FRACTIONS[name]
        assert abs(part["heart"].nunique() / number - expected) < 3 * np.sqrt(expected * (1 - expected) / number)


@pytest.mark.parametrize("change", [lambda table: table.sample(frac=1, random_state=1), lambda table: table.iloc[:200]])
def test_heart_stays_in_its_part_whatever_the_others_are(change):
    table = hearts(300)
    whole, changed = split(table, FRACTIONS, seed=5), split(change(table), FRACTIONS, seed=5)
    for name, part in changed.items():
        assert set(part.index) <= set(whole[name].index)


def test_another_seed_makes_another_split_and_the_same_one_the_same():
    first, again, other = (split(hearts(100), FRACTIONS, seed)["train"].index for seed in (1, 1, 2))
    assert first.equals(again)
    assert not first.equals(other)


def test_equal_values_of_a_column_stay_together():
    table = hearts(100).assign(anatomy=np.tile(np.arange(10), 20))
    parts = split(table, {"train": 0.5, "test": 0.5}, by="anatomy")
    assert not set(parts["train"]["anatomy"]) & set(parts["test"]["anatomy"])


@pytest.mark.parametrize(
    ("table", "options", "words"),
    [
        (hearts(9), {"fractions": {"train": 0.7, "test": 0.2}}, "positive fractions that add up to 1"),
        (hearts(9), {"fractions": {"train": 1.2, "test": -0.2}}, "positive fractions that add up to 1"),
        (hearts(9), {"fractions": {}}, "positive fractions that add up to 1"),
        (hearts(9), {"fractions": {"train": 1}, "by": "mesh"}, "by = 'mesh': is not a column"),
        (hearts(1), {"fractions": {"train": 0.5, "test": 0.5}}, "none of 1 hearts is in"),
    ],
)
def test_split_that_cannot_be_is_refused_in_one_sentence(table, options, words):
    with pytest.raises(ValueError, match=words) as caught:
        split(table, **options)
    assert "\n" not in str(caught.value)
