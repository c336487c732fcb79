"""Releases and descriptions need an extra, and say so before they write anything."""

import sys

import pytest

import echotruth as et
from echotruth.extras import installation
from echotruth.sharing.description import DescriptionError, describe
from echotruth.sharing.release import release


@pytest.mark.parametrize("write", [release, describe])
def test_missing_extra_is_told_in_one_sentence_and_nothing_is_written(tmp_path, monkeypatch, write):
    monkeypatch.setitem(sys.modules, "mlcroissant", None)
    with pytest.raises(DescriptionError) as told:
        write(et.sample(), tmp_path / "files")
    assert str(told.value) == f"a description needs the package mlcroissant: {installation('description')}"
    assert not any(tmp_path.iterdir())
