"""What one would upload: documents that other programs read, parts, and errors in one sentence."""

import csv
import json
import re
from contextlib import chdir
from pathlib import Path
from shutil import copytree

import pandas as pd
import pytest
import yaml
import zarr
from finished_repository import made_otherwise
from released_repository import GIVEN, REASON, SWEEP, make_unfinished

import echotruth as et
from echotruth.cli import main
from echotruth.sharing.release import ReleaseError, release
from echotruth.sharing.release.attribution import Attribution, Author

pytestmark = pytest.mark.slow

SCHEMA = Path(__file__).parent / "cff-1.2.0-schema.json"
"""Schema of the Citation File Format 1.2.0 (Druskat et al., CC BY 4.0, doi 10.5281/zenodo.5171937)."""


def card(folder):
    return (folder / "README.md").read_text()


def test_files_are_flat_and_all_of_them_are_in_the_registry(files):
    found = {path.name for path in files.iterdir() if path.is_file()}
    listed = [line.split()[0] for line in (files / "registry.txt").read_text().splitlines()]
    assert {*listed, "registry.txt"} == found and len(listed) == len(set(listed))
    assert {path.name for path in files.iterdir()} == found


def test_same_repository_gives_the_same_bytes(finished, files, tmp_path):
    release(et.Repository(finished), tmp_path / "again", GIVEN)
    for path in files.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_card_has_the_head_that_hugging_face_reads(files):
    _, head, body = (files / "README.md").read_text().split("---\n", 2)
    found = yaml.safe_load(head)
    assert found["license"] == "cc-by-4.0" and found["size_categories"] == ["n<1K"]
    for one in found["configs"]:
        assert len(pd.read_csv(files / one["data_files"])) > 0
    assert body.lstrip().startswith("# small: synthetic echocardiograms")
    assert "`small-structure.zip`" in body and (files / "small-structure.zip").is_file()


def test_code_of_the_card_runs(tmp_path):
    release(et.sample(), tmp_path / "files", GIVEN)
    text = (tmp_path / "files/README.md").read_text()
    names = {}
    with chdir(tmp_path):
        for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
            exec(
                code.replace("https://example.org/hearts", "files").replace(
                    '["healthy"])  #', '["healthy"], to="here")  #'
                ),
                names,
            )
    assert names["clip"]["image"].shape == (10, 256, 256)
    assert float(abs(names["clip"]["displacement"]).max()) > 1e-4  # m


def test_terms_that_nobody_chose_are_not_made_up(failed):
    assert "license" not in yaml.safe_load(card(failed).split("---\n")[1])
    assert "all rights are reserved" in card(failed)
    assert not {"license", "license-url"} & yaml.safe_load((failed / "CITATION.cff").read_text()).keys()


def test_clips_have_the_grid_of_the_configuration_and_the_place_of_their_images(files, finished):
    repository = et.Repository(finished)
    rows = list(csv.DictReader((files / "clips.csv").read_text().splitlines()))
    assert len(rows) == 2 * 2
    for row in rows:
        pixel = repository.config.bmode.field_of_view_mm * 1e-3 / int(row["size_px"])
        assert float(row["pixel_m"]) == pytest.approx(pixel, rel=1e-6)
        assert float(row["frame_time_s"]) == pytest.approx(60 / 500 / 3, rel=1e-6)  # of the mouse's 500 beats/min
        image = zarr.open_array(repository.store, path=row["array"], mode="r")
        assert image.shape == (int(row["frames"]), int(row["size_px"]), int(row["size_px"]))


def test_characters_that_mean_something_else_in_tables_are_escaped(finished, tmp_path):
    given = Attribution((Author("Doe|Roe", "Jane"), Author("Heart & Lung_1")))
    release(et.Repository(finished), tmp_path / "to", given)
    assert "| authors | Jane Doe\\|Roe, Heart & Lung_1 |" in card(tmp_path / "to")


def test_citation_is_of_its_schema(files, failed):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(SCHEMA.read_text())
    for folder in (files, failed, Path(__file__).parents[3]):
        texts = yaml.load((folder / "CITATION.cff").read_text(), yaml.BaseLoader)  # dates as text
        jsonschema.validate(texts, schema, format_checker=jsonschema.FormatChecker())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(texts | {"authors": []}, schema)


def test_citation_names_authors_licence_and_release(files):
    citation = yaml.safe_load((files / "CITATION.cff").read_text())
    person, group = citation["authors"]
    assert (person["family-names"], person["orcid"]) == ("Doe", "https://orcid.org/0000-0002-1825-0097")
    assert group == {"name": "The Heart Group"}
    assert (citation["license"], citation["version"], citation["type"]) == ("CC-BY-4.0", "1.2.0", "dataset")
    assert citation["date-released"].isoformat() == "2023-11-14"


def test_card_says_what_was_swept_and_what_failed(files, failed):
    for key, values in SWEEP.items():
        assert re.search(rf"\| `{re.escape(key)}` \| \w* ?\| {', '.join(map(str, values))} \|", card(files)), key
    assert "Hearts: 2 complete;" in card(files)
    assert "Hearts: 1 complete, 1 failed;" in card(failed) and REASON.replace("|", "\\|") in card(failed)
    assert "are left out of the images, not at random" in card(failed)


def test_group_that_the_configuration_does_not_ask_for_is_no_part_of_a_release(finished, files, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    view = next(folder.glob("small.zarr/clips/*/mid"))
    copytree(view / "tracking/one", view / "tracking/former")
    release(et.Repository(folder), tmp_path / "found", GIVEN)
    assert {path.name: path.read_bytes() for path in (tmp_path / "found").iterdir()} == {
        path.name: path.read_bytes() for path in files.iterdir()
    }


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
def test_what_is_damaged_or_not_finished_is_not_released(finished, tmp_path, harm, sentence):
    folder = copytree(finished, tmp_path / "small")
    harm(folder)
    with pytest.raises(ReleaseError, match=sentence) as told:
        release(et.Repository(folder), tmp_path / "to")
    assert "\n" not in str(told.value) and not (tmp_path / "to").exists()


def test_command_writes_beside_the_repository_and_names_every_file(finished, tmp_path, capsys, monkeypatch):
    copy = copytree(finished, tmp_path / "small")
    monkeypatch.setattr("sys.argv", ["echotruth", "release", str(copy), "--part-mb", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    named = capsys.readouterr().out.split()
    assert sorted(named) == sorted(str(path) for path in (tmp_path / "small-release").iterdir())


def test_what_cannot_be_released_is_refused_and_leaves_nothing(finished, files, tmp_path, capsys, monkeypatch):
    with pytest.raises(ReleaseError, match="is there already: give another folder with --to"):
        release(et.Repository(finished), files)
    unfinished = make_unfinished(tmp_path / "half/small")
    with pytest.raises(ReleaseError, match=r"is not finished, .*: run its configuration to its end"):
        release(et.Repository(unfinished), tmp_path / "to")
    damaged = copytree(finished, tmp_path / "damaged/small")
    next(damaged.glob("small.zarr/clips/*/mid/bmode/64/image/c/0/0/0")).write_bytes(b"x")
    monkeypatch.setattr("sys.argv", ["echotruth", "release", str(damaged), "--to", str(tmp_path / "to")])
    with pytest.raises(SystemExit) as ended:
        main()
    errors = capsys.readouterr().err
    assert ended.value.code == 2 and "damaged (small.zarr/clips/" in errors and errors.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["damaged", "half"]
