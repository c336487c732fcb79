"""What one would upload: documents that other programs read, parts, and errors in one sentence."""

import re
from contextlib import chdir
from shutil import copytree

import pandas as pd
import pytest
import yaml
from described_repository import GIVEN, make_unfinished

import echotruth as et
from echotruth.cli import main
from echotruth.sharing.description import DescriptionError
from echotruth.sharing.release import ReleaseError, release

mlcroissant = pytest.importorskip("mlcroissant")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def released(finished, tmp_path_factory):
    folder = tmp_path_factory.mktemp("release") / "small-release"
    release(et.Repository(finished), folder, GIVEN)
    return folder


def test_files_are_flat_and_all_of_them_are_in_the_registry(released):
    found = {path.name for path in released.iterdir() if path.is_file()}
    listed = [line.split()[0] for line in (released / "registry.txt").read_text().splitlines()]
    assert {*listed, "registry.txt"} == found and len(listed) == len(set(listed))
    assert {path.name for path in released.iterdir()} == found


def test_same_repository_gives_the_same_bytes(finished, released, tmp_path):
    release(et.Repository(finished), tmp_path / "again", GIVEN)
    for path in released.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_card_has_the_head_that_hugging_face_reads(released):
    _, head, body = (released / "README.md").read_text().split("---\n", 2)
    found = yaml.safe_load(head)
    assert found["license"] == "cc-by-4.0" and found["size_categories"] == ["n<1K"]
    for one in found["configs"]:
        assert len(pd.read_csv(released / one["data_files"])) > 0
    assert body.lstrip().startswith("<!-- Made by echotruth")
    assert "`small-structure.zip`" in body and (released / "small-structure.zip").is_file()


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


def test_terms_that_nobody_chose_are_not_made_up(finished, tmp_path):
    release(et.Repository(finished), tmp_path / "plain")
    head = yaml.safe_load((tmp_path / "plain/README.md").read_text().split("---\n")[1])
    assert "license" not in head


def test_croissant_is_valid_and_its_tables_are_read(released):
    with chdir(released):
        dataset = mlcroissant.Dataset("croissant.json")
        assert not dataset.metadata.ctx.issues.errors
        assert len(list(dataset.records("clips"))) == 2 * 2
        assert len(list(dataset.records("cases"))) == 2
    archives = [item for item in dataset.metadata.distribution if item.encoding_formats == ["application/zip"]]
    assert {item.content_url for item in archives} == {path.name for path in released.glob("*.zip")}


def test_command_writes_beside_the_repository_and_names_every_file(finished, tmp_path, capsys, monkeypatch):
    copy = copytree(finished, tmp_path / "small")
    monkeypatch.setattr("sys.argv", ["echotruth", "release", str(copy), "--part-mb", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    named = capsys.readouterr().out.split()
    assert sorted(named) == sorted(str(path) for path in (tmp_path / "small-release").iterdir())


def test_what_cannot_be_released_is_refused_and_leaves_nothing(finished, released, tmp_path, capsys, monkeypatch):
    with pytest.raises(ReleaseError, match="is there already: give another folder with --to"):
        release(et.Repository(finished), released)
    unfinished = make_unfinished(tmp_path / "half/small")
    with pytest.raises(DescriptionError, match=r"is not finished, .*: run its configuration to its end"):
        release(et.Repository(unfinished), tmp_path / "to")
    damaged = copytree(finished, tmp_path / "damaged/small")
    next(damaged.glob("small.zarr/clips/*/mid/bmode/64/image/c/0/0/0")).write_bytes(b"x")
    monkeypatch.setattr("sys.argv", ["echotruth", "release", str(damaged), "--to", str(tmp_path / "to")])
    with pytest.raises(SystemExit) as ended:
        main()
    errors = capsys.readouterr().err
    assert ended.value.code == 2 and "damaged (small.zarr/clips/" in errors and errors.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["damaged", "half"]
