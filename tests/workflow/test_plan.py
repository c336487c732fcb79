"""A plan: hearts, cases and resources of a configuration, and what of it stands already."""

from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from finished_repository import begin, configured, content, finish, plan_of, remake

import echotruth as et
from echotruth.config import Bmode, Cases
from echotruth.config.loading import ConfigError
from echotruth.repository.check import check
from echotruth.repository.metadata import OUTDATED
from echotruth.workflow import lock
from echotruth.workflow.plan import Plan, as_yaml

CONFIG = configured(cases={"fibres.endo_deg": [60.0, 70.0], "seed": [1, 2]})


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("done") / "small", configured(views=("mid",), cases={}))


def whole(folder):
    """Groups that Snakemake sees: `heart`, `rf` and so on."""
    groups = [path.parent for path in (folder / "small.zarr").glob("*/**/zarr.json")]
    return {path.name if path.name.isalpha() else path.parent.name for path in groups} & {
        *("heart", "phantom", "rf", "truth", "bmode", "tracking")
    }


def outdated(folder):
    return {path.parent.relative_to(folder / "small.zarr").as_posix() for path in folder.rglob(OUTDATED)}


def test_heart_serves_all_cases_that_move_alike():
    plan = plan_of(Path("out/small"), CONFIG)
    assert len(plan.hearts) == 2 and len(plan.cases) == 4
    for heart, case in plan.hearts.items():
        assert plan.cases[case].heart == heart == plan.cases[plan.case_of(SimpleNamespace(heart=heart))].heart
    assert {plan.heart(SimpleNamespace(case=case)) for case in plan.cases} == {
        f"{plan.store}/hearts/{heart}/zarr.json" for heart in plan.hearts
    }


@pytest.mark.parametrize(
    ("section", "set_aside"),
    [
        ({"bmode": {"dynamic_range_dB": 35.0}}, {"bmode/64", "tracking/64"}),
        ({"tracking": {"trackers": {"two": {"method": "dis"}}}}, {"tracking/64"}),
        ({"physiology": {"twist_max_deg": 80.0}}, set()),
        ({"views": {"mid": {"position": 0.6}}}, {"phantom", "rf", "truth/64", "bmode/64", "tracking/64"}),
    ],
)
def test_what_was_made_otherwise_is_set_aside_and_taken_back_with_its_settings(done, section, set_aside):
    config, before = configured(views=("mid",), cases={}), {path for path in done.rglob("*") if path.is_file()}
    values = config.model_dump()
    for name, keys in section.items():
        values[name] = values[name] | keys
    changed = type(config).model_validate(values)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lock, "hold", lambda folder: True)
        plan_of(done, changed).settle()
        assert outdated(done) == {f"clips/heart/mid/{name}" for name in set_aside}
        plan_of(done, config).settle()
    after = {path for path in done.rglob("*") if path.is_file() and path.name != ".SHA256SUMS.outdated"}
    assert outdated(done) == set() and before - after <= {done / "SHA256SUMS"} and after <= before
    finish(done, config)


def test_what_the_configuration_has_no_more_is_set_aside_and_is_no_part_of_the_repository(tmp_path):
    more = configured(bmode={"size_px": 64, "downsampling": (1, 2)}, cases={"fibres.endo_deg": [60.0, 70.0]})
    one = {"views": {"mid": more.views["mid"]}, "bmode": Bmode(size_px=64, downsampling=(1,))}
    fewer = more.model_copy(update=one | {"cases": Cases.model_validate({"fibres.endo_deg": [70.0]})})
    folder, before = finish(tmp_path / "small", more), content(tmp_path / "small")
    assert remake(folder, fewer) == ["repository"] and check(folder).faults == []
    at_once = finish(tmp_path / "fewer" / "small", fewer) / "SHA256SUMS"
    assert (folder / "SHA256SUMS").read_bytes() == at_once.read_bytes()
    assert len(et.Repository(folder).tree["clips"].children) == 1
    assert remake(folder, more) == ["repository"] and content(folder) == before


def test_process_that_only_lists_jobs_leaves_all_as_it_was(done, monkeypatch):
    def files():
        return {path: path.stat().st_mtime_ns for path in done.rglob("*") if path.is_file()}

    before = files()
    monkeypatch.setattr(lock, "hold", lambda folder: True)
    plan = plan_of(done, configured(views=("mid",), cases={}, bmode={"size_px": 32, "downsampling": (1,)}))
    plan.settle()
    assert not (done / "SHA256SUMS").exists()
    plan._take_back()
    assert files() == before


def test_plan_alone_writes_nothing_and_the_lock_is_held_before_anything_is_set_aside(done, tmp_path, monkeypatch):
    with chdir(tmp_path):
        Plan({"name": "small"}).settle()
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr(lock, "hold", lambda folder: False)  # a job of the run that holds it
    plan_of(done, configured(views=("mid",), cases={}, bmode={"size_px": 32, "downsampling": (1,)})).settle()
    assert outdated(done) == set()


def test_what_a_killed_run_left_is_removed(done):
    (done / "drafts/abc").mkdir(parents=True)
    begin(done, configured(views=("mid",), cases={}))
    assert not (done / "drafts").exists()


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
