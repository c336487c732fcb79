"""Rows of the page, and the page itself."""

from types import SimpleNamespace

import pytest

from validation import page
from validation.__main__ import main
from validation.report import Report, Row


def test_row_says_what_was_found_expected_and_allowed():
    row = Row("length (mm)", 1.234, 1.2, 0.05, "ruler", ".2f")
    assert row.met
    assert row.line() == "| length (mm) | 1.23 | 1.20 | 0.05 | ruler |"


def test_number_beyond_its_tolerance_is_marked():
    row = Row("error", 2e-3, None, 1e-3, "exact", ".1e")
    assert not row.met
    assert "| 2.0e-03 **missed** | 0 | 0.001 |" in row.line()


def test_number_that_is_only_shown_is_always_met():
    assert Row("size", 7.0, 3.0, None, "").met


def test_nothing_is_not_a_number_within_tolerance():
    assert not Row("error", float("nan"), None, 1.0, "exact").met


def sums(found):
    """A check that finds a number, where half is allowed."""
    return SimpleNamespace(
        __name__="validation.sums",
        measure=lambda quick: found,
        report=lambda results: Report("Sums", "One and one.", (Row("error", results, None, 0.5, "counting"),)),
    )


@pytest.mark.parametrize("found", [0.0, 1.0])
def test_page_holds_every_check_and_says_whether_all_is_met(tmp_path, monkeypatch, found):
    monkeypatch.setattr(page, "CHECKS", (sums(found),))
    log = []
    assert page.write(tmp_path, quick=True, log=log.append) is (found == 0)
    text = (tmp_path / "validation.md").read_text()
    assert "## Sums\n\nOne and one." in text
    assert "made with `--quick`" in text
    assert any("missed: error" in line for line in log) is (found == 1)


@pytest.mark.parametrize("found", [0, 1])
def test_command_writes_the_page_and_fails_where_a_number_is_off(tmp_path, monkeypatch, capsys, found):
    monkeypatch.setattr(page, "CHECKS", (sums(found),))
    monkeypatch.setattr("sys.argv", ["validation", "--folder", str(tmp_path)])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == found
    assert "Sums: 1 numbers, 0 s" in capsys.readouterr().out
    assert "quick" not in (tmp_path / "validation.md").read_text()
