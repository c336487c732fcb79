"""Section `pathology`: invalid values are refused; valid ones survive writing and reading and can be swept."""

import json

import pytest
import yaml

from echotruth.cases import expand, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate

INFARCT, ORDER = "pathology.infarct", "pathology.activation"
BAD = [
    (INFARCT, {"segments": [7, 18]}, "segments.1 = 18: should be less than or equal to 17"),
    (INFARCT, {"segments": []}, "segments = []: must have at least one entry"),
    (INFARCT, {"segments": [7, 7]}, "segments = [7, 7]: list each segment once"),
    (INFARCT, {"segments": [7], "radius_mm": 1}, "radius_mm = 1.0: give either segments or radius_mm"),
    (INFARCT, {"tension_scale": 1.2}, "tension_scale = 1.2: should be less than or equal to 1"),
    (INFARCT, {"transmurality": 0}, "transmurality = 0: should be greater than 0"),
    (INFARCT, {"segment": [1]}, "segment is not a key: did you mean pathology.infarct.segments?"),
    (ORDER, {"sites": []}, "sites = []: must have at least one entry"),
    (ORDER, {"sites": [{"time_ms": -3}]}, "sites.0.time_ms = -3: should be greater than or equal to 0"),
    (ORDER, {"preset": "rbbb"}, "preset = 'rbbb': should be 'normal', 'lbbb' or 'rv_pacing'"),
    (ORDER, {"fibre_speed_m_per_s": 0}, "fibre_speed_m_per_s = 0: should be greater than or equal to 0.01"),
    (ORDER, {"preset": "lbbb"}, "preset = 'lbbb': needs loop.kind = circulation"),
]


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
    assert [site.si().time for site in config.pathology.activation.sites] == [pytest.approx(3e-3), 0]


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
