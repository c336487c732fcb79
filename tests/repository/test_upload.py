"""Upload of a repository to a bucket of a server on the own machine, and reading it there."""

import json
import logging
import os
import time
from contextlib import redirect_stderr, redirect_stdout
from hashlib import sha256
from io import StringIO
from unittest.mock import patch
from uuid import uuid4

import pytest
import xarray as xr
import zarr
from finished_repository import configured, finish

import echotruth as et
from echotruth.cli import main
from echotruth.repository import durable, ledger
from echotruth.repository.checksums import checksums
from echotruth.repository.ledger import record_path
from echotruth.repository.remote import Remote, RemoteError, hierarchy
from echotruth.repository.upload import Upload
from echotruth.workflow import uploading as following
from echotruth.workflow.uploading import NOT_UPLOADED, upload_repository, uploading

pytest.importorskip("obstore")
server_module = pytest.importorskip("moto.server")

VARIABLES = {"AWS_ACCESS_KEY_ID": "some", "AWS_SECRET_ACCESS_KEY": "secret", "AWS_REGION": "us-east-1"}


class Bucket:
    """A bucket, read and changed by a library that is not the one that fills it."""

    def __init__(self, endpoint, name):
        import boto3

        self._name, self.url = name, f"s3://{name}/some/where"
        self._client = boto3.client("s3", endpoint_url=endpoint)
        self._client.create_bucket(Bucket=name)

    def _object(self, name):
        return {"Bucket": self._name, "Key": f"some/where/{name}"}

    def names(self):
        """Path below the folder -> time of the last change of every object."""
        pages = self._client.get_paginator("list_objects_v2").paginate(Bucket=self._name, Prefix="some/where/")
        entries = (entry for page in pages for entry in page.get("Contents", []))
        return {entry["Key"].removeprefix("some/where/"): entry["LastModified"] for entry in entries}

    def get(self, name):
        return self._client.get_object(**self._object(name))["Body"].read()

    def put(self, name, data, **metadata):
        self._client.put_object(**self._object(name), Body=data, Metadata=metadata)

    def metadata(self, name):
        return self._client.head_object(**self._object(name))["Metadata"]

    def content(self):
        """Path -> hash of every object."""
        return {name: sha256(self.get(name)).hexdigest() for name in self.names()}


