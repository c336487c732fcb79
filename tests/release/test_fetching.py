"""A release is fetched from a folder and from a web server, goes on where it broke off, and names what is damaged."""

import threading
from functools import partial
from hashlib import sha256
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from shutil import copytree
from zipfile import ZipFile

import pytest

import echotruth as et
from echotruth.release.parts import registry, table, write_parts
from echotruth.repository.check import check
from echotruth.repository.fetching import PARTS, REGISTRY, FetchError

LIMIT = 3_000_000


def files(folder: Path) -> dict[str, str]:
    """Path -> checksum of every file below a folder."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest() for path in found}


def write_release(folder: Path) -> Path:
    """Parts, table and registry of the shipped repository."""
    folder.mkdir()
    found = write_parts(et.sample(), folder, LIMIT)
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
        "sample-clips-0001.zip",
        "sample-hearts-0001.zip",
        "sample-hearts-0002.zip",
        "sample-structure.zip",
    ]
    assert all(path.stat().st_size < 1.05 * LIMIT for path in parts)
    held = [name for path in parts if "clips" not in path.name for name in ZipFile(path).namelist()]
    assert sorted(held) == sorted(f"sample/{name}" for name in files(et.sample().folder))
    again = write_release(tmp_path / "again")
    assert files(again) == files(released)


def test_heart_larger_than_a_part_is_split_between_its_jobs(tmp_path):
    parts = write_parts(et.sample(), tmp_path, 1_500_000)
    hearts = [part for part in parts if part.holds == "hearts"]
    assert all(part.size <= 1_500_000 for part in hearts)
    assert [len(part.cases) for part in hearts] == [1] * len(hearts) and len(hearts) > 2
    assert {case for part in hearts for case in part.cases} == {"healthy", "infarct"}


def test_folder_gives_back_the_same_bytes(released, tmp_path):
    fetched = et.fetch(released, to=tmp_path / "here")
    assert files(fetched.folder) == files(et.sample().folder)
    assert check(fetched.folder, quick=True).faults == []
    assert not list((tmp_path / "here").rglob("*.zip"))


def test_one_heart_comes_without_the_parts_of_others(server, tmp_path):
    fetched = et.fetch(server.address, cases=["infarct"], to=tmp_path)
    assert "sample-hearts-0001.zip" not in server.asked and "sample-clips-0001.zip" not in server.asked
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


def rewritten(released: Path, folder: Path, name: str, content: bytes) -> Path:
    """A copy of the release in which a file is another one, and its registry knows it."""
    copy = copytree(released, folder)
    old = sha256((copy / name).read_bytes()).hexdigest()
    (copy / name).write_bytes(content)
    if name != REGISTRY:
        known = (copy / REGISTRY).read_text()
        (copy / REGISTRY).write_text(known.replace(old, sha256(content).hexdigest()))
    return copy


def test_hostile_release_writes_nothing_elsewhere(released, tmp_path):
    evil = b"part,holds,case\n../evil.zip,structure,\n"
    copy = rewritten(released, tmp_path / "names/copy", PARTS, evil)
    (copy / REGISTRY).write_text((copy / REGISTRY).read_text() + f"../evil.zip sha256:{'0' * 64}\n")
    with pytest.raises(FetchError, match=r"has no file '\.\./evil\.zip'"):
        et.fetch(copy, to=tmp_path / "names/here")
    with ZipFile(tmp_path / "members.zip", "w") as archive:
        archive.writestr("../../outside.txt", "x")
    copy = rewritten(
        released, tmp_path / "members/copy", "sample-structure.zip", (tmp_path / "members.zip").read_bytes()
    )
    with pytest.raises(FetchError, match="hold no repository"):
        et.fetch(copy, to=tmp_path / "members/deep/here")
    assert [path.parent.name for path in tmp_path.rglob("outside.txt")] == ["here"]


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        (REGISTRY, b"\xff\xfe\x00", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"one two three four\n", "registry.txt: is not the registry of a release"),
        (REGISTRY, b"", "has no file 'parts.csv': the release is not whole"),
        (PARTS, b"a,b\n1,2\n", "parts.csv: is not the table of a release"),
        (PARTS, b"", "parts.csv: is not the table of a release"),
        ("sample-structure.zip", b"no archive", "is not a part of a release"),
    ],
)
def test_what_is_no_release_is_refused_in_one_sentence(released, tmp_path, name, content, sentence):
    copy = rewritten(released, tmp_path / "copy", name, content)
    with pytest.raises(FetchError) as told:
        et.fetch(copy, to=tmp_path / "here")
    assert sentence in str(told.value) and "\n" not in str(told.value)


def test_address_at_which_nothing_is_is_told_in_one_sentence(server, tmp_path, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda _: None)
    for source in (f"{server.address}/absent", "http://127.0.0.1:9", tmp_path / "absent"):
        with pytest.raises(FetchError) as told:
            et.fetch(source, to=tmp_path / "here")
        assert f"{source}/{REGISTRY}: " in str(told.value) and "\n" not in str(told.value)
