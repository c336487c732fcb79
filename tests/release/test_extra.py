"""A release needs an extra, and says so before it writes anything."""

import sys

import pytest

import echotruth as et
from echotruth.release import release
from echotruth.repository.description import DescriptionError


def test_missing_extra_is_told_in_one_sentence_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.delitem(sys.modules, "echotruth.repository.description.croissant", raising=False)
    monkeypatch.setitem(sys.modules, "mlcroissant", None)
    with pytest.raises(DescriptionError) as told:
        release(et.sample(), tmp_path / "files")
    assert str(told.value) == "release needs the package mlcroissant: pip install 'echotruth[description]'"
    assert not any(tmp_path.iterdir())
