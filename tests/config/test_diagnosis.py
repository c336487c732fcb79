"""Which diagnosis a configuration has, and which bounds go with it."""

import pytest

from echotruth.config import Config, Physiology
from echotruth.config.building import configure
from echotruth.config.diagnosis import BOUNDS_OF, bounds_of, diagnosis
from echotruth.config.loading import override

CIRCULATION = {"loop.kind": "circulation"}
INFARCT = {"pathology.infarct.segments": [7, 8]}


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({}, "healthy"),
        (CIRCULATION | {"loop.circulation.beats_max": 5, "loop.circulation.baroreflex": False}, "healthy"),
        (INFARCT, "infarct"),
        ({"pathology.infarct.radius_mm": 1.0, "pathology.infarct.age": "old"}, "old"),
        (CIRCULATION | {"pathology.activation.preset": "lbbb"}, "late"),
        (CIRCULATION | {"pathology.activation.preset": "normal"}, "healthy"),
        (CIRCULATION | {"loop.circulation.contractility": 0.6}, "weak"),
        (CIRCULATION | {"loop.circulation.contractility": 1.6}, "unknown"),
        (CIRCULATION | {"loop.circulation.contractility": 0.6, "loop.circulation.resistance": 1.2}, "unknown"),
        ({"geometry.hypertrophy": 1.3}, "unknown"),
        ({"pathology.preset": "dcm"}, "dcm"),
        ({"pathology.preset": "hypertension"}, "hypertension"),
        ({"pathology.preset": "hypertension"} | INFARCT, "unknown"),
    ],
)
def test_diagnosis_is_that_of_the_one_thing_that_is_wrong(keys, expected):
    assert diagnosis(configure(**keys)) == expected
    if not keys.get("pathology.preset"):
        assert diagnosis(override(Config(), keys)) == expected  # as a case of a sweep has it


def test_key_that_is_given_holds_for_every_diagnosis():
    config = configure(**INFARCT, **{"physiology.tei_index_max": 0.9, "physiology.gls_min": None})
    bounds = bounds_of(config)
    assert (bounds.tei_index_max, bounds.gls_min) == (0.9, None)
    assert bounds.twist_es_min_deg == BOUNDS_OF["infarct"]["twist_es_min_deg"]


@pytest.mark.parametrize("species", ["mouse", "rat", "human"])
def test_bounds_of_a_species_give_way_to_those_of_a_disease(species):
    healthy = configure(geometry={"preset": species})
    assert bounds_of(healthy) == healthy.physiology
    weak = bounds_of(configure(healthy, **CIRCULATION, **{"loop.circulation.contractility": 0.6}))
    assert weak.gls_max == BOUNDS_OF["weak"]["gls_max"] and weak.wall_mass_max_g == healthy.physiology.wall_mass_max_g


@pytest.mark.parametrize("name", BOUNDS_OF)
@pytest.mark.parametrize("species", ["mouse", "rat", "human"])
def test_bounds_of_a_diagnosis_are_in_order_and_no_wider_than_those_of_the_living(name, species):
    found = configure(geometry={"preset": species}).physiology.model_copy(update=BOUNDS_OF[name])
    assert Physiology(**found.model_dump()) == found
    for key, limit in BOUNDS_OF["unknown"].items():
        if limit is not None:
            own = getattr(found, key)
            assert own is not None and (own <= limit if "_max" in key else own >= limit), key
