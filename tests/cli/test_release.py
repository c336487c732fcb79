"""What is given of a repository on the command line is checked before anything is released."""

import pytest

from echotruth.cli.command import Parser
from echotruth.cli.release import add


def parsed(*arguments):
    parser = Parser(prog="echotruth")
    add(parser)
    return parser.parse_args(["out/demo", *arguments])


@pytest.mark.parametrize(
    ("option", "given", "message"),
    [
        ("--author", "Doe,", "is no author: give 'Family, Given; ORCID; affiliation'"),
        ("--author", "Doe, Jane; A; B", "is no author"),
        ("--author", "Group; University", "is no author"),
        ("--license", "free", "is no known licence: give one identifier"),
        ("--license", "MIT OR Apache-2.0", "is no known licence"),
        ("--url", "example.org", "is no address"),
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
    found = parsed("--author", person, "--author", "The Heart Group", "--license", "cc-by-4.0")
    assert found.author[0] == ("Doe", "Jane", "0000-0002-1825-0097", "Example University")
    assert [one.name for one in found.author] == ["Jane Doe", "The Heart Group"]
    assert found.license == ("CC-BY-4.0", "https://spdx.org/licenses/CC-BY-4.0")
    assert (found.release, found.url) == ("1.0.0", None)
    assert parsed("--license", "https://example.org/terms").license == ("", "https://example.org/terms")
