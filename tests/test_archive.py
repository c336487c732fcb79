"""An archive of a folder has the same bytes whatever its times, and is unpacked once, as a whole."""

import os
import shutil

import pytest

from echotruth.archive import pack, unpacked


@pytest.fixture
def archive(tmp_path):
    folder = tmp_path / "folder"
    (folder / "deep/er").mkdir(parents=True)
    (folder / "one").write_bytes(b"1" * 1000)
    (folder / "deep/er/two").write_bytes(b"2")
    (folder / "left out").write_bytes(b"3")
    pack(tmp_path / "it.zip", folder, "one", "deep")
    return tmp_path / "it.zip"


def test_same_files_give_the_same_bytes_whatever_their_times_and_modes(archive, tmp_path):
    before, one = archive.read_bytes(), tmp_path / "folder/one"
    os.utime(one, (1e9, 1e9))
    one.chmod(0o600)
    pack(archive, tmp_path / "folder", "deep", "one")
    assert archive.read_bytes() == before
    one.write_bytes(b"1" * 999 + b"2")
    pack(archive, tmp_path / "folder", "deep", "one")
    assert archive.read_bytes() != before


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


WHOLE = {"one": b"1" * 1000, "deep/er/two": b"2"}


def test_it_is_unpacked_once(archive, tmp_path):
    folder = unpacked(archive, tmp_path)
    assert folder.parent == tmp_path and contents(folder) == WHOLE
    before = folder.stat().st_mtime_ns, folder.stat().st_ino
    assert unpacked(archive, tmp_path) == folder and (folder.stat().st_mtime_ns, folder.stat().st_ino) == before


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: (folder / "deep/er/two").unlink(),
        lambda folder: (folder / "one").write_bytes(b""),
        lambda folder: (folder / "one").write_bytes(b"1" * 999 + b"2"),
        shutil.rmtree,
        lambda folder: folder.rename(folder.with_name(f".{folder.name}.partial")),  # where a process was killed
    ],
)
def test_what_is_damaged_or_half_unpacked_is_unpacked_anew(archive, tmp_path, damage):
    folder = unpacked(archive, tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    damage(folder)
    assert unpacked(archive, tmp_path) == folder and contents(folder) == WHOLE
    assert {path.name for path in tmp_path.iterdir()} == before


def test_another_archive_of_that_name_has_another_folder(archive, tmp_path):
    folder = unpacked(archive, tmp_path)
    pack(archive, tmp_path / "folder", "one")
    assert contents(unpacked(archive, tmp_path)) == {"one": WHOLE["one"]} and contents(folder) == WHOLE
