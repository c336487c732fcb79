"""What a job is handed is its case: the same as if it were looked up in the configuration."""

import json
import shlex

import pytest

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import ConfigError, override, validate
from echotruth.workflow.assignment import (
    case_options,
    common_options,
    configuration_path,
    handed_case,
    write_configuration,
)
from echotruth.workflow.job import parser

CONFIG = Config(cases={"fibres.endo_deg": [60, 72.5], "mechanics.material.law": ["guccione", "fung"], "seed": [1, 2]})
CODE = {"phantom": "0123", "rf": "4567"}


def arguments(folder, case):
    options = f"{common_options(configuration_path(folder, CONFIG), CODE)} {case_options(case)}"
    return parser("rf", None).parse_args(["out/demo", case.id, "mid", *shlex.split(options)])


def test_every_case_arrives_as_it_was_planned(tmp_path):
    write_configuration(tmp_path, CONFIG)
    for case in expand(CONFIG):
        given = arguments(tmp_path, case)
        assert given.code == CODE
        assert handed_case(given.case, given.config, given.parameters) == case


def test_a_job_does_not_see_what_changes_after_it_was_planned(tmp_path):
    case = expand(CONFIG)[0]
    planned, path = arguments(tmp_path, case), write_configuration(tmp_path, CONFIG)
    other = override(CONFIG, {"rf.lines": 64})
    assert write_configuration(tmp_path, other) != path
    assert handed_case(case.id, planned.config, planned.parameters) == case
    assert write_configuration(tmp_path, override(CONFIG, {"cases": {}})) == path, "it depends on no sweep"


def test_order_of_trackers_stays_because_it_is_that_of_the_arrays(tmp_path):
    names = ["wall", "a_block", "m_block"]
    config = validate({"tracking": {"trackers": {name: {"window_px": 16} for name in names}}}, "a.yaml")
    read = handed_case("heart", write_configuration(tmp_path, config), {}).config
    assert list(read.tracking.trackers) == names
    turned = validate({"tracking": {"trackers": {name: {"window_px": 16} for name in names[::-1]}}}, "a.yaml")
    assert configuration_path(tmp_path, turned) != configuration_path(tmp_path, config)


def test_a_job_without_its_file_says_so(tmp_path):
    with pytest.raises(ConfigError, match=r"configs/0\.json: file not found"):
        handed_case("heart", tmp_path / "configs/0.json", {})


def test_parameters_that_are_no_mapping_are_refused(capsys):
    with pytest.raises(SystemExit):
        parser("rf", None).parse_args(["out/demo", "heart", "mid", "--parameters", json.dumps([1])])
    assert "is not a mapping" in capsys.readouterr().err
