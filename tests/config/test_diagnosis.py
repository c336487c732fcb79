"""Findings on a configured heart, and the diagnosis and the bounds that follow from them."""

from functools import cache

import pytest

from echotruth.cases import expand
from echotruth.config import Config, Physiology
from echotruth.config.building import configure
from echotruth.config.diagnosis import BOUNDS_OF, bounds_of, diagnosis, findings
from echotruth.config.loading import load, override
from echotruth.config.shipped import ROOT

CIRCULATION = {"loop.kind": "circulation"}
INFARCT = {"pathology.infarct.segments": [7, 8]}
WEAK = CIRCULATION | {"loop.circulation.contractility": 0.6}
LATE = CIRCULATION | {"pathology.activation.preset": "lbbb"}
OLD = {"pathology.infarct.radius_mm": 1.0, "pathology.infarct.age": "old"}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "healthy"),
        (CIRCULATION | {"loop.circulation.beats_max": 5, "loop.circulation.baroreflex": False}, "healthy"),
        (INFARCT, "infarct"),
        (OLD, "infarct"),
        ({"pathology.infarct.age": "old"}, "healthy"),
        (LATE, "late_activation"),
        (CIRCULATION | {"pathology.activation.sites": [{}]}, "late_activation"),
        (CIRCULATION | {"pathology.activation.preset": "normal"}, "healthy"),
        (WEAK, "weak"),
        (CIRCULATION | {"loop.circulation.contractility": 0.9, "loop.circulation.resistance": 1.1}, "healthy"),
        (CIRCULATION | {"loop.circulation.contractility": 1.6}, "hyperdynamic"),
        (WEAK | {"loop.circulation.resistance": 1.2}, "weak+abnormal_load"),
        (CIRCULATION | {"loop.circulation.compliance": 0.8}, "abnormal_load"),
        (CIRCULATION | {"loop.circulation.retained_volume_stroke_volumes": -1.0}, "abnormal_load"),
        ({"geometry.hypertrophy": 1.2} | INFARCT, "infarct+hypertrophy"),
        ({"geometry.dilation": 1.2}, "dilation"),
        ({"geometry.dilation": 0.9}, "remodelling"),
        ({"geometry.scale": 1.1, "geometry.elongation": 0.9, "geometry.wall_mm": 1.2}, "healthy"),
        ({"fibres.disarray_deg": 10.0}, "disarray"),
        ({"mechanics.regional.contractility": {7: 0.1}}, "hypokinesia"),
        ({"mechanics.regional.contractility": {7: 0.8}, "mechanics.regional.stiffness": {7: 2.0}}, "healthy"),
        ({"mechanics.regional.stiffness": {7: 20.0}}, "fibrosis"),
        ({"pathology.preset": "dcm"}, "dcm"),
        ({"pathology.preset": "hypertension"}, "hypertension"),
        ({"pathology.preset": "hypertension"} | OLD, "infarct+hypertension"),
        ({"pathology.preset": "hypertension", "loop.circulation.contractility": 0.6}, "hypertension+weak"),
    ],
)
def test_diagnosis_names_what_is_found(keys, words):
    config = configure(**keys)
    assert diagnosis(config) == words
    assert (words == "healthy") == (bounds_of(config) == config.physiology)
    if not keys.get("pathology.preset"):
        assert diagnosis(override(Config(), keys)) == words  # as a case of a sweep has it


def test_shape_from_a_file_is_unknown_unless_something_is_found():
    read = override(Config(), {"geometry.file": "a.vtu"})
    assert diagnosis(read) == "unknown" and bounds_of(read).edp_max_mmHg == BOUNDS_OF["unknown"]["edp_max_mmHg"]
    assert diagnosis(override(read, INFARCT)) == "infarct"


