"""Exports of the repository `known`."""

from functools import partial

import pytest
from known_repository import SIZES

from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export


def write(known, folder, name, view="mid", size=SIZES[0], **options):
    work = Export(Repository(known.folder), name, cases=["heart"], views=[view], sizes=[size], output=folder, **options)
    (path,) = work.write(work.clips()[0])
    return path


@pytest.fixture
def exported(known, tmp_path):
    """A function that exports a format of one view, and gives the path of the file or folder."""
    return partial(write, known, tmp_path)


@pytest.fixture(scope="module")
def exported_once(known, tmp_path_factory):
    """The same for what the tests of a module share."""
    return partial(write, known, tmp_path_factory.mktemp("exported"))
