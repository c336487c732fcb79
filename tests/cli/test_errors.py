"""All errors of a configuration are told at once, each once, in one line."""

import pytest

from echotruth.cases import expand
from echotruth.config.loading import ConfigError, validate
from echotruth.config.reading import MAX_ERRORS


def refused(values):
    with pytest.raises(ConfigError) as error:
        expand(validate(values, "my.yaml"), "my.yaml")
    lines = str(error.value).splitlines()
    assert all(line.startswith("my.yaml: ") for line in lines) and len(set(lines)) == len(lines)
    return [line.removeprefix("my.yaml: ") for line in lines]


def test_errors_of_all_sections_are_told_and_mistyped_keys_first():
    values = {"geometri": {}, "seed": -1, "fibres": {"endo_deg": 95.0, "epi": 3}, "rf": {"keep": ["a", "b"]}}
    assert [line.split(" ")[0] for line in refused(values)] == [
        *("fibres.epi", "geometri", "seed", "fibres.endo_deg", "rf.keep.0", "rf.keep.1"),
    ]


def test_keys_that_conflict_are_told_together():
    values = {"rf": {"focus_mm": 30.0}, "views": {"all": {}}, "fibres": {"source": "file"}}
    assert [line.split(" ")[0] for line in refused(values)] == ["rf.focus_mm", "views", "fibres.source"]


def test_many_errors_are_cut_and_counted():
    lines = refused({"views": {f"v{number}": {"position": 2.0} for number in range(30)}})
    assert len(lines) == MAX_ERRORS + 1 and lines[-1] == "at least 10 more errors: correct these first"


def test_all_rows_of_a_table_are_told():
    table = "fibres.endo_deg,fibres.epi_deg\nx,-40\n60,95\n95,y\n"
    assert [line.partition(" = ")[0] for line in refused({"cases": {"table": table}})] == [
        "cases.table, row 1: fibres.endo_deg",
        "cases.table, row 2: fibres.epi_deg",
        "cases.table, row 3: fibres.endo_deg",
        "cases.table, row 3: fibres.epi_deg",
    ]


def test_all_values_of_a_grid_are_told_once_however_many_cases_have_them():
    grid = {"fibres.endo_deg": [60, 95, 96], "seed": list(range(30))}
    assert refused({"cases": grid}) == [
        f"cases: fibres.endo_deg = {value}: should be less than or equal to 90" for value in (95, 96)
    ]


def test_all_keys_that_cannot_be_swept_are_told():
    lines = refused({"cases": {"loop.frames": [10], "foo.bar": [3], "seed": [1, 1]}})
    assert [line.partition(": ")[0] for line in lines] == [
        "cases.loop.frames",
        "cases.foo.bar",
        "cases.seed gives a value twice, 1",
    ]


def test_each_line_on_the_terminal_has_the_name_of_the_program(call, tmp_path):
    (tmp_path / "bad.yaml").write_text("seed: -1\nfibres: {endo_deg: 95}\n")
    status, output, errors = call("check", "bad.yaml")
    assert (status, output) == (1, "") and [line[:20] for line in errors.splitlines()] == ["echotruth: bad.yaml:"] * 2


@pytest.mark.parametrize(
    ("path", "remedy"),
    [
        ("mous", "did you mean mouse?"),
        ("config/mouse.yaml", "did you mean mouse?"),
        ("heart_mine", "did you mean hearts_mine.yaml?"),
        ("out/mouse_1", "give a YAML file, a name that echotruth new --list shows, or the folder of a repository"),
    ],
)
def test_configuration_that_does_not_exist_is_told_with_one_that_is_like_it(call, tmp_path, path, remedy):
    (tmp_path / "hearts_mine.yaml").write_text("seed: 1\n")
    assert call("check", path) == (1, "", f"echotruth: {path}: does not exist: {remedy}\n")
