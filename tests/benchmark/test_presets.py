"""The table of presets of disease: every heart is there and within the bounds of today."""

import pandas as pd
import pytest

from benchmarks.draws import COARSE, COMPONENTS, PRESETS, TABLE, hearts_of_table, preset, preset_row
from echotruth.config.diagnosis import bounds_of
from echotruth.config.pathology import SCARS
from echotruth.mechanics.bounds import LL, violation

KEYS = ["species", "preset", "elements"]


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(TABLE).set_index(KEYS)


def values(row):
    """Values that have bounds and are there."""
    return row.dropna().to_dict()


def test_every_preset_is_there_in_every_species(table):
    assert table.index.is_unique
    assert set(table.index) == set(hearts_of_table(("mouse", "rat", "human")))
    assert {age for age in SCARS if age} < set(PRESETS)


def test_every_heart_is_within_the_bounds_of_its_diagnosis_also_level_by_level(table):
    """A level shortens and thickens within the bounds of the mean, and lengthwise within those of a segment. Every
    segment thickens but those of an infarct."""
    for (species, name, elements), row in table.iterrows():
        bounds = bounds_of(preset(name, species, elements))
        assert violation(values(row), bounds) == "", (species, name, elements)
        for k, component in COMPONENTS.items():
            key = f"segment_{component}_strain" if k == LL else f"{component}_strain"
            low, high = getattr(bounds, f"{key}_min"), getattr(bounds, f"{key}_max")
            found = row[f"level_{component}_strain_min"], row[f"level_{component}_strain_max"]
            assert low <= found[0] <= found[1] <= high, (species, name, elements, component)
        assert (row["segment_radial_strain_min"] > 0) == (name not in ("fresh", "old")), (species, name, elements)


def test_ill_hearts_are_not_within_the_bounds_of_healthy_ones(table):
    for (species, name, _), row in table.iterrows():
        within = violation(values(row), preset("healthy", species).physiology) == ""
        assert within or name != "healthy"
        assert not within or name not in ("dcm", "fresh", "lbbb")


@pytest.mark.slow
def test_table_is_of_the_present_muscle():
    """One heart is solved again."""
    row = pd.read_csv(TABLE).set_index(KEYS).loc[("rat", "healthy", COARSE)].dropna()
    found = preset_row("healthy", "rat", COARSE)
    for key in ("ejection_fraction_min", "gls_min", "circumferential_strain_min", "twist_es_min_deg"):
        assert found[key] == pytest.approx(row[key], rel=0.02)
