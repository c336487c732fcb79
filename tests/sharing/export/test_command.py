"""The command: what is chosen, where it goes, and that nothing is ever written by half."""

import re
import shutil
import sys
from pathlib import Path

import finished_repository
import pytest
from known_repository import SIZES

from echotruth import cli
from echotruth.cases import expand
from echotruth.extras import installation
from echotruth.repository import metadata
from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export, ExportError, destination, png


def call(monkeypatch, *arguments):
    """Exit status of `echotruth export`."""
    monkeypatch.setattr(sys, "argv", ["echotruth", "export", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        cli.main()
    return done.value.code


@pytest.mark.slow
def test_default_is_every_view_at_the_largest_size_beside_the_repository(known, monkeypatch, capsys):
    assert call(monkeypatch, known.folder, "--format", "gif") == 0
    folder = known.folder / "export/gif"
    names = [f"heart_{view}_{SIZES[0]}.gif" for view in ("mid", "long")]
    assert capsys.readouterr().out.splitlines() == [str(folder / name) for name in names]
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)


def test_choices_narrow_what_is_written(known, monkeypatch, tmp_path):
    options = ["--case", "heart", "--view", "long", "--size", SIZES[1], "--size", SIZES[0]]
    assert call(monkeypatch, known.folder, "--format", "png", *options, "-o", tmp_path) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"heart_long_{size}" for size in SIZES)


def test_one_clip_can_be_given_its_file(known, monkeypatch, tmp_path, capsys):
    options = [known.folder, "--format", "nifti", "--output", tmp_path / "new/a.nii.gz"]
    pytest.importorskip("nibabel")
    assert call(monkeypatch, *options, "--view", "mid") == 0
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.nii.gz"]
    assert call(monkeypatch, *options) == 2
    assert "is one file, but there are 2 to write: give a folder" in capsys.readouterr().err


REFUSED = {
    "case": (["--case", "hart"], "case = 'hart': use one of heart"),
    "tracker": (["--format", "csv", "--tracker", "three"], "tracker = 'three': use one of one, two"),
    "tracker of a video": (["--tracker", "one"], "--tracker does nothing for mp4: it is for csv"),
    "overlay": (["--overlay", "strain"], "--overlay strain: use wall, segments, tissue, displacement"),
    "rate": (["--rate", "0"], "--rate 0: give 0.1 to 1000 frames per second"),
}


@pytest.mark.parametrize("wrong", REFUSED)
def test_what_cannot_be_is_said_in_one_sentence(known, monkeypatch, tmp_path, capsys, wrong):
    options, message = REFUSED[wrong]
    options = options if "--format" in options else ["--format", "mp4", *options]
    assert call(monkeypatch, known.folder, *options, "-o", tmp_path) == 2
    said = capsys.readouterr().err
    assert re.search(message, said) and said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_folder_without_a_repository_is_refused(tmp_path, monkeypatch, capsys):
    assert call(monkeypatch, tmp_path, "--format", "mp4") == 2
    assert "is not a repository: give the folder that a run made" in capsys.readouterr().err


@pytest.mark.parametrize("name, package", [("nifti", "nibabel"), ("dicom", "pydicom")])
def test_missing_package_is_said_with_what_to_install(known, monkeypatch, tmp_path, capsys, name, package):
    monkeypatch.setitem(sys.modules, package, None)
    assert call(monkeypatch, known.folder, "--format", name, "-o", tmp_path) == 2
    assert capsys.readouterr().err == f"echotruth: needs the package {package}: {installation('clinical')}\n"
    assert not list(tmp_path.iterdir())


@pytest.fixture
def copy(known, tmp_path):
    """A copy of the repository, to be damaged."""
    folder = tmp_path / "known"
    shutil.copytree(known.folder, folder, ignore=shutil.ignore_patterns("export"))
    return folder


def test_unfinished_clip_is_left_out_and_named(copy, monkeypatch, capsys, tmp_path):
    (copy / f"known.zarr/clips/heart/long/bmode/{SIZES[0]}/zarr.json").unlink()
    assert call(monkeypatch, copy, "--format", "gif", "-o", tmp_path / "out") == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == [str(tmp_path / f"out/heart_mid_{SIZES[0]}.gif")]
    assert "left out 1 that are not finished, first:" in said.err and "no bmode of heart long yet" in said.err
    assert call(monkeypatch, copy, "--format", "gif", "--case", "heart", "-o", tmp_path / "out") == 2


def test_heart_that_failed_is_refused(copy, monkeypatch, capsys):
    metadata.write(copy / "known.zarr/hearts/heart", {"status": "failed", "reason": "no equilibrium"})
    assert call(monkeypatch, copy, "--format", "mp4") == 2
    assert f"heart of {copy} is failed: no equilibrium" in capsys.readouterr().err


