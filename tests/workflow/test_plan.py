"""A plan: hearts, cases and resources of a configuration, and what of it stands already."""

import os
import shutil
from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from finished_repository import begin, configured, content, finish, missing, plan_of, remake

import echotruth as et
from echotruth.config import Cases
from echotruth.config.loading import ConfigError
from echotruth.repository.check import check
from echotruth.repository.places import JobPlace
from echotruth.workflow.plan import Plan, as_yaml

CONFIG = configured(cases={"fibres.endo_deg": [60.0, 70.0], "seed": [1, 2]})


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("done") / "small", configured(views=("mid",), cases={}))


def not_made(folder, config):
    """Jobs that a run of a configuration would do, as `rf` or `tracking one`."""
    return {" ".join(filter(None, (job.stage, job.tracker))) for job in missing(plan_of(folder, config))}


def files(folder):
    return {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in folder.rglob("*")}


def test_heart_serves_all_cases_that_move_alike():
    plan = plan_of(Path("out/small"), CONFIG)
    assert len(plan.hearts) == 2 and len(plan.cases) == 4
    for heart, case in plan.hearts.items():
        assert plan.cases[case].heart == heart == plan.cases[plan.case_of(SimpleNamespace(heart=heart))].heart
    needed = plan.needed("truth", f"{plan.store}/hearts/{{heart}}/zarr.json")
    assert {file for case in plan.cases for file in needed({"case": case, "view": "mid"})} == {
        f"{plan.store}/hearts/{heart}/zarr.json" for heart in plan.hearts
    }


@pytest.mark.parametrize(
    ("section", "again"),
    [
        ({"bmode": {"dynamic_range_dB": 35.0}}, {"bmode", "tracking one"}),
        ({"tracking": {"trackers": {"one": {"method": "dis"}}}}, {"tracking one"}),
        ({"tracking": {"trackers": {"one": {"window_px": 16}, "two": {"method": "dis"}}}}, {"tracking two"}),
        ({"physiology": {"twist_max_deg": 80.0}}, set()),
        ({"views": {"mid": {"position": 0.6}}}, {"phantom", "rf", "truth", "bmode", "points", "tracking one"}),
    ],
)
def test_what_was_made_otherwise_is_asked_for_and_nothing_is_touched(done, section, again):
    config, before = configured(views=("mid",), cases={}), files(done)
    values = config.model_dump()
    for name, keys in section.items():
        values[name] = values[name] | keys
    plan = plan_of(done, type(config).model_validate(values))
    assert not_made(done, plan.config) == again and not_made(done, config) == set() and files(done) == before
    for stage in again:
        name, _, tracker = stage.partition(" ")
        wildcards = {"case": "heart", "view": "mid"} | ({"tracker": tracker} if tracker else {})
        heart = f"{plan.store}/hearts/{{heart}}/zarr.json"
        assert plan.needed(name, heart)(wildcards) == [heart.format(heart="heart")]
        path = f"{plan.store}/{plan._groups(JobPlace(name, 'heart', 'mid', tracker or None))[0]}/zarr.json"
        (asked,) = plan.asked_for([path])
        assert asked == (
            path if tracker == "two" else f"{plan.touched}/{name}/heart/mid{f'/{tracker}' * bool(tracker)}"
        )
        assert not Path(asked).exists()


def test_what_the_configuration_has_no_more_is_no_part_of_the_repository_and_comes_back_without_a_job(tmp_path):
    more = configured(cases={"fibres.endo_deg": [60.0, 70.0]})
    one = {"views": {"mid": more.views["mid"]}, "tracking": more.tracking}
    fewer = more.model_copy(update=one | {"cases": Cases.model_validate({"fibres.endo_deg": [70.0]})})
    folder, before = finish(tmp_path / "small", more), content(tmp_path / "small")
    assert remake(folder, fewer) == ["repository"]
    report = check(folder)
    assert report.faults == [] and "groups are not of the configuration" in report.notes[0]
    at_once = finish(tmp_path / "fewer" / "small", fewer) / "SHA256SUMS"
    assert (folder / "SHA256SUMS").read_bytes() == at_once.read_bytes()
    assert len(et.Repository(folder).tree["clips"].children) == 1
    assert remake(folder, more) == ["repository"] and content(folder) == before


