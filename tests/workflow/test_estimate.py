"""What a run is estimated to take follows from its jobs, and what does not fit is refused with a remedy."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from job_files import finish, write_benchmark

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.building import configure
from echotruth.config.loading import load, validate
from echotruth.workflow import cost
from echotruth.workflow.concerns import concerns
from echotruth.workflow.estimate import Estimate, estimate, format_bytes, short, table
from echotruth.workflow.jobs import ended, jobs, places, rules

ROOT = Path(__file__).parents[2]


def estimated(config, cores=2, folder=Path("none"), times=1) -> Estimate:
    return estimate(config, expand(config) * times, cores, folder)


def test_demo_takes_the_minutes_that_it_took():
    """196 s of CPU time for its stages and 23 s for the report, in 137 s on two cores of a Xeon; 67 MB with figures.

    That was with ideal acoustics.
    """
    found = estimated(configure(ROOT / "config/demo.yaml", realism={"preset": "none"}))
    assert found.seconds == pytest.approx(196 + 23, rel=0.25)
    assert found.wall_seconds == pytest.approx(137, rel=0.25)
    assert found.bytes == pytest.approx(67e6, rel=0.2)


def test_after_the_first_heart_the_rest_takes_what_it_took(tmp_path):
    config = load(ROOT / "config/sweep.yaml")
    first, *_ = expand(config)
    before = estimated(config)
    for rule in rules(config)[:6]:
        for view, size in places(rule, config):
            job = "/".join(str(part) for part in (rule, first.id, view, size) if part)
            write_benchmark(tmp_path, job, 3 * cost.seconds(rule, first.config, view, size))
    found = estimated(config, folder=tmp_path)
    assert found.seconds == pytest.approx(3 * before.seconds, rel=0.05)
    assert "jobs of mechanics" in table(found, tmp_path) and "a reference" in table(before, tmp_path)


def test_jobs_with_a_record_are_not_left(tmp_path):
    config = validate({"cases": {"seed": [1, 2]}}, "x")
    cases = [case.id for case in expand(config)]
    assert estimated(config, folder=tmp_path).seconds_left == estimated(config).seconds
    for rule in rules(config):
        finish(tmp_path, rule, config, cases)
        assert ended(tmp_path, rule, config) == jobs(rule, config, cases)
    assert estimated(config, folder=tmp_path).seconds_left == 0
    record = next((tmp_path / "ledger/tracking").rglob("*.json"))
    record.unlink()
    parts = estimated(config, folder=tmp_path).parts
    assert parts["tracking"].left == 1, "a clip is tracked when all its trackers are done"
    assert "Left:" in table(estimated(config, folder=tmp_path), tmp_path)


def test_jobs_are_those_of_hearts_views_and_sizes():
    parts = estimated(validate({"cases": {"seed": [1, 2]}}, "x")).parts
    numbers = {rule: part.jobs for rule, part in parts.items()}
    assert numbers == {
        **{"mechanics": 2, "phantom": 8, "rf": 8, "truth": 24, "bmode": 24, "tracking": 24},
        **{"repository": 1, "report": 1},
    }


def test_more_cores_take_less_time_but_not_less_than_a_chain_of_jobs():
    config = load(ROOT / "config/sweep.yaml")
    walls = [estimated(config, cores).wall_seconds for cores in (1, 2, 16, 5000)]
    assert walls[0] == pytest.approx(2 * walls[1], rel=0.1) and walls[1] > walls[2] > walls[3]
    parts = estimated(config).parts
    assert walls[3] > parts["mechanics"].seconds / 3 + parts["rf"].seconds + parts["tracking"].seconds
    assert estimated(config, 1).wall_seconds == pytest.approx(estimated(config).seconds, rel=0.01)


def absurdities(values, **changes):
    config = validate(values, "x")
    return [concern for concern in concerns(config, estimated(config, **changes), Path("none")) if concern.is_absurd]


def test_heart_wider_than_its_image_is_refused():
    scan = {"rf": {"focus_mm": 40, "focal_zones": 1}, "bmode": {"field_of_view_mm": 45}}
    (concern,) = absurdities({"geometry": {"preset": "human"}} | scan)
    assert "bmode.field_of_view_mm = 45" in concern.text and "mm wide" in concern.text


def test_file_that_holds_no_wall_is_refused(tmp_path):
    file = tmp_path / "heart.vtu"
    file.write_text("no mesh")
    (concern,) = absurdities({"geometry": {"file": str(file), "remesh": True}})
    assert f"{file}: cannot be read as .vtu" in concern.text


def test_more_than_the_disk_holds_is_refused():
    (concern,) = absurdities({"rf": {"keep": ["channels"]}}, times=60_000)
    assert "the run needs" in concern.text and "rf.keep" in concern.text


def test_more_than_the_memory_holds_is_refused_and_on_many_cores_warned_of(monkeypatch, roomy_disk):
    config = Config()
    most = 1e6 * max(estimated(config).megabytes.values())
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(total=0.9 * most))
    (concern,) = concerns(config, estimated(config), Path("none"))
    assert concern.is_absurd and "of memory" in concern.text and "bmode.size_px" in concern.text
    assert not concerns(config, estimated(config), Path("none"), is_local=False)
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(total=3.5 * most))
    assert not concerns(config, estimated(config, 3), Path("none"))
    (concern,) = concerns(config, estimated(config, 4), Path("none"))
    assert not concern.is_absurd and "use --cores 3" in concern.text


def test_pixels_wider_than_speckle_are_warned_of():
    config = validate({"bmode": {"size_px": 64, "downsampling": [1]}}, "x")
    (concern,) = concerns(config, estimated(config), Path("none"))
    assert not concern.is_absurd and "bmode.size_px = 64" in concern.text


@pytest.mark.parametrize(("size", "largest"), [(512, 7), (256, 3), (128, 1)])
def test_grid_too_coarse_for_strain_is_warned_of(size, largest):
    values = {"bmode": {"size_px": size, "downsampling": [1]}}
    for grid in (largest, largest + 1):
        config = validate(values | {"tracking": {"grid_px": grid}}, "x")
        found = [concern for concern in concerns(config, estimated(config), Path("none")) if "grid_px" in concern.text]
        assert len(found) == (grid > largest)
    assert not found[0].is_absurd and f"use {largest} or less" in found[0].text


@pytest.mark.parametrize("name", ["demo", "human", "learning", "sweep", "realistic", "phantoms", "benchmark"])
def test_nothing_speaks_against_the_shipped_configurations_where_there_is_space(name, roomy_disk):
    config = load(ROOT / f"config/{name}.yaml")
    assert not concerns(config, estimated(config), Path("none"))


def test_grid_of_the_paper_is_the_printed_one_and_warned_of(roomy_disk):
    config = load(ROOT / "config/paper.yaml")
    (concern,) = concerns(config, estimated(config), Path("none"))
    assert "tracking.grid_px = 10" in concern.text and "use 7 or less" in concern.text


def test_text_tells_time_place_jobs_and_memory(tmp_path):
    found = estimated(load(ROOT / "config/demo.yaml"))
    text = table(found, tmp_path / "demo")
    assert f"{found.jobs:>7}" in text and "GB for the largest job" in text and "a core of an Intel Xeon" in text
    assert f"{found.jobs} jobs" in short(found) and "on 2 cores" in short(found)


@pytest.mark.parametrize(
    "number, text", [(3e5, "less than 1 MB"), (67e6, "67 MB"), (1.234e9, "1.23 GB"), (5e12, "5 TB")]
)
def test_sizes_in_words(number, text):
    assert format_bytes(number) == text
