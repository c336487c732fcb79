"""A release is fetched from a folder and from a web server, goes on where it broke off, and names what is damaged."""

import threading
from contextlib import suppress
from errno import ENOSPC
from functools import partial
from hashlib import sha256
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from shutil import copytree
from stat import S_IFCHR, S_IFIFO, S_IFLNK
from struct import pack
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import pytest
from finished_repository import configured, finish

import echotruth as et
from echotruth.repository.check import check
from echotruth.sharing.fetching import PARTS, REGISTRY, FetchError
from echotruth.sharing.release.parts import registry, table, write_parts

LIMIT = 3_700_000


def files(folder: Path) -> dict[str, str]:
    """Path -> checksum of every file below a folder, but for settings of jobs and locks, which no release has."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    found = {name: path for name, path in found.items() if not name.startswith(("cases/", "."))}
    return {name: sha256(path.read_bytes()).hexdigest() for name, path in found.items()}


def write_release(folder: Path, repository: str | Path = "sample", limit: int = LIMIT) -> Path:
    """Parts, table and registry of a repository, the shipped one if no other is given."""
    folder.mkdir()
    found = write_parts(et.Repository(repository), folder, limit)
    (folder / PARTS).write_bytes(table(found))
    (folder / REGISTRY).write_bytes(registry(found, {PARTS: table(found)}))
    return folder


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    return write_release(tmp_path_factory.mktemp("release") / "files")


class Handler(SimpleHTTPRequestHandler):
    """A web server that keeps a list of what it was asked for, and breaks off in the middle of some files."""

    def do_GET(self):
        self.server.asked.append(self.path.strip("/"))
        if self.path.strip("/") not in self.server.breaking:
            return super().do_GET()
        content = Path(self.directory, self.path.strip("/")).read_bytes()
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content[: len(content) // 2])
        self.close_connection = True

    def log_message(self, *_):
        pass


@pytest.fixture
def server(released):
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(released))) as served:
        served.asked, served.breaking = [], set()
        thread = threading.Thread(target=served.serve_forever)
        thread.start()
        served.address = f"http://127.0.0.1:{served.server_port}"
        yield served
        served.shutdown()
        thread.join()


def test_parts_hold_every_file_once_and_are_as_large_as_they_may_be(released, tmp_path):
    parts = sorted(released.glob("*.zip"))
    assert [path.name for path in parts] == [
        "sample-hearts-0001.zip",
        "sample-hearts-0002.zip",
        "sample-structure.zip",
    ]
    assert all(path.stat().st_size < 1.05 * LIMIT for path in parts)
    held = [name for path in parts for name in ZipFile(path).namelist()]
    assert sorted(held) == sorted(f"sample/{name}" for name in files(et.sample().folder))
    again = write_release(tmp_path / "again")
    assert files(again) == files(released)


def test_heart_larger_than_a_part_is_split_between_its_folders(tmp_path):
    parts = write_parts(et.sample(), tmp_path, 1_500_000)
    hearts = [part for part in parts if part.holds == "hearts"]
    assert all(part.size <= 1_500_000 for part in hearts)
    assert [len(part.cases) for part in hearts] == [1] * len(hearts) and len(hearts) > 2
    assert {case for part in hearts for case in part.cases} == {"healthy", "infarct"}


def test_heart_that_cases_share_is_held_once_and_comes_with_each(tmp_path):
    folder = finish(tmp_path / "small", configured(views=("mid",)))
    before = files(folder)
    copytree(folder / "small.zarr/clips/heart", folder / "small.zarr/clips/gone")  # of a case that is no more
    released, (first, second) = write_release(tmp_path / "files", folder, 10), et.Repository(folder).present
    rows = [line.split(",")[::2] for line in (released / PARTS).read_text().splitlines() if ",hearts," in line]
    owners = [first, second, first, second]  # of the heart, of the clips
    assert rows == [[f"small-hearts-000{part}.zip", owner] for part, owner in zip("1123", owners, strict=True)]
    fetched = et.fetch(released, cases=[second], to=tmp_path / "here")
    assert fetched.heart(second).displacement.any() and fetched.clip(second, "mid")["image"].any()
    with pytest.raises(ValueError, match=f"has no group clips/{first}"):
        fetched.clip(first, "mid")
    assert files(et.fetch(released, to=tmp_path / "here").folder) == before


def test_folder_gives_back_the_same_bytes(released, tmp_path):
    fetched = et.fetch(released, to=tmp_path / "here")
    assert files(fetched.folder) == files(et.sample().folder)
    assert check(fetched.folder, quick=True).faults == []
    assert not list((tmp_path / "here").rglob("*.zip"))


def test_one_heart_comes_without_the_parts_of_others(server, tmp_path):
    fetched = et.fetch(server.address, cases=["infarct"], to=tmp_path)
    assert "sample-hearts-0001.zip" not in server.asked
    ours = et.sample().clip("infarct", "mid")
    assert fetched.clip("infarct", "mid").equals(ours)
    with pytest.raises(ValueError, match="healthy"):
        fetched.clip("healthy", "mid")
    with pytest.raises(ValueError, match="case = 'heart': use one of healthy, infarct"):
        et.fetch(server.address, cases=["heart"], to=tmp_path)


def test_what_broke_off_goes_on_with_the_part_that_was_under_way(server, tmp_path, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _: None)  # between the attempts
    server.breaking = {"sample-hearts-0002.zip"}
    with pytest.raises(FetchError, match=r"sample-hearts-0002\.zip: cannot be had .* the same call goes on"):
        et.fetch(server.address, to=tmp_path)
    assert server.asked.count("sample-hearts-0002.zip") == 3
    server.breaking, server.asked = set(), []
    fetched = et.fetch(server.address, to=tmp_path)
    assert server.asked == [REGISTRY, "sample-hearts-0002.zip"]
    assert files(fetched.folder) == files(et.sample().folder)


def test_one_folder_takes_two_releases_and_does_not_take_one_for_the_other(server, released, tmp_path, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _: None)
    et.fetch(released, cases=["healthy"], to=tmp_path)
    server.breaking = {REGISTRY}
    with pytest.raises(FetchError, match=r"registry\.txt: cannot be had"):
        et.fetch(server.address, cases=["healthy"], to=tmp_path)


def test_what_is_there_needs_no_server(server, tmp_path, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _: None)
    et.fetch(server.address, cases=["healthy"], to=tmp_path)
    server.breaking = {REGISTRY}
    fetched = et.fetch(server.address, cases=["healthy"], to=tmp_path)
    assert fetched.clip("healthy", "mid")["image"].shape == (10, 256, 256)


@pytest.mark.parametrize("place", ["folder", "server"])
def test_damaged_part_is_named_in_one_sentence(released, server, tmp_path, monkeypatch, place):
    monkeypatch.setattr("time.sleep", lambda _: None)
    copy = copytree(released, tmp_path / "copy")
    part = copy / "sample-hearts-0001.zip"
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(content)
    server.RequestHandlerClass = partial(Handler, directory=str(copy))
    source = copy if place == "folder" else server.address
    with pytest.raises(FetchError) as told:
        et.fetch(source, to=tmp_path / "here")
    said = "is damaged, its SHA-256 is not that of registry.txt: fetch it again, or tell those who published it"
    assert str(told.value) == f"{source}/{part.name}: {said}"
    assert not list((tmp_path / "here").rglob("mechanics/displacement/c/*"))


def rewrite(release: Path, name: str, content: bytes) -> Path:
    """Replace a file of a release, and its checksum in the registry; or add one."""
    (release / name).write_bytes(content)
    if name != REGISTRY:
        known = [line for line in (release / REGISTRY).read_text().splitlines() if not line.startswith(f"{name} ")]
        known.append(f"{name} sha256:{sha256(content).hexdigest()}")
        (release / REGISTRY).write_text("".join(f"{line}\n" for line in known))
    return release


def test_hostile_release_writes_nothing_elsewhere(released, tmp_path):
    evil = b"part,holds,case\n../evil.zip,structure,\n"
    copy = rewrite(copytree(released, tmp_path / "names/copy"), PARTS, evil)
    (copy / REGISTRY).write_text((copy / REGISTRY).read_text() + f"../evil.zip sha256:{'0' * 64}\n")
    with pytest.raises(FetchError, match=r"has no file '\.\./evil\.zip'"):
        et.fetch(copy, to=tmp_path / "names/here")


def archived(*files: tuple[str, str | bytes, int]) -> bytes:
    """Archive of files, each of which has a name, a content and a mode."""
    stream = BytesIO()
    with ZipFile(stream, "w") as archive:
        for name, content, mode in files:
            about = ZipInfo(name)
            about.external_attr = mode << 16
            archive.writestr(about, content)
    return stream.getvalue()


WHOLE = ("sample/config.yaml", "name: sample", 0o644)
CUT_OFF = archived(WHOLE).replace(pack("<II", 12, 12), pack("<II", 2**20, 2**20))
"""Archive whose file is said to be longer than all of it."""


@pytest.mark.parametrize(
    "files",
    [
        [("../outside.txt", "x", 0o644)],
        [("/outside.txt", "x", 0o644)],
        [("outside.txt", "x", 0o644)],
        [(".git/hooks/outside.txt", "x", 0o755)],
        [("sample2/outside.txt", "x", 0o644)],
        [("sample", "x", 0o644)],
    ],
)
def test_hostile_archive_is_refused_before_anything_of_it_is_written(released, tmp_path, files):
    copy = rewrite(copytree(released, tmp_path / "copy"), "sample-structure.zip", archived(WHOLE, *files))
    with pytest.raises(FetchError, match=r"sample-structure\.zip: is not a part of a release") as told:
        et.fetch(copy, to=tmp_path / "deep/here")
    assert "\n" not in str(told.value)
    assert [path.name for path in (tmp_path / "deep/here").iterdir()] == [".release"]
    assert not list(tmp_path.rglob("outside.txt"))


@pytest.mark.parametrize(
    "files",
    [
        [("sample/../inside.txt", "x", 0o644)],
        [("sample/../../inside.txt", "x", 0o644)],
        [("sample/a\nsample/inside.txt", "x", 0o644)],
        [("sample/link", "..", S_IFLNK | 0o777), ("sample/link/inside.txt", "x", 0o644)],
        [("sample/inside.txt", "/etc/hostname", S_IFLNK | 0o777)],
        [("sample/inside.txt", "", S_IFCHR | 0o666)],
        [("sample/inside.txt", "", S_IFIFO | 0o666)],
        [("sample/inside.txt", "x", 0o644), ("sample/inside.txt/y", "y", 0o644)],
    ],
)
def test_odd_members_of_an_archive_are_files_in_the_folder_at_most(released, tmp_path, files):
    copy = rewrite(copytree(released, tmp_path / "copy"), "sample-structure.zip", archived(WHOLE, *files))
    with suppress(FetchError):
        et.fetch(copy, to=tmp_path / "deep/here")
    made = list(tmp_path.rglob("*"))
    assert all(path.is_dir() or path.is_file() for path in made) and not any(path.is_symlink() for path in made)
    assert {path.name for path in (tmp_path / "deep/here").iterdir()} == {".release", "sample"}
    assert {path.name for path in tmp_path.iterdir()} == {"copy", "deep"}


def test_compressed_archive_is_refused(released, tmp_path):
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED) as archive:
        archive.writestr("sample/config.yaml", "name: sample")
    copy = rewrite(copytree(released, tmp_path / "copy"), "sample-structure.zip", stream.getvalue())
    with pytest.raises(FetchError, match="its files are compressed"):
        et.fetch(copy, to=tmp_path / "here")


def test_folder_that_is_there_is_neither_written_over_nor_written_through(released, tmp_path):
    outside, here = tmp_path / "outside", tmp_path / "here"
    outside.mkdir()

    def refused(path: Path) -> None:
        before = files(outside) | files(here / "sample")
        with pytest.raises(FetchError) as told:
            et.fetch(released, to=here)
        remedy = "remove it, or give another folder"
        assert str(told.value) == f"{path}: is there, and this release did not write it: {remedy}"
        assert files(outside) | files(here / "sample") == before

    (here / "sample").mkdir(parents=True)
    (here / "sample/mine.txt").write_text("mine")
    refused(here / "sample")
    (here / "sample").rename(tmp_path / "mine")
    (here / "sample").symlink_to(outside)
    refused(here / "sample")
    (here / "sample").unlink()
    assert files(et.fetch(released, to=here).folder) == files(et.sample().folder)


def test_release_writes_over_what_it_wrote_itself(released, tmp_path, monkeypatch):
    """In an earlier version, and where its unpacking broke off in the middle of a file."""

    def breaks_off(archive: ZipFile, folder: Path) -> None:
        names = archive.namelist()
        archive.extract(names[0], folder)
        (folder / names[0]).write_text("half")
        raise OSError(ENOSPC, "No space left on device")

    copy = copytree(released, tmp_path / "copy")
    with monkeypatch.context() as patch, pytest.raises(FetchError, match="No space left on device"):
        patch.setattr(ZipFile, "extractall", breaks_off)
        et.fetch(copy, to=tmp_path / "here")
    fetched = et.fetch(copy, to=tmp_path / "here")
    assert files(fetched.folder) == files(et.sample().folder)
    with ZipFile(copy / "sample-structure.zip") as archive:
        held = [(name, archive.read(name), 0o644) for name in archive.namelist()]
    new = archived(*((name, b"new" if name == "sample/cases.csv" else content, mode) for name, content, mode in held))
    et.fetch(rewrite(copy, "sample-structure.zip", new), to=tmp_path / "here")
    assert (fetched.folder / "cases.csv").read_text() == "new"


def test_part_does_not_pass_for_the_note_of_what_was_written(released, tmp_path):
    copy = rewrite(copytree(released, tmp_path / "copy"), ".begun-sample", b"")
    rewrite(copy, PARTS, (copy / PARTS).read_bytes() + b".begun-sample,hearts,other\n")
    with pytest.raises(FetchError, match=r"has no file '\.begun-sample'"):
        et.fetch(copy, ["other"], to=tmp_path / "here")


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        (REGISTRY, b"\xff\xfe\x00", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"one two three four\n", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"parts.csv shake_128:00\n", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"parts.csv 'one\n", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"", "has no file 'parts.csv': the release is not whole"),
        (PARTS, b"a,b\n1,2\n", "parts.csv: is not the table of a release"),
        (PARTS, b"", "parts.csv: is not the table of a release"),
        (PARTS, b"part,holds,case\n" + b"x" * 200_000, "parts.csv: is not the table of a release"),
        (PARTS, b"part,holds,case\nsample-hearts-0001.zip,hearts,healthy\n", "its parts hold no repository"),
        ("sample-structure.zip", archived(("sample/x", "x", 0o644)), "its parts hold no repository"),
        ("sample-structure.zip", b"no archive", "is not a part of a release (File is not a zip file)"),
        ("sample-structure.zip", CUT_OFF, "is not a part of a release (it is cut off)"),
    ],
)
def test_what_is_no_release_is_refused_in_one_sentence(released, tmp_path, name, content, sentence):
    copy = rewrite(copytree(released, tmp_path / "copy"), name, content)
    with pytest.raises(FetchError) as told:
        et.fetch(copy, to=tmp_path / "here")
    assert sentence in str(told.value) and "\n" not in str(told.value)


def test_address_at_which_nothing_is_is_told_in_one_sentence(server, tmp_path, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _: None)
    for source in (f"{server.address}/absent", "http://127.0.0.1:9", tmp_path / "absent"):
        with pytest.raises(FetchError) as told:
            et.fetch(source, to=tmp_path / "here")
        assert f"{source}/{REGISTRY}: " in str(told.value) and "\n" not in str(told.value)
        is_asked = str(source).endswith(":9")
        assert ("cannot be had (no connection: see that you are online" in str(told.value)) == is_asked