def test_dates_say_nothing(done):
    for date in (1e9, 4e9):  # in 2001, all the same, and in 2096
        for path in done.rglob("*"):
            os.utime(path, (date, date))
        config = configured(views=("mid",), cases={})
        assert not_made(done, config) == set() and plan_of(done, config).is_published
    assert not_made(done, configured(views=("mid",), cases={}, seed=3)) >= {"phantom"}


@pytest.mark.parametrize(
    ("lost", "jobs", "is_published"),
    [
        ("small.zarr/hearts/heart", {"mechanics"}, False),
        ("small.zarr/clips/heart/mid/bmode/64", {"bmode"}, False),
        ("small.zarr/clips/heart/mid/rf", set(), False),
        ("small.zarr/clips/heart/mid/phantom", set(), False),
        ("config.yaml", set(), False),
        ("cases/heart.json", set(), True),
    ],
)
def test_only_what_is_lost_is_made_again(done, tmp_path, lost, jobs, is_published):
    folder, config = shutil.copytree(done, tmp_path / "small"), configured(views=("mid",), cases={})
    shutil.rmtree(folder / lost) if (folder / lost).is_dir() else (folder / lost).unlink()
    assert not_made(folder, config) == jobs and plan_of(folder, config).is_published is is_published


def test_lost_images_and_lines_ask_for_the_scatterers_that_both_come_from(done, tmp_path):
    folder = shutil.copytree(done, tmp_path / "small")
    for group in ("bmode", "rf", "phantom"):
        shutil.rmtree(folder / "small.zarr/clips/heart/mid" / group)
    assert not_made(folder, configured(views=("mid",), cases={})) == {"phantom", "rf", "bmode"}


def test_date_in_the_future_is_no_longer_one_when_a_run_begins(done, tmp_path):
    folder, config = shutil.copytree(done, tmp_path / "small"), configured(views=("mid",), cases={})
    path = folder / "small.zarr/clips/heart/mid/rf/zarr.json"
    os.utime(path, (4e9, 4e9))
    begin(folder, config)
    assert path.stat().st_mtime < 4e9 and not_made(folder, config) == set()


def test_plan_alone_writes_nothing(tmp_path):
    with chdir(tmp_path):
        plan = Plan({"name": "small"})
        assert not plan.is_published and not list(tmp_path.iterdir())


def test_what_a_killed_run_left_is_removed(done, tmp_path):
    folder, config = shutil.copytree(done, tmp_path / "small"), configured(views=("mid",), cases={})
    before = content(folder)
    (folder / "drafts/abc").mkdir(parents=True)
    left = [
        folder / name / ".zarr.json.12345678.partial" for name in ("", "cases", "small.zarr", "small.zarr/clips/heart")
    ]
    for path in left:
        path.write_text("{")
    (folder / "SHA256SUMS").unlink()  # as where a run begins that has work to do
    assert remake(folder, config) == ["repository"]
    assert content(folder) == before and not (folder / "drafts").exists() and not any(path.exists() for path in left)


def test_files_of_the_cases_are_written_only_if_they_change(done):
    def times():
        return {path: path.stat().st_mtime_ns for path in [*done.glob("c*"), *done.glob("cases/*")]}

    before = times()
    begin(done, configured(views=("mid",), cases={}))
    assert times() == before and len(before) >= 4


def test_job_that_failed_asks_for_more():
    asked = plan_of(None, CONFIG).resources("mechanics")
    first, second = ({name: value(None, attempt) for name, value in asked.items()} for attempt in (1, 2))
    assert set(first) == {"runtime", "mem_mb"} and second == {name: 2 * value for name, value in first.items()}


@pytest.mark.parametrize("values", [{"bmode": {"sise_px": 3}}, {"seed": -1}, {"cases": {"seed": [1, 1]}}])
def test_wrong_configuration_is_refused_with_its_source(values):
    with pytest.raises(ConfigError, match=r"^mine\.yaml: "):
        Plan(values, "mine.yaml")


def test_configuration_that_is_written_makes_the_same_plan():
    config = configured(cases={"table": "case,seed,note\n007,1,a\n1e3,2,b\n"})
    text = as_yaml(config)
    assert "table: |\n    case,seed,note\n    007,1,a\n" in text
    assert Plan(yaml.safe_load(text)).cases == plan_of(None, config).cases
