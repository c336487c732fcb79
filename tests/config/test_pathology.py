"""Section `pathology`: invalid values are refused; valid ones survive writing and reading and can be swept."""

import json

import pytest
import yaml

from echotruth.cases import expand, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate

INFARCT, LATE = "pathology.infarct", "pathology.late_activation"
BAD = [
    (INFARCT, {"segments": [7, 18]}, "segments.1 = 18: should be less than or equal to 17"),
    (INFARCT, {"segments": []}, "segments = []: should have at least 1 item"),
    (INFARCT, {"segments": [7], "radius_mm": 1}, "radius_mm = 1.0: give either segments or radius_mm"),
    (INFARCT, {"segment": [1]}, "segment is not a key: did you mean pathology.infarct.segments?"),
    (LATE, {"delay_ms": {5: -3}}, "delay_ms.5 = -3: should be greater than or equal to 0"),
    (LATE, {"delay_ms": {"lateral": 3}}, "delay_ms.lateral = 'lateral': must be a whole number"),
    (LATE, {"preset": "lbbb", "delay_ms": {5: 3}}, "delay_ms = {5: 3.0}: give either preset or delay_ms"),
    (LATE, {"preset": "rbbb"}, "preset = 'rbbb': should be 'lbbb'"),
]


def test_preset_of_a_disease_sets_growth_and_load_but_not_what_is_given():
    thick = validate({"pathology": {"preset": "hypertension"}}, "a.yaml")
    assert thick.geometry.hypertrophy == 1.2
    assert (thick.loop.kind, thick.loop.circulation.baroreflex) == ("circulation", False)
    wide = {name: Config(geometry={"preset": name}, pathology={"preset": "dcm"}) for name in ("mouse", "human")}
    assert wide["mouse"].loop.circulation.contractility < wide["human"].loop.circulation.contractility < 1
    given = {"pathology": {"preset": "dcm"}, "geometry": {"dilation": 1.3}, "loop": {"circulation": {"resistance": 2}}}
    dilated = validate(given, "a.yaml")
    assert (dilated.geometry.dilation, dilated.loop.circulation.resistance) == (1.3, 2)
    assert dilated.loop.circulation.retained_volume_stroke_volumes == 5
    # What is stored is read back as it is.
    assert validate(json.loads(dilated.model_dump_json()), "a.yaml") == dilated


@pytest.mark.parametrize(("section", "keys", "sentence"), BAD, ids=lambda part: str(part)[:30])
def test_a_disease_that_cannot_be_is_refused(section, keys, sentence):
    with pytest.raises(ConfigError) as caught:
        validate({"pathology": {section.split(".")[1]: keys}}, "bad.yaml")
    assert f"bad.yaml: {section}.{sentence}" in str(caught.value)


@pytest.mark.parametrize("written", [yaml.safe_dump, json.dumps])
def test_delays_survive_writing_and_reading(written):
    config = validate({"pathology": {"late_activation": {"delay_ms": {5: 8, 11: 4.5}}}}, "late.yaml")
    assert validate(yaml.safe_load(written(config.model_dump(mode="json"))), "again.yaml") == config
    assert config.pathology.late_activation.si().delay == {5: pytest.approx(8e-3), 11: pytest.approx(4.5e-3)}


def test_disease_can_be_swept_with_a_healthy_heart_beside_it():
    sweep = {f"{INFARCT}.segments": [None, [7], [7, 8]], f"{INFARCT}.tension_scale": [0.0, 0.5]}
    cases = expand(Config(cases=sweep))
    assert [case.config.pathology.infarct.segments for case in cases[::2]] == [None, [7], [7, 8]]
    columns = table(cases)
    assert list(columns[f"{INFARCT}.segments"].fillna("")) == ["", "", "7", "7", "7 8", "7 8"]
    assert list(columns[f"{INFARCT}.tension_scale"]) == [0, 0.5] * 3
