"""`echotruth merge`, `check` and `status` of repositories, in one process."""

import shutil

import pytest
import yaml
from finished_repository import configured, content, finish, remake

from echotruth.workflow import lock

TABLE = "case,fibres.endo_deg\na,60\nb,70\n"
BOTH = configured("both", views=("mid",), cases={"table": TABLE})


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources")
    one, two = (configured(name, views=("mid",), cases={"table": TABLE.replace(row, "")}) for name, row in
                (("one", "b,70\n"), ("two", "a,60\n")))  # fmt: skip
    return [finish(folder / config.name, config) for config in (one, two)]


@pytest.fixture
def both(tmp_path, monkeypatch):
    monkeypatch.setattr(lock, "hold", lambda folder: False)  # which would last until these tests end
    (tmp_path / "both.yaml").write_text(yaml.safe_dump(BOTH.model_dump(mode="json")))


def test_repositories_are_merged_checked_and_told(call, tmp_path, sources, both):
    before, folder = [content(source) for source in sources], tmp_path / "out/both"
    status, output, errors = call("merge", "both.yaml", *sources)
    assert (status, errors) == (0, "")
    assert output == "out/both: 4 hearts and clips are copied: echotruth run both.yaml makes the rest\n"
    assert call("status", "out/both")[0] == 1 and "not finished: run it to go on" in call("status", "out/both")[1]
    assert remake(folder, BOTH) == ["repository"] and [content(source) for source in sources] == before
    status, output, _ = call("check", "out/both")
    assert status == 0 and output.startswith("out/both: nothing is wrong\n") and "0 faults" in output
    assert call("status", "out/both/both.zarr")[0] == 0
    (folder / "both.zarr/clips/a/mid/rf/lines/zarr.json").write_text("{")
    status, output, _ = call("check", "out/both", "--quick")
    assert status == 1 and "rf/lines/zarr.json is not what was written: delete both.zarr/clips/a/mid/rf and" in output


@pytest.mark.parametrize(
    ("config", "source", "status", "sentence"),
    [
        ("both.yaml", "nowhere", 2, "nowhere: is not a repository: give the folder that a run made"),
        ("bot.yaml", "out", 1, "bot.yaml: does not exist: did you mean both.yaml?"),
    ],
)
def test_what_cannot_be_merged_is_refused_in_one_line(call, tmp_path, both, config, source, status, sentence):
    found, output, errors = call("merge", config, source)
    assert (found, output, errors.count("\n")) == (status, "", 1) and sentence in errors
    assert not (tmp_path / "out").exists()


def test_repository_that_is_damaged_is_refused_in_one_line(call, tmp_path, sources):
    for name, text in (("cases.csv", "heart\n"), ("config.yaml", "views: [")):
        folder = shutil.copytree(sources[0], tmp_path / name)
        (folder / name).write_text(text)
        for command in ("status", "check"):
            status, output, errors = call(command, folder)
            assert (status, output, errors.count("\n")) == (2, "", 1) and name in errors, errors
