"""Error messages of invalid configurations."""

import pytest

from echotruth.config.loading import ConfigError, load


@pytest.fixture
def refusal(tmp_path):
    """Function from the YAML of an invalid configuration to the error message, which is one sentence."""

    def refused(text):
        file = tmp_path / "bad.yaml"
        file.write_text(text)
        with pytest.raises(ConfigError) as caught:
            load(file)
        message = str(caught.value)
        assert message.startswith(str(file)) and "\n" not in message
        return message

    return refused
