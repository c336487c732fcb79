"""Section `pathology`: invalid values are refused; valid ones survive writing and reading and can be swept."""

import json

import pytest
import yaml

from echotruth.cases import expand, table
from echotruth.config import Config
from echotruth.config.building import configure
from echotruth.config.loading import ConfigError, validate
from echotruth.units import ms

INFARCT, ORDER = "pathology.infarct", "pathology.activation"
BAD = [
    (INFARCT, {"segments": [7, 18]}, "segments.1 = 18: should be less than or equal to 17"),
    (INFARCT, {"segments": []}, "segments = []: should have at least 1 item"),
    (INFARCT, {"segments": [7], "radius_mm": 1}, "radius_mm = 1.0: give either segments or radius_mm"),
    (INFARCT, {"segment": [1]}, "segment is not a key: did you mean pathology.infarct.segments?"),
    (ORDER, {"sites": []}, "sites = []: should have at least 1 item"),
    (ORDER, {"sites": [{"time_ms": -3}]}, "sites.0.time_ms = -3: should be greater than or equal to 0"),
    (ORDER, {"preset": "rbbb"}, "preset = 'rbbb': should be 'normal', 'lbbb' or 'rv_pacing'"),
    (ORDER, {"preset": "lbbb"}, "preset = 'lbbb': needs loop.kind = circulation"),
]


def test_preset_of_a_disease_sets_growth_and_load_but_not_what_is_given():
    thick = validate({"pathology": {"preset": "hypertension"}}, "a.yaml")
    assert thick.geometry.hypertrophy == 1.3
    assert (thick.loop.kind, thick.loop.circulation.baroreflex) == ("circulation", False)
    wide = {name: Config(geometry={"preset": name}, pathology={"preset": "dcm"}) for name in ("mouse", "human")}
    assert wide["mouse"].loop.circulation.contractility < wide["human"].loop.circulation.contractility < 1
    given = {"pathology": {"preset": "dcm"}, "geometry": {"dilation": 1.3}, "loop": {"circulation": {"resistance": 2}}}
    dilated = validate(given, "a.yaml")
    assert (dilated.geometry.dilation, dilated.loop.circulation.resistance) == (1.3, 2)
    assert dilated.loop.circulation.retained_volume_stroke_volumes == 5
    # What is stored is read back as it is.
    assert validate(json.loads(dilated.model_dump_json()), "a.yaml") == dilated


def test_disease_is_changed_with_all_that_follows_from_it_and_nothing_that_was_given():
    given = configure(pathology={"preset": "hypertension"}, geometry={"hypertrophy": 1.0})
    assert configure(given, **{"loop.frames": 24}).geometry.hypertrophy == 1.0
    wide = configure(pathology={"preset": "dcm"})
    for changed in (configure(wide, **{"pathology.preset": None}), Config()):
        assert (changed.geometry.dilation, changed.loop) == (1.0, Config().loop)
    of_rats = configure(pathology={"preset": "dcm"}, geometry={"preset": "rat"})
    assert configure(wide, **{"geometry.preset": "rat"}) == of_rats
    with pytest.raises(ConfigError, match=r"pathology\.preset = 'dcm': needs motion\.kind = beat and"):
        configure(wide, **{"loop.kind": "measured"})
    with pytest.raises(ConfigError, match=r"pathology\.preset cannot be swept"):
        expand(configure(cases={"pathology.preset": [None, "dcm"]}))


@pytest.mark.parametrize(("section", "keys", "sentence"), BAD, ids=lambda part: str(part)[:30])
def test_a_disease_that_cannot_be_is_refused(section, keys, sentence):
    with pytest.raises(ConfigError) as caught:
        validate({"pathology": {section.split(".")[1]: keys}}, "bad.yaml")
    assert f"bad.yaml: {section}.{sentence}" in str(caught.value)


@pytest.mark.parametrize("written", [yaml.safe_dump, json.dumps])
def test_sites_survive_writing_and_reading(written):
    sites = [{"azimuth_deg": 180, "depth": 1, "time_ms": 3}, {}]
    config = validate({"pathology": {"activation": {"sites": sites}}, "loop": {"kind": "circulation"}}, "late.yaml")
    assert validate(yaml.safe_load(written(config.model_dump(mode="json"))), "again.yaml") == config
    assert [site.time_ms * ms for site in config.pathology.activation.sites] == [pytest.approx(3e-3), 0]


def test_a_wall_is_not_both_preset_and_paced():
    keys = {"pathology": {"activation": {"preset": "lbbb", "sites": [{}]}}, "loop": {"kind": "circulation"}}
    with pytest.raises(ConfigError, match="give either preset or sites"):
        validate(keys, "bad.yaml")


def test_disease_can_be_swept_with_a_healthy_heart_beside_it():
    sweep = {f"{INFARCT}.segments": [None, [7], [7, 8]], f"{INFARCT}.tension_scale": [0.0, 0.5]}
    cases = expand(Config(cases=sweep))
    assert [case.config.pathology.infarct.segments for case in cases[::2]] == [None, [7], [7, 8]]
    columns = table(cases)
    assert list(columns[f"{INFARCT}.segments"].fillna("")) == ["", "", "7", "7", "7 8", "7 8"]
    assert list(columns[f"{INFARCT}.tension_scale"]) == [0, 0.5] * 3
