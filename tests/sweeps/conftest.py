"""A folder with a table, and its hearts or the sentence that refuses them."""

import pytest

from echotruth.cases import expand
from echotruth.config.loading import ConfigError, load


@pytest.fixture
def hearts(tmp_path, monkeypatch):
    """Function from the text of a table, and other lines of a configuration, to its cases."""
    monkeypatch.chdir(tmp_path)

    def make(table: str, more: str = "", cases: str = "") -> list:
        (tmp_path / "hearts.csv").write_text(table)
        (tmp_path / "my.yaml").write_text(f"cases: {{file: hearts.csv, {cases}}}\n{more}")
        return expand(load("my.yaml"), "my.yaml")

    return make


@pytest.fixture
def refusal(hearts):
    """Function from the text of a table to the sentence that refuses it."""

    def refuse(*texts: str) -> str:
        with pytest.raises(ConfigError) as error:
            hearts(*texts)
        assert "\n" not in str(error.value)
        return str(error.value)

    return refuse