def test_lost_images_are_an_error_and_not_a_black_video(copy, monkeypatch, capsys, tmp_path):
    shutil.rmtree(copy / f"known.zarr/clips/heart/mid/bmode/{SIZES[0]}/image")
    assert call(monkeypatch, copy, "--format", "mp4", "-o", tmp_path / "out") == 2
    assert f"cannot be read at heart_mid_{SIZES[0]}: see what echotruth check" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("name", ["mp4", "tap"])
def test_heart_without_a_row_is_told_in_one_sentence(copy, monkeypatch, capsys, tmp_path, name):
    table = (copy / "cases.csv").read_text()
    (copy / "cases.csv").write_text(table.replace("\nheart,", "\nother,"))
    assert call(monkeypatch, copy, "--format", name, "-o", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert "case = 'heart': use one of other" in said and said.count("\n") == 1


def test_failure_half_way_leaves_nothing_new_and_what_was_there(known, monkeypatch, tmp_path):
    def fail(*_):
        (tmp_path / "reached").touch()
        raise OSError(28, "No space left on device")

    work = Export(Repository(known.folder), "png", views=["mid"], output=tmp_path / "out")
    (folder,) = work.write(work.clips()[0])
    before = sorted(path.name for path in folder.iterdir())
    monkeypatch.setattr(png, "pictures", fail)
    with pytest.raises(OSError, match="No space left"):
        list(work.write(work.clips()[0]))
    assert (tmp_path / "reached").exists() and [path.name for path in folder.parent.iterdir()] == [folder.name]
    assert sorted(path.name for path in folder.iterdir()) == before
    monkeypatch.undo()
    monkeypatch.setattr(png, "pictures", fail)
    assert call(monkeypatch, known.folder, "--format", "png", "-o", tmp_path / "out") == 2


def test_folder_with_other_files_is_never_replaced(tmp_path):
    (tmp_path / "clip").mkdir()
    (tmp_path / "clip/thesis.tex").write_text("mine")
    with (
        pytest.raises(ExportError, match=r"holds something else \(thesis.tex\)"),
        destination.draft(tmp_path / "clip") as draft,
    ):
        draft.mkdir()
        (draft / "frame_000.png").touch()
    assert (tmp_path / "clip/thesis.tex").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["clip"]


def test_folder_that_cannot_be_renamed_leaves_the_earlier_one(tmp_path, monkeypatch):
    def fill(text):
        with destination.draft(tmp_path / "clip") as draft:
            draft.mkdir()
            (draft / "a.png").write_text(text)
            return draft

    fill("first")
    rename = Path.replace

    def interrupted(path, target):
        if path.name.startswith(".partial") and not path.name.endswith(".old"):
            raise KeyboardInterrupt
        return rename(path, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fill("second")
    assert [path.name for path in tmp_path.iterdir()] == ["clip"]
    assert (tmp_path / "clip/a.png").read_text() == "first"


def test_draft_is_replaced_with_fewer_files(tmp_path):
    for count in (3, 1):
        with destination.draft(tmp_path / "clip") as draft:
            draft.mkdir()
            for number in range(count):
                (draft / f"{number}.png").touch()
        assert len(list((tmp_path / "clip").iterdir())) == count


@pytest.mark.slow
def test_sweep_gives_a_file_for_each_heart(monkeypatch, tmp_path):
    folder = finished_repository.finish(tmp_path / "small", finished_repository.configured())
    cases = [case.id for case in expand(finished_repository.configured())]
    assert len(cases) == 2
    assert call(monkeypatch, folder, "--format", "gif", "--view", "mid", "-o", tmp_path / "all") == 0
    assert {path.name for path in (tmp_path / "all").iterdir()} == {f"{case}_mid_64.gif" for case in cases}
    assert call(monkeypatch, folder, "--format", "vtk", "--case", cases[1], "-o", tmp_path / "one") == 0
    assert [path.name for path in (tmp_path / "one").iterdir()] == [cases[1]]


def test_video_that_ffmpeg_gave_up_is_an_error(known, monkeypatch, tmp_path, capsys):
    def gives_up(path, *_, **__):
        Path(path).write_bytes(b"half")
        while True:
            yield

    monkeypatch.setattr("imageio_ffmpeg.write_frames", gives_up)
    assert call(monkeypatch, known.folder, "--format", "mp4", "-o", tmp_path) == 2
    assert "the video could not be written: the folder must have space" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_interruption_says_so_and_leaves_whole_files(known, monkeypatch, tmp_path, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(png, "pictures", interrupt)
    assert call(monkeypatch, known.folder, "--format", "png", "-o", tmp_path) == 2
    assert capsys.readouterr().err == "echotruth: interrupted; the files that were named are whole\n"
    assert not list(tmp_path.iterdir())
