"""The repository that all exports are read from."""

import pytest
from known_repository import SETTINGS, SIZES, Known, make

from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export, Selection


@pytest.fixture(scope="session")
def known(tmp_path_factory) -> Known:
    return make(tmp_path_factory.mktemp("known") / "known", SETTINGS)


@pytest.fixture
def exported(known, tmp_path):
    """A function that exports a format of one view, and gives the path of the file or folder."""

    def write(name, view="mid", size=SIZES[0], **options):
        work = Export(Repository(known.folder), Selection(["heart"], [view], [size]), name, output=tmp_path, **options)
        (path,) = work.write(work.clips()[0])
        return path

    return write
