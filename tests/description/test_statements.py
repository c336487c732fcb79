"""Statements on a repository follow from its configuration, whatever the heart."""

from types import SimpleNamespace

import pytest

from echotruth.config import Config
from echotruth.repository.description.statements import statements


def facts(*settings, **changes):
    configs = [Config.model_validate({"views": {"mid": {}}} | each) for each in settings]
    cases = {f"case_{number}": SimpleNamespace(config=config) for number, config in enumerate(configs)}
    run = SimpleNamespace(packages={"echotruth": "1.2.3"})
    known = {"name": "heart", "counts": {"complete": len(cases)}, "swept": {}, "run": run}
    known |= {"missing_jobs": 0, "wanted_jobs": 9, "is_published": True}
    return SimpleNamespace(**known | changes, repository=SimpleNamespace(config=configs[0], cases=cases))


def texts(value):
    if isinstance(value, dict):
        return [text for each in value.values() for text in texts(each)]
    return [text for each in value for text in texts(each)] if isinstance(value, list) else [value]


@pytest.mark.parametrize(
    ("settings", "limit"),
    [
        ({"geometry": {"preset": "mouse"}}, "GLS is -12 % in the default mouse"),
        ({"geometry": {"preset": "rat"}}, "No measured twist of rats"),
        ({"geometry": {"preset": "human"}}, "In people much of the twist"),
        (
            {"motion": {"kind": "file", "file": {"path": "a_*.vtk"}}, "loop": {"heart_rate_per_min": 500}},
            "depends on the simulation that was read",
        ),
        ({"motion": {"kind": "rigid"}}, "is no heart"),
    ],
)
def test_limits_are_those_of_the_heart_and_every_statement_is_text(settings, limit):
    said = statements(facts(settings))
    assert sum(limit in text for text in said["limits"]) == 1
    assert all(isinstance(text, str) and text for text in texts(said))


def test_only_what_some_hearts_lack_is_said_of_some():
    noisy = {"realism": {"noise": {"snr_dB": 20.0}}}
    (lacking, partial) = statements(facts({}, noisy))["limits"][-2:]
    assert "haze" in lacking and "noise" not in lacking
    assert partial == "Only some hearts have noise in their images."


def test_what_is_missing_and_swept_is_said():
    said = statements(
        facts({}, missing_jobs=2, counts={"complete": 1, "failed": 3}, swept={"a_mm": [1, 2], "b": [3, 4]})
    )
    assert (
        said["state"] == "Hearts: 1 complete, 3 failed. The repository is not finished: 2 of 9 jobs have not been run."
    )
    assert said["summary"].endswith(said["state"]) and "echotruth 1.2.3" in said["maintenance"]
    assert said["biases"][0].startswith("Hearts differ in a_mm, b only: ") and "not at random" in said["biases"][-1]


def test_files_of_the_user_are_sources():
    said = statements(facts({"loop": {"file": "my loop: one.csv"}}))
    assert said["sources"] == ["my loop: one.csv"] and "entered: my loop: one.csv." in said["raw_data"]
