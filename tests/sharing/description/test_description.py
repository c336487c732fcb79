"""Documents of a repository: the same bytes again, true, and honest about what is missing."""

import csv
import json
import re
from contextlib import chdir
from pathlib import Path
from shutil import copytree

import pytest
import yaml
from described_repository import GIVEN, REASON, SWEEP
from finished_repository import made_otherwise

from echotruth.repository.check import check
from echotruth.repository.reader import Repository
from echotruth.sharing.description import DescriptionError, describe
from echotruth.sharing.description.attribution import Attribution, Author

pytest.importorskip("mlcroissant")
pytestmark = pytest.mark.slow

SCHEMA = Path(__file__).parent / "cff-1.2.0-schema.json"
"""Schema of the Citation File Format 1.2.0 (Druskat et al., CC BY 4.0, doi 10.5281/zenodo.5171937)."""
DOCUMENTS = ["clips.csv", "README.md", "CITATION.cff", "croissant.json"]


def contents(folder):
    return {name: (folder / name).read_bytes() for name in DOCUMENTS}


def card(folder):
    return (folder / "README.md").read_text()


def test_same_repository_gives_the_same_bytes(described, tmp_path):
    first = contents(described)
    describe(Repository(described), None, GIVEN)
    assert contents(described) == first
    copy = copytree(described, tmp_path / "small")  # keeps times
    for name in DOCUMENTS:
        (copy / name).unlink()
    describe(Repository(copy), None, GIVEN)
    assert contents(copy) == first


def test_clips_have_the_grid_of_the_configuration(described):
    config = yaml.safe_load((described / "config.yaml").read_text())
    rows = list(csv.DictReader((described / "clips.csv").read_text().splitlines()))
    assert len(rows) == 2 * 2
    for row in rows:
        pixel = config["bmode"]["field_of_view_mm"] * 1e-3 / int(row["size_px"])
        assert float(row["pixel_m"]) == pytest.approx(pixel, rel=1e-6)
        assert float(row["frame_time_s"]) == pytest.approx(60 / 500 / 3, rel=1e-6)  # of the mouse's 500 beats/min


def test_characters_that_mean_something_else_in_tables_are_escaped(finished, tmp_path):
    made = Attribution((Author("Doe|Roe", "Jane"), Author("Heart & Lung_1")))
    describe(Repository(finished), tmp_path, made)
    assert "| authors | Jane Doe\\|Roe, Heart & Lung_1 |" in card(tmp_path)


def test_documents_leave_the_repository_whole(described):
    assert not check(described).faults


def test_citation_is_of_its_schema(described, failed):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(SCHEMA.read_text())
    for folder in (described, failed, Path(__file__).parents[3]):
        texts = yaml.load((folder / "CITATION.cff").read_text(), yaml.BaseLoader)  # dates as text
        jsonschema.validate(texts, schema, format_checker=jsonschema.FormatChecker())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(texts | {"authors": []}, schema)


def test_citation_names_authors_licence_and_release(described):
    citation = yaml.safe_load((described / "CITATION.cff").read_text())
    person, group = citation["authors"]
    assert (person["family-names"], person["orcid"]) == ("Doe", "https://orcid.org/0000-0002-1825-0097")
    assert group == {"name": "The Heart Group"}
    assert (citation["license"], citation["version"], citation["type"]) == ("CC-BY-4.0", "1.2.0", "dataset")
    assert citation["date-released"].isoformat() == "2023-11-14"


def test_card_says_what_was_swept_and_of_what_size_it_is(described):
    text = card(described)
    for key, values in SWEEP.items():
        assert re.search(rf"\| `{re.escape(key)}` \| \w* ?\| {', '.join(map(str, values))} \|", text), key
    assert "Hearts: 2 complete;" in text


def test_example_of_the_card_reads_a_clip_in_five_lines(described):
    (code,) = re.findall(r"```python\n(.*?)```", card(described), flags=re.S)
    assert len([line for line in code.splitlines() if line]) <= 5
    names: dict = {}
    with chdir(described.parent):
        exec(code, names)
    assert names["clip"]["image"].shape == (3, 64, 64)
    place = names["repository"].path("bmode/64", names["repository"].present[0], "mid")
    assert names["repository"].tree[place]["image"].shape == (3, 64, 64)


def test_card_tells_of_hearts_that_failed(failed):
    text = card(failed)
    assert "Hearts: 1 complete, 1 failed;" in text and REASON.replace("|", "\\|") in text
    assert "are left out of the images, not at random" in text


def test_nothing_is_licensed_unless_it_is_said(failed):
    assert "all rights are reserved" in card(failed)
    assert not {"license", "license-url"} & yaml.safe_load((failed / "CITATION.cff").read_text()).keys()


def test_readme_of_somebody_else_is_spared(finished, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    (folder / "README.md").write_text("mine\n")
    with pytest.raises(DescriptionError, match=r"README\.md: was not made by echotruth describe"):
        describe(Repository(folder))
    assert (folder / "README.md").read_text() == "mine\n" and not (folder / "clips.csv").exists()


def lose_file(folder):
    next(path for path in folder.glob("small.zarr/clips/*/mid/bmode/64/image/c/**/*") if path.is_file()).unlink()


def make_otherwise(folder):
    made_otherwise(next(folder.glob("small.zarr/clips/*/mid/bmode/64")))


def drop_checksums(folder):
    (folder / "SHA256SUMS").unlink()


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (lose_file, r"is not finished, or damaged \(small.zarr/clips/.*/image/.* is missing: .*\): .* echotruth check"),
        (make_otherwise, r"is not finished, or damaged \(small.zarr/clips/.*/zarr.json is not what was written"),
        (drop_checksums, r"is not finished, or damaged \(.*SHA256SUMS is not there: the run has not ended"),
    ],
)
def test_what_is_damaged_or_not_finished_is_not_described(finished, tmp_path, harm, sentence):
    folder = copytree(finished, tmp_path / "small")
    harm(folder)
    with pytest.raises(DescriptionError, match=sentence) as told:
        describe(Repository(folder))
    assert "\n" not in str(told.value) and not any((folder / document).exists() for document in DOCUMENTS)


def test_group_that_the_configuration_does_not_ask_for_is_no_part_of_what_is_described(finished, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    view = next(folder.glob("small.zarr/clips/*/mid"))
    copytree(view / "tracking/one", view / "tracking/former")
    describe(Repository(folder), tmp_path / "found")
    describe(Repository(finished), tmp_path / "expected")
    assert contents(tmp_path / "found") == contents(tmp_path / "expected")


def test_command_prints_what_it_wrote_or_one_sentence(finished, tmp_path, capsys, monkeypatch):
    from echotruth.cli import main

    for arguments, status in (([finished, "-o", tmp_path / "documents"], 0), ([tmp_path], 2)):
        monkeypatch.setattr("sys.argv", ["echotruth", "describe", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert (ended.value.code or 0) == status
    said = capsys.readouterr()
    assert f"{tmp_path / 'documents' / 'README.md'}\n" in said.out
    assert said.err.count("\n") == 1 and "is not a repository" in said.err
