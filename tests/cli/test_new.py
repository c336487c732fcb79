"""`echotruth new`: the shipped configurations that it copies are valid, and their comments say what the models do."""

import re

import numpy as np
import pytest
import yaml

from echotruth.cases import expand
from echotruth.config import Config, shipped
from echotruth.config.building import configure
from echotruth.config.loading import load, validate
from echotruth.loop.cycle import read_loop

COMMENTED = re.compile(r"(?m)^( *)#(?=[a-z])(.*)$")
"""A key that is commented out, with its value and what is said of it."""
LINES = [
    pytest.param(name, match, id=f"{name}:{match[0].split(':')[0].strip()}")
    for name in shipped.names()
    for match in COMMENTED.finditer(shipped.path_of(name).read_text())
]


@pytest.mark.parametrize("name", shipped.names())
def test_shipped_configuration_is_valid(name, monkeypatch):
    monkeypatch.chdir(shipped.ROOT)
    assert load(shipped.path_of(name)).name == name


def test_configurations_of_the_presets_name_the_keys_that_people_change():
    assert {match.values[0] for match in LINES} == {"mouse", "human", "rat"}


def leaves(node, prefix=()):
    """Keys, as a tuple, and value of everything in a mapping of YAML."""
    for key, value in node.items():
        yield from leaves(value, (*prefix, key)) if isinstance(value, dict) else [((*prefix, key), value)]


def value_in(section, keys):
    for key in keys:
        section = getattr(section.resolved(), key)
    return section


@pytest.mark.parametrize(("name", "match"), LINES)
def test_key_that_is_commented_out_is_one_and_has_its_default_or_is_an_example(name, match):
    text = shipped.path_of(name).read_text()
    with_key = f"{text[: match.start()]}{match[1]}{match[2]}{text[match.end() :]}"
    before, after = validate(yaml.safe_load(text), name), validate(yaml.safe_load(with_key), "with the key")
    if "e.g." in match[2]:
        assert after != before
        return
    plain = list(leaves(yaml.safe_load(text)))
    ((keys, value),) = [leaf for leaf in leaves(yaml.safe_load(with_key)) if leaf not in plain]
    if keys[0] == "loop":
        found, wanted = read_loop(after.loop), read_loop(before.loop)
        assert (found.source, found.period) == (wanted.source, pytest.approx(wanted.period))
        np.testing.assert_allclose(found.volume, wanted.volume, rtol=1e-12)
    else:
        assert value_in(before, keys) == value


def test_file_is_written_under_its_name_and_never_replaced(call, tmp_path):
    status, output, errors = call("new", "human", "-o", "patient.yaml")
    assert (status, errors) == (0, "") and output.startswith("patient.yaml\n")
    config = load(tmp_path / "patient.yaml")
    assert (config.name, config.geometry.preset) == ("patient", "human")
    (tmp_path / "patient.yaml").write_text("seed: 3")
    status, output, errors = call("new", "rat", "-o", "patient.yaml")
    assert (status, output) == (2, "") and "patient.yaml: is there already" in errors and errors.count("\n") == 1
    assert (tmp_path / "patient.yaml").read_text() == "seed: 3"


def test_default_preset_is_the_default_heart_as_a_scanner_shows_it(call, tmp_path):
    assert call("new")[0] == 0
    written = load(tmp_path / "mouse.yaml")
    assert written.realism.preset == "mouse"
    assert configure(written, name="demo", realism={"preset": "none"}) == Config()


def test_table_of_a_preset_is_written_beside_it(call, tmp_path, monkeypatch):
    (tmp_path / "study").mkdir()
    status, output, _ = call("new", "hearts", "-o", "study/mine.yaml")
    assert status == 0 and output.splitlines()[:2] == ["study/hearts.csv", "study/mine.yaml"]
    monkeypatch.chdir(tmp_path)
    assert len(expand(load("study/mine.yaml"))) == 24
    # A second configuration shares the table; another table of the same name is not replaced.
    assert call("new", "hearts", "-o", "study/other.yaml")[0] == 0
    (tmp_path / "study/hearts.csv").write_text("case\na\n")
    status, _, errors = call("new", "hearts", "-o", "study/third.yaml")
    assert status == 2 and "hearts.csv: is there already" in errors and not (tmp_path / "study/third.yaml").exists()


def test_list_names_every_preset_with_what_it_is(call):
    status, output, errors = call("new", "--list")
    assert (status, errors) == (0, "")
    assert [line.split()[0] for line in output.splitlines()] == shipped.names()
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in output.splitlines())


def test_output_can_be_printed(call, tmp_path):
    status, output, errors = call("new", "demo", "-o", "-")
    assert (status, errors, output) == (0, "", shipped.path_of("demo").read_text())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["humn"], "humn is not a preset: did you mean human?"),
        (["zzz"], "zzz is not a preset: use one of demo, "),
        (["../demo"], "../demo is not a preset"),
        (["mouse", "-o", "nowhere/a.yaml"], "nowhere/a.yaml: cannot be written (No such file or directory)"),
        (["mouse", "-o", "/dev/null/a"], "cannot be written (Not a directory)"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(call, tmp_path, arguments, sentence):
    status, output, errors = call("new", *arguments)
    assert (status, output, errors.count("\n")) == (2, "", 1) and sentence in errors
    assert not list(tmp_path.iterdir())


def test_shipped_configuration_is_found_by_its_name_and_a_file_goes_first(call, tmp_path):
    assert call("check", "sweep")[1].count("valid; cases: 108") == 1
    (tmp_path / "sweep").write_text("seed: 3")
    assert "sweep: valid; cases: 1," in call("check", "sweep")[1]


def test_section_of_which_all_keys_are_commented_out_is_its_default():
    text = "fibres:\n  #endo_deg: 60\nmechanics:\n  material:\n    #stiffness_kPa: 1\n"
    assert validate(yaml.safe_load(text), "mine") == Config()
