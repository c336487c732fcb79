"""`echotruth new`: what it writes is valid as it is, and says of each key what the models say."""

import re

import pytest
import yaml

from echotruth.cases import expand
from echotruth.config import Config, Geometry, Loop, Rf, shipped
from echotruth.config.allowed import allowed
from echotruth.config.building import configure
from echotruth.config.commented import FIRST, commented
from echotruth.config.loading import load, validate
from echotruth.section import Section

DISABLED = re.compile(r"(?m)^( *)#(?=\w)")
"""What makes a key a comment."""


def keys(section, prefix=""):
    """Dotted keys of a configuration; views, trackers and cases count as one each."""
    for key in type(section).model_fields:
        value = getattr(section, key)
        if isinstance(value, Section) and key != "cases":
            yield from keys(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def written_keys(node, prefix=""):
    """Dotted keys in a mapping of YAML."""
    for key, value in node.items():
        yield f"{prefix}{key}"
        if isinstance(value, dict):
            yield from written_keys(value, f"{prefix}{key}.")


@pytest.mark.parametrize("everything", [False, True])
@pytest.mark.parametrize("name", shipped.names())
def test_preset_is_unchanged_with_comments_and_without_them(name, everything):
    text = shipped.path_of(name).read_text()
    text = re.sub(r"config/(\w+\.csv)", rf"{shipped.folder()}/\1", text)
    wanted, new = validate(yaml.safe_load(text), name), commented(text, everything)
    assert validate(yaml.safe_load(new), "as written") == wanted
    assert validate(yaml.safe_load(DISABLED.sub(r"\1", new)), "without #") == wanted


def test_all_keys_are_written_with_all_and_the_first_ones_without():
    for everything, wanted in ((True, set(keys(Config()))), (False, set(FIRST))):
        new = commented("geometry: {preset: mouse}", everything)
        found = set(written_keys(yaml.safe_load(DISABLED.sub(r"\1", new))))
        assert wanted <= found, wanted - found
    assert set(FIRST) <= set(keys(Config()))


def test_every_key_has_its_description_above_it():
    lines = commented("{}", everything=True).splitlines()
    text = " ".join(line.strip().removeprefix("# ") for line in lines)
    for model in (Geometry, Loop, Rf):
        for key, field in model.model_fields.items():
            assert " ".join((field.description or "").split()) in text, key


def test_default_that_follows_the_heart_is_left_to_it():
    mouse = commented("geometry: {preset: mouse}", everything=True)
    rat = validate(yaml.safe_load(mouse.replace("preset: mouse\n", "preset: rat\n", 1)), "rat")
    expected = validate({"geometry": {"preset": "rat"}}, "rat")
    assert (rat.probe.preset, rat.fibres, rat.bmode) == (expected.probe.preset, expected.fibres, expected.bmode)


def test_comments_of_the_preset_stay():
    new = commented(shipped.path_of("paper").read_text())
    for line in re.findall(r"#.*", shipped.path_of("paper").read_text()):
        assert line in new, line


@pytest.mark.parametrize(
    ("model", "key", "words"),
    [
        (Geometry, "preset", "one of mouse, rat, human"),
        (Geometry, "transmural_elements", "whole number from 1 to 20"),
        (Geometry, "circumferential_elements", "whole number from 6 to 120, a multiple of 6"),
        (Geometry, "endo_radius_mm", "number above 0"),
        (Geometry, "remesh", "true or false"),
        (Geometry, "septum_point", "list of 3, each number"),
        (Loop, "edv_uL", "number above 0, not above 100000000"),
        (Loop, "file", ""),
        (Rf, "keep", "list, each one of lines, channels"),
    ],
)
def test_limits_are_told_in_words(model, key, words):
    assert allowed(model, key) == words


def test_every_limit_is_that_of_the_model():
    limited = [("geometry", Geometry, "transmural_elements"), ("geometry", Geometry, "circumferential_elements")]
    for section, model, key in [*limited, ("loop", Loop, "frames"), ("rf", Rf, "lines")]:
        low, high = (int(number) for number in re.findall(r"\d+", allowed(model, key))[:2])
        for number in (low, high):
            assert validate({section: {key: number}}, "limit")
        for number in (low // 2, high * 2):
            with pytest.raises(ValueError, match=key):
                validate({section: {key: number}}, "limit")


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
    status, output, errors = call("new", "demo", "--all", "-o", "-")
    assert (status, errors) == (0, "") and yaml.safe_load(output)["name"] == "demo"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["humn"], "humn is not a preset: did you mean human?"),
        (["zzz"], "zzz is not a preset: use one of ablation, "),
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
