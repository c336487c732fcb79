"""What is given of a repository on the command line is checked before anything is described."""

from datetime import date

import pytest

from echotruth.cli.attribution import add_attribution, attribution
from echotruth.cli.command import Parser


def parsed(*arguments):
    parser = Parser(prog="echotruth")
    add_attribution(parser)
    return attribution(parser.parse_args(arguments))


@pytest.mark.parametrize(
    ("option", "given", "message"),
    [
        ("--author", "Doe,", "is no author: give 'Family, Given; ORCID; affiliation'"),
        ("--author", "Doe, Jane; 0000-0002-1825-0098", "the last digit of the ORCID iD does not fit"),
        ("--author", "Doe, Jane; A; B", "is no author"),
        ("--author", "Group; University", "is no author"),
        ("--license", "free", "is no known licence: give one identifier"),
        ("--license", "MIT OR Apache-2.0", "is no known licence"),
        ("--url", "example.org", "is no address"),
        ("--release", "1", "is no version: give three numbers"),
        ("--date", "yesterday", "is no date: give year, month and day"),
    ],
)
def test_bad_attribution_is_one_sentence(option, given, message, capsys):
    with pytest.raises(SystemExit) as ended:
        parsed(option, given)
    said = capsys.readouterr().err
    assert ended.value.code == 2 and said.startswith(f"echotruth: argument {option}: ")
    assert message in said and said.count("\n") == 1


def test_all_that_is_given_is_told():
    person = "Doe, Jane; https://orcid.org/0000-0002-1825-0097; Example University"
    found = parsed("--author", person, "--author", "The Heart Group", "--license", "cc-by-4.0", "--date", "2026-01-31")
    assert found.authors[0] == ("Doe", "Jane", "0000-0002-1825-0097", "Example University")
    assert [one.name for one in found.authors] == ["Jane Doe", "The Heart Group"]
    assert (found.spdx, found.terms) == ("CC-BY-4.0", "https://spdx.org/licenses/CC-BY-4.0")
    assert (found.release, found.published, found.url) == ("1.0.0", date(2026, 1, 31), "")


def test_without_a_licence_all_rights_are_reserved():
    assert "all rights are reserved" in parsed().licence
    assert parsed("--license", "https://example.org/terms").licence == "https://example.org/terms"
