"""What is kept in object storage, here a dictionary or a folder in its place: mended, and read by all that read."""

import pickle
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest
from bokeh.document import Document
from finished_repository import configured, finish

import echotruth as et
from echotruth.learning import Clips
from echotruth.repository.remote import Remote
from echotruth.repository.upload import Upload
from echotruth.viewer.choice import first
from echotruth.viewer.page import Page
from echotruth.viewer.server import opened
from echotruth.workflow import uploading

obstore = pytest.importorskip("obstore")
zarr_storage = pytest.importorskip("zarr.storage")


class Bucket:
    """Objects with their content and the checksum that they carry."""

    url = "s3://bucket/small"

    def __init__(self):
        self.objects = {}

    def names(self):
        return iter(list(self.objects))

    def checksum(self, name):
        return self.objects.get(name, (b"", ""))[1]

    def put(self, name, content):
        self.objects[name] = content, sha256(content).hexdigest()

    def get(self, name):
        if name not in self.objects:
            raise FileNotFoundError(name)
        return self.objects[name][0]

    def delete(self, name):
        self.objects.pop(name, None)

    def damage(self, name):
        """As a disk does it: what the object carries stays."""
        self.objects[name] = b"damaged", self.objects[name][1]


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("remote") / "small", configured(seeds=(1,), views=("mid",)))


@pytest.fixture
def bucket(repository):
    found = Bucket()
    Upload(repository, found).send()
    return found


def verified(repository, bucket, monkeypatch):
    monkeypatch.setattr(uploading, "Remote", lambda url: bucket)
    return uploading.upload_repository(repository, bucket.url, True)


@pytest.mark.parametrize("name", ["registry.txt", "small.zarr/bmode/64/image/c/0/0/0/0/0", "ledger/structure.json"])
def test_object_that_is_damaged_there_is_sent_again(repository, bucket, monkeypatch, capsys, name):
    bucket.damage(name)
    assert verified(repository, bucket, monkeypatch) == 0
    assert bucket.get(name) == (repository / name).read_bytes()
    assert f"{bucket.url}/{name}: differed from {repository / name}, and was sent again" in capsys.readouterr().out


def test_object_is_not_replaced_by_a_file_that_is_not_what_was_sent(repository, bucket, monkeypatch, capsys):
    name = "small.zarr/bmode/64/image/c/0/0/0/0/0"
    sent, whole = bucket.get(name), (repository / name).read_bytes()
    (repository / name).write_bytes(b"damaged here")
    try:
        assert verified(repository, bucket, monkeypatch) == 1
    finally:
        (repository / name).write_bytes(whole)
    assert bucket.get(name) == sent
    assert f"{name}: differs from {repository / name}: echotruth check" in capsys.readouterr().err


@pytest.fixture
def address(repository, monkeypatch):
    """An address at which the files of a folder are read as objects."""
    objects = zarr_storage.ObjectStore(obstore.store.LocalStore(repository / "small.zarr"), read_only=True)
    remote = SimpleNamespace(
        get=lambda name: (repository / name).read_bytes(), has=lambda name: (repository / name).is_file()
    )
    monkeypatch.setattr("echotruth.repository.reader.hierarchy", lambda url: (remote, objects))
    return "s3://bucket/small"


def test_learning_reads_an_address_as_a_folder(repository, address):
    assert list(et.learning.cases(address).index) == list(et.learning.cases(repository).index)
    there, here = Clips(address, truth=["displacement"]), Clips(repository, truth=["displacement"])
    assert len(there) == len(here) == 1
    np.testing.assert_array_equal(there[0]["image"], here[0]["image"])


def test_learning_names_the_address_where_something_is_missing(address, repository):
    shard = repository / "small.zarr/bmode/64/image/c/0/0/0/0/0"
    content = shard.read_bytes()
    shard.unlink()
    try:
        with pytest.raises(ValueError, match=r"s3://bucket/small: \w+ has no bmode/64/image in the view mid"):
            Clips(address)
    finally:
        shard.write_bytes(content)


def test_viewer_shows_an_address(address):
    found = opened(address)
    page = Page(found, first(found), Document())
    assert page.choice.view == "mid"


def test_address_is_opened_anew_in_another_process():
    copy = pickle.loads(pickle.dumps(Remote("s3://bucket/small")))
    assert copy.url == "s3://bucket/small"
