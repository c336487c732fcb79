"""Statements on a repository follow from its configuration, whatever the heart."""

from datetime import date
from types import SimpleNamespace

import pandas as pd

from echotruth.config import Config
from echotruth.sharing.release.attribution import Attribution, Author
from echotruth.sharing.release.statements import statements


def facts(*settings, statuses=("complete",), swept=()):
    configs = [Config.model_validate({"views": {"mid": {}}} | each) for each in settings]
    every = {f"case_{number}": SimpleNamespace(config=config) for number, config in enumerate(configs)}
    table = pd.DataFrame({"status": list(statuses)})
    repository = SimpleNamespace(config=configs[0], every=every, cases=table)
    attribution = Attribution((Author("Doe", "Jane"),))
    known = {"title": "heart: synthetic hearts", "packages": {"echotruth": "1.2.3"}, "published": date(2026, 1, 31)}
    return SimpleNamespace(repository=repository, swept=swept, attribution=attribution, **known)


def texts(value):
    if isinstance(value, dict):
        return [text for each in value.values() for text in texts(each)]
    return [text for each in value for text in texts(each)] if isinstance(value, list) else [value]


def test_only_what_all_hearts_lack_is_said():
    noisy = {"realism": {"noise": {"snr_dB": 20.0}}}
    lacking = statements(facts({}, noisy))["limits"][-1]
    assert "haze" in lacking and "noise" not in lacking


def test_what_failed_and_was_swept_is_said():
    said = statements(
        facts({}, statuses=["complete", "failed", "failed", "failed"], swept={"a_mm": [1, 2], "b": [3, 4]})
    )
    assert "Hearts: 3 failed, 1 complete;" in said["summary"]
    assert said["biases"][0].startswith("Hearts differ in a_mm, b only: ") and "not at random" in said["biases"][-1]
    assert said["cite"].startswith("Jane Doe. heart: synthetic") and said["cite"].endswith("Release 1.0.0, 2026.")
