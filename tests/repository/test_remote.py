"""What is kept in object storage, here a folder or a server on the own machine, is read by all that read."""

import logging
import pickle
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bokeh.document import Document
from finished_repository import configured, finish

import echotruth as et
from echotruth.extras import installation
from echotruth.learning import Clips
from echotruth.repository.remote import Remote
from echotruth.viewer.choice import first
from echotruth.viewer.page import Page
from echotruth.viewer.server import opened

obstore = pytest.importorskip("obstore")
zarr_storage = pytest.importorskip("zarr.storage")


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("remote") / "small", configured(seeds=(1,), views=("mid",)))


@pytest.fixture
def address(repository, monkeypatch):
    """An address at which the files of a folder are read as objects."""
    objects = zarr_storage.ObjectStore(obstore.store.LocalStore(repository / "small.zarr"), read_only=True)
    remote = SimpleNamespace(get=lambda name: (repository / name).read_bytes())
    monkeypatch.setattr("echotruth.repository.reader.hierarchy", lambda url: (remote, objects))
    return "s3://bucket/small"


def test_learning_reads_an_address_as_a_folder(repository, address):
    assert list(et.learning.cases(address).index) == list(et.learning.cases(repository).index)
    there, here = Clips(address, truth=["displacement"]), Clips(repository, truth=["displacement"])
    assert len(there) == len(here) == 1
    np.testing.assert_array_equal(there[0]["image"], here[0]["image"])


def test_learning_names_the_address_where_something_is_missing(address, repository):
    (group,) = repository.glob("small.zarr/clips/*/mid/bmode/64/zarr.json")
    hidden = group.rename(group.with_name("hidden"))
    try:
        with pytest.raises(ValueError, match=r"s3://bucket/small\b.* bmode\b.* \w+ mid\b"):
            Clips(address)
    finally:
        hidden.rename(group)


def test_viewer_shows_an_address(address):
    found = opened(address)
    page = Page(found, first(found), "", Document())
    assert page.choice.view == "mid"


def test_address_is_opened_anew_in_another_process():
    copy = pickle.loads(pickle.dumps(Remote("s3://bucket/small")))
    assert copy.url == "s3://bucket/small"


@pytest.fixture
def server(monkeypatch):
    """A bucket of a server on the own machine."""
    moto, boto3 = pytest.importorskip("moto.server"), pytest.importorskip("boto3")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # it would print a line for every object
    served = moto.ThreadedMotoServer("127.0.0.1", port=0, verbose=False)
    served.start()
    endpoint = "http://{}:{}".format(*served.get_host_and_port())
    settings = {"ACCESS_KEY_ID": "some", "SECRET_ACCESS_KEY": "secret", "REGION": "us-east-1", "ENDPOINT_URL": endpoint}
    for name, value in settings.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    boto3.client("s3", endpoint_url=endpoint, region_name="us-east-1").create_bucket(Bucket="bucket")
    yield endpoint
    served.stop()


def test_what_was_copied_to_a_bucket_as_the_page_says_is_read_there_as_it_is_here(server, repository):
    with pytest.raises(FileNotFoundError, match="is not a repository: give an address"):
        et.Repository("s3://bucket/hearts")
    (code,) = re.findall(r"```python\n(.*?)```", (Path(__file__).parents[2] / "docs/storage.md").read_text(), re.DOTALL)
    exec(
        code.replace("out/my", str(repository)).replace(
            "from_url(", 'from_url(client_options={"allow_http": True}, url='
        )
    )
    here = et.Repository(repository)
    for place in ("s3://bucket/hearts", "s3://bucket/hearts/", "s3://bucket/hearts/small.zarr"):
        there = et.Repository(place)
        xr.testing.assert_identical(there.tree["clips"].load(), here.tree["clips"].load())
        assert there.cases.equals(here.cases) and there.scores.equals(here.scores)
    case = here.present[0]
    for group in ("bmode/64", "truth/64", "phantom"):
        far, near = there.arrays(group, case, "mid"), here.arrays(group, case, "mid")
        assert far.keys() == near.keys() and all(far[name].tobytes() == near[name].tobytes() for name in far)


@pytest.mark.parametrize("url", ["s3://", "s3:///small", "s3://a b", "ftp://bucket/small"])
def test_address_that_is_none_is_refused_in_a_sentence(url):
    with pytest.raises(OSError, match=r"is not an address in object storage: give s3://BUCKET/FOLDER$"):
        et.Repository(url)


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "obstore", None)
    with pytest.raises(OSError, match=f"needs the package obstore: {re.escape(installation('s3'))}$"):
        et.Repository("s3://bucket/small")
