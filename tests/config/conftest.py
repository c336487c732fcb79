"""What is wrong with a configuration, in the words a user reads."""

import pytest

from echotruth.config.loading import ConfigError, load


@pytest.fixture
def refusal(tmp_path):
    """The one sentence in which a configuration, given as YAML, is refused."""

    def refused(text):
        file = tmp_path / "bad.yaml"
        file.write_text(text)
        with pytest.raises(ConfigError) as caught:
            load(file)
        message = str(caught.value)
        assert message.startswith(str(file)) and "\n" not in message
        return message

    return refused