@pytest.fixture(scope="module")
def endpoint():
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = server_module.ThreadedMotoServer("127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with patch.dict(os.environ, VARIABLES | {"AWS_ENDPOINT_URL": f"http://{host}:{port}"}):
        yield f"http://{host}:{port}"
    server.stop()


@pytest.fixture
def bucket(endpoint):
    return Bucket(endpoint, f"bucket-{uuid4().hex}")


def commit(folder, stage, case, **content):
    """Do a job of some files, as the stages do: the files, then the record."""
    hierarchy = folder / "small.zarr"
    files = {hierarchy / f"{stage}/{name}/c/{case}": data for name, data in content.items()}
    record_path(folder, stage, case).unlink(missing_ok=True)
    durable.write_all(files)
    ledger.commit(record_path(folder, stage, case), {"sha256": checksums(list(files), hierarchy)})


def lay_out(folder):
    """What is there before any job: structure, registry and configuration."""
    hierarchy, structure = folder / "small.zarr", {"zarr.json": b"{}", "bmode/image/zarr.json": b"{ }"}
    durable.write_all({hierarchy / name: data for name, data in structure.items()})
    sums = checksums([hierarchy / name for name in structure], hierarchy)
    ledger.commit(folder / "ledger/structure.json", {"sha256": sums})
    durable.write_all({folder / "config.yaml": b"name: small\n", folder / "registry.txt": b"0\n1\n2\n"})


@pytest.fixture
def repository(tmp_path):
    """A repository of three hearts and two stages."""
    folder = tmp_path / "small"
    lay_out(folder)
    for case in "012":
        commit(folder, "mechanics", case, displacement=b"%s moves" % case.encode(), volume=b"%s" % case.encode())
        commit(folder, "bmode", case, image=b"%s looks" % case.encode())
    durable.write(folder / "figures/leaderboard.csv", b"all of them\n")
    for unwanted in (".lease/1", "scratch/0/checkpoint.json", "logs/snakemake.log"):
        durable.write(folder / unwanted, b"not to go up")
    return folder


def files(folder):
    """Path -> hash of every file that is to go up."""
    paths = [path for path in folder.rglob("*") if path.is_file()]
    names = {path.relative_to(folder).as_posix(): path for path in paths}
    wanted = {name: path for name, path in names.items() if not name.startswith((".", "scratch/", "logs/"))}
    return {name: sha256(path.read_bytes()).hexdigest() for name, path in wanted.items()}


def cli(*arguments):
    """Status, output and errors of the command."""
    output, errors = StringIO(), StringIO()
    command = patch("sys.argv", ["echotruth", *map(str, arguments)])
    with redirect_stdout(output), redirect_stderr(errors), command, pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, output.getvalue(), errors.getvalue()


def test_all_files_are_there_with_the_bytes_of_those_here(bucket, repository):
    status, output, _ = cli("upload", repository, bucket.url, "--verify")
    assert status == 0
    here = files(repository)
    assert bucket.content() == here
    assert f"{len(here)} files; sent: {len(here)}," in output
    assert f"read back all {len(here)} files; each is the same as here" in output


def test_what_is_there_is_not_sent_again_and_what_changed_is(bucket, repository):
    cli("upload", repository, bucket.url)
    before = bucket.names()
    damaged = "small.zarr/bmode/image/c/2"
    bucket.put(damaged, b"not by us")
    (repository / "config.yaml").write_bytes((repository / "config.yaml").read_bytes() + b"# more\n")
    time.sleep(1.1)  # times of the server are whole seconds
    status, output, _ = cli("upload", repository, bucket.url)
    assert status == 0 and "sent: 2," in output
    after = bucket.names()
    assert bucket.content() == files(repository)
    assert {name for name in after if after[name] != before[name]} == {damaged, "config.yaml"}


def test_a_record_is_there_only_after_all_for_which_it_vouches(bucket, repository, monkeypatch):
    """Wherever the upload breaks off; and the next one sends just the rest."""
    put, sent, allowed = Remote.put, [], [0]

    def breaking(self, name, data):
        if len(sent) >= allowed[0]:
            raise RemoteError("broken off")
        put(self, name, data)
        sent.append(name)

    monkeypatch.setattr(Remote, "put", breaking)
    total = len(files(repository))
    for number in range(0, total, 3):
        allowed[0] = number
        with pytest.raises(RemoteError):
            Upload(repository, Remote(bucket.url)).send()
        there = bucket.names()
        for record in (name for name in there if name.startswith("ledger/")):
            assert {f"small.zarr/{name}" for name in json.loads(bucket.get(record)).get("sha256", {})} <= set(there)
    allowed[0] = total
    Upload(repository, Remote(bucket.url)).send()
    assert bucket.content() == files(repository)
    assert len(sent) == len(set(sent)) == total


def test_the_record_of_a_job_that_is_done_again_goes_first_and_comes_last(bucket, repository, monkeypatch):
    upload = Upload(repository, Remote(bucket.url))
    upload.send()
    commit(repository, "mechanics", "1", displacement=b"moves otherwise", volume=b"other")
    record, put, order = "ledger/mechanics/1.json", Remote.put, []

    def noting(self, name, data):
        order.append((name, record in bucket.names()))
        put(self, name, data)

    monkeypatch.setattr(Remote, "put", noting)
    upload.send()
    shards = {f"small.zarr/mechanics/{name}/c/1" for name in ("displacement", "volume")}
    assert {name for name, _ in order[:-1]} == shards and order[-1][0] == record
    assert not any(is_there for _, is_there in order)
    assert bucket.content() == files(repository)


def test_a_file_that_is_damaged_here_is_told_and_its_record_does_not_go_up(bucket, repository):
    shard = repository / "small.zarr/bmode/image/c/1"
    shard.write_bytes(b"damaged")
    status, _, errors = cli("upload", repository, bucket.url)
    assert status == 1
    assert errors.count("\n") == 1 and f"{shard}: is missing or differs from what was written" in errors
    assert set(files(repository)) - set(bucket.names()) == {"ledger/bmode/1.json", "small.zarr/bmode/image/c/1"}


def test_what_was_changed_there_is_found_when_it_is_read_back_and_sent_again(bucket, repository):
    cli("upload", repository, bucket.url)
    name = "registry.txt"
    bucket.put(name, b"other", **bucket.metadata(name))  # as if the content alone had changed
    assert cli("upload", repository, bucket.url)[0] == 0
    status, output, _ = cli("upload", repository, bucket.url, "--verify")
    assert status == 0 and f"{bucket.url}/{name}: differed from {repository / name}, and was sent again" in output
    assert bucket.content() == files(repository)


def test_another_repository_there_is_left_alone(bucket, repository):
    bucket.put("other.zarr/zarr.json", b"{}")
    status, _, errors = cli("upload", repository, bucket.url)
    assert status == 2 and "holds another repository, other.zarr" in errors
    assert list(bucket.names()) == ["other.zarr/zarr.json"]


def test_it_is_read_there_as_it_is_here(bucket, tmp_path):
    made = finish(tmp_path / "small", configured(seeds=(1,), views=("mid",)))
    cli("upload", made, bucket.url)
    there = [et.Repository(address).tree for address in (bucket.url, f"{bucket.url}/", f"{bucket.url}/small.zarr")]
    assert len({tuple(tree.groups) for tree in there}) == 1
    xr.testing.assert_identical(there[0]["bmode"].load(), et.Repository(made).tree["bmode"].load())
    xr.testing.assert_identical(there[0]["cases"].load(), et.Repository(made).tree["cases"].load())
    image = zarr.open_array(hierarchy(bucket.url)[1], path="bmode/64/image", mode="r")
    assert (image[...] == zarr.open_array(made / "small.zarr", path="bmode/64/image", mode="r")[...]).all()
    distant, near = et.Repository(bucket.url), et.Repository(made)
    for group in ("bmode/64", "truth/64", "phantom"):
        read = distant.arrays(group, near.present[0], "mid"), near.arrays(group, near.present[0], "mid")
        assert read[0].keys() == read[1].keys()
        assert all(read[0][name].tobytes() == read[1][name].tobytes() for name in read[0])
    assert distant.scores.equals(near.scores) and distant.cases.equals(near.cases)


def test_no_repository_there_is_an_error_in_a_sentence(bucket):
    with pytest.raises(FileNotFoundError, match="is not a repository: give an address"):
        et.Repository(bucket.url)


def test_what_a_run_commits_goes_up_while_it_runs(bucket, tmp_path, monkeypatch):
    monkeypatch.setattr(following, "POLL_SECONDS", 0.05)
    folder = tmp_path / "small"
    with uploading(folder, Remote(bucket.url)) as upload:
        lay_out(folder)
        for case in "01":
            commit(folder, "mechanics", case, displacement=case.encode())
            end = time.monotonic() + 30
            while f"ledger/mechanics/{case}.json" not in bucket.names() and time.monotonic() < end:
                time.sleep(0.05)
            assert bucket.get(f"small.zarr/mechanics/displacement/c/{case}") == case.encode()
        commit(folder, "mechanics", "2", displacement=b"2")
        assert upload.finish() == 0
    assert bucket.content() == files(folder)


def test_a_bucket_that_cannot_be_reached_fails_the_status_of_the_run_and_nothing_else(repository, monkeypatch, capsys):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    before = files(repository)
    for variable, value in VARIABLES.items():
        monkeypatch.setenv(variable, value)
    with uploading(repository, Remote("s3://bucket/small")) as upload:
        assert upload.finish() == NOT_UPLOADED
    output, errors = capsys.readouterr()
    assert not output and errors.count("\n") == 1
    assert (
        "not uploaded: s3://bucket/small: " in errors and f"echotruth upload {repository} s3://bucket/small" in errors
    )
    assert files(repository) == before


def test_a_run_that_is_interrupted_does_not_wait_for_the_upload(bucket, repository):
    with pytest.raises(KeyboardInterrupt), uploading(repository, Remote(bucket.url)):
        raise KeyboardInterrupt
    assert not bucket.names()


@pytest.mark.parametrize("works, expected", [(True, 0), (False, NOT_UPLOADED)])
def test_the_command_run_uploads_and_its_status_says_whether(bucket, tmp_path, monkeypatch, works, expected):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.yaml").write_text("name: small\n")
    url = bucket.url if works else "s3://nowhere/small"

    def make(*_):
        lay_out(tmp_path / "out/small")
        commit(tmp_path / "out/small", "mechanics", "0", displacement=b"0")
        return 0

    with patch("echotruth.workflow.snakemake_process.execute", make), patch("echotruth.repository.layout.lay_out"):
        status, output, errors = cli("run", "my.yaml", "--cores", "1", "--upload", url)
    assert status == expected, errors
    if works:
        assert bucket.content() == files(tmp_path / "out/small") and f"Uploaded:   {url}" in output
    else:
        assert "The specified bucket does not exist" in errors and "Traceback" not in errors
        assert (tmp_path / "out/small/ledger/mechanics/0.json").is_file()


@pytest.mark.parametrize("url", ["bucket/small", "ftp://bucket/small", "s3://", "s3:///small", "s3://a b"])
def test_an_address_that_is_none_is_refused_before_anything_is_made(url, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.yaml").write_text("name: small\n")
    status, output, errors = cli("run", "my.yaml", "--upload", url)
    assert (status, output) == (2, "") and f"{url}: is not an address" in errors
    assert not (tmp_path / "out").exists()


def test_without_the_package_the_extra_is_named(repository, capsys):
    with patch.dict("sys.modules", {"obstore": None}):
        assert upload_repository(repository, "s3://bucket/small", False) == 2
    assert "pip install 'echotruth[s3]'" in capsys.readouterr().err
