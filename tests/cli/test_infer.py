"""`echotruth infer`."""

import pandas as pd
import pytest

import echotruth as et
from echotruth.inference import stored
from echotruth.repository.inferred import COLUMNS
from echotruth.workflow.plan import as_yaml


def test_command_writes_the_table_after_each_heart_and_goes_on_after_one_that_fails(call, tmp_path, monkeypatch):
    def rows(_, tracker, case, *__):
        if case == "infarct":
            raise ValueError("infarct: dis saw no segment")
        return [dict.fromkeys(COLUMNS, 1.0) | {"case": case, "tracker": tracker}]

    monkeypatch.setattr(stored, "rows", rows)
    status, output, errors = call("infer", "sample", "--tracker", "dis", "-o", "found.csv")
    assert status == 1 and "found.csv" in output
    assert "echotruth: infarct: dis saw no segment" in errors
    written = pd.read_csv(tmp_path / "found.csv")
    assert list(written.columns) == list(COLUMNS) and list(written["case"]) == ["healthy"]


def test_table_that_a_run_made_is_not_replaced(call, tmp_path):
    config = et.configure(tracking={"trackers": {"dis": {"method": "dis"}}}, inference={"tracker": "dis"})
    (tmp_path / "small").mkdir()
    (tmp_path / "small/registry.txt").write_text("heart\n")
    (tmp_path / "small/config.yaml").write_text(as_yaml(config))
    status, _, errors = call("infer", "small")
    assert status == 2 and "inference.csv: is what the run inferred: name another file by --output" in errors


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["sample"], "is part of the package: name a file by --output"),
        (["nowhere"], "nowhere"),
        (["sample", "-o", "no/folder.csv"], "there is no folder no"),
        (["sample", "-o", "a.csv", "--case", "healty"], "healty"),
        (["sample", "-o", "a.csv", "--tracker", "dos"], "dos"),
        (["sample", "-o", "a.csv", "--size", "17"], "17"),
        (["sample", "-o", "a.csv", "--errors", "none.csv"], "there is no such table of errors"),
    ],
)
def test_command_refuses_in_a_line_and_writes_nothing(call, tmp_path, arguments, said):
    status, _, errors = call("infer", *arguments)
    assert status == 2 and said in errors and "Traceback" not in errors
    assert not list(tmp_path.glob("*.csv"))