@pytest.mark.parametrize(
    ("keys", "key", "limit"),
    [
        (OLD | LATE, "ejection_fraction_max", 0.75),  # of the infarct
        (OLD | LATE, "edv_of_healthy_min", 0.9),  # of late activation
        ({"geometry.hypertrophy": 1.2} | WEAK, "edv_of_healthy_min", 0.8),
        ({"geometry.hypertrophy": 1.2} | WEAK, "ejection_fraction_max", 0.9),  # as healthy in hypertrophy
        ({"geometry.hypertrophy": 1.2} | WEAK, "segment_circumferential_strain_max", 0.0),  # -0.04 in hypertrophy
        (WEAK | {"fibres.disarray_deg": 10.0}, "fibre_strain_spread_max", None),
    ],
)
def test_loosest_limit_of_several_findings_holds(keys, key, limit):
    assert getattr(bounds_of(configure(**keys)), key) == limit


@cache
def hearts():
    """The hearts of all shipped configurations whose meshes come with the package, and of each species and preset."""
    files = [path for path in sorted(ROOT.glob("config/*.yaml")) if path.stem not in ("fimh25", "rodero")]
    found = [case.config for path in files for case in expand(load(path), str(path))]
    for species in ("mouse", "rat", "human"):
        draw = {"cases.draw": {"preset": "hearts", "number": 20}} | CIRCULATION
        found += [case.config for case in expand(configure(geometry={"preset": species}, **draw))]
        for disease in ({}, OLD, LATE, {"pathology.preset": "dcm"}, {"pathology.preset": "hypertension"}):
            found.append(configure(geometry={"preset": species}, **disease))
    return found


def test_hearts_that_are_called_healthy_are_judged_as_healthy_and_no_others():
    assert len(hearts()) > 400
    for config in hearts():
        assert (diagnosis(config) == "healthy") == (bounds_of(config) == config.physiology), findings(config)


def test_heart_is_allowed_what_each_of_its_findings_allows():
    for config in hearts():
        bounds = bounds_of(config)
        for key, limit in (limits for name in findings(config) for limits in BOUNDS_OF[name].items()):
            own = getattr(bounds, key)
            assert own is None or (own >= limit if "_max" in key else own <= limit), (findings(config), key)


def test_words_are_those_of_what_is_changed():
    for config in hearts():
        words, is_named = diagnosis(config).split("+"), config.pathology.preset is not None
        assert ("infarct" in words) == config.pathology.infarct.is_there
        assert is_named or ("weak" in words) == (config.loop.circulation.contractility < 0.9)
        assert is_named or ("hypertrophy" in words) == (config.geometry.hypertrophy > 1)


def test_key_that_is_given_holds_whatever_is_found():
    config = configure(**INFARCT, **{"physiology.tei_index_max": 0.9, "physiology.gls_min": None})
    bounds = bounds_of(config)
    assert (bounds.tei_index_max, bounds.gls_min) == (0.9, None)
    assert bounds.twist_es_min_deg == BOUNDS_OF["infarct"]["twist_es_min_deg"]


@pytest.mark.parametrize("species", ["mouse", "rat", "human"])
def test_bounds_of_a_species_give_way_to_those_of_a_disease(species):
    healthy = configure(geometry={"preset": species})
    assert bounds_of(healthy) == healthy.physiology
    weak = bounds_of(configure(healthy, **WEAK))
    assert weak.gls_max == BOUNDS_OF["weak"]["gls_max"] and weak.wall_mass_max_g == healthy.physiology.wall_mass_max_g


@pytest.mark.parametrize("name", BOUNDS_OF)
@pytest.mark.parametrize("species", ["mouse", "rat", "human"])
def test_bounds_of_a_finding_are_in_order_and_no_wider_than_those_of_the_living(name, species):
    found = configure(geometry={"preset": species}).physiology.model_copy(update=BOUNDS_OF[name])
    assert Physiology(**found.model_dump()) == found
    for key, limit in BOUNDS_OF["unknown"].items():
        if limit is not None:
            own = getattr(found, key)
            assert own is not None and (own <= limit if "_max" in key else own >= limit), key
