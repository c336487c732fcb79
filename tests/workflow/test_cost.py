"""What a run is expected to take follows from its jobs, and grows with what makes them larger."""

import re
from pathlib import Path

import pytest

from echotruth.cases import expand
from echotruth.config import Config, shipped
from echotruth.config.loading import load
from echotruth.workflow import cost
from echotruth.workflow.concerns import concerns

ROOT = Path(__file__).parents[2]
LARGER = [
    ("mechanics", {"geometry": {"transmural_elements": 6}}),
    ("mechanics", {"loop": {"frames": 80}}),
    ("mechanics", {"loop": {"kind": "circulation"}}),
    ("rf", {"probe": {"elements": 128}}),
    ("rf", {"realism": {"surroundings": {"level_dB": -10}}}),
    ("truth", {"bmode": {"size_px": 1024}}),
    ("tracking", {"loop": {"frames": 400}}),
]


@pytest.mark.parametrize(("rule", "change"), LARGER)
def test_larger_work_takes_longer_and_asks_for_more(rule, change):
    given = {"tracking": {"trackers": {"one": {"method": "dis"}}}}
    small, large = Config.model_validate(given), Config.model_validate(given | change)
    assert cost.seconds(rule, large) > 1.3 * cost.seconds(rule, small)
    before, after = cost.resources(rule, small), cost.resources(rule, large)
    assert after["runtime"] >= before["runtime"] and after["mem_mb"] > before["mem_mb"]


def test_jobs_are_those_of_the_hearts_the_clips_and_the_trackers():
    config = load(ROOT / "config/sweep.yaml")
    cases = expand(config)
    hearts, views = len({case.heart for case in cases}), len(config.views)
    found = cost.jobs(config, hearts, len(cases))
    assert found["mechanics"] == hearts <= len(cases) and found["rf"] == len(cases) * views
    assert found["tracking"] == found["rf"] * len(config.tracking.trackers) and found["repository"] == 1
    assert "inference" not in found


def test_table_adds_up_and_the_demo_takes_minutes():
    config = load(ROOT / "config/demo.yaml")
    lines = cost.table(config, 1, 1, 2).splitlines()
    rules = list(cost.jobs(config, 1, 1))
    assert [line.split()[0] for line in lines[1 : 1 + len(rules)]] == rules
    (time,) = [line for line in lines if line.startswith("Time: ")]
    assert "min of CPU time" in time and "on 2 cores" in time


def test_no_number_of_cores_makes_a_run_shorter_than_the_jobs_of_a_heart_that_wait_for_each_other():
    config = load(ROOT / "config/demo.yaml")
    at_least = sum(cost.seconds(rule, config) for rule in ("mechanics", "phantom", "rf", "bmode", "tracking", "report"))
    assert at_least < cost.chain(config) < at_least + 30
    few, many = cost.table(config, 1, 1, 2), cost.table(config, 1, 1, 200)
    assert f"about {cost.duration(cost.chain(config))} on 200 cores" in many and "about 3 min on 2 cores" in few


def test_files_are_about_those_of_a_repository():
    sample = shipped.sample()
    config = load(sample / "config.yaml")
    (line,) = [line for line in cost.table(config, 2, 2, 1).splitlines() if line.startswith("Disk: ")]
    megabytes, files = map(int, re.findall(r"\d+", line))
    # It has no lines and no scatterers, which are 40 files of a view.
    found = [path for path in (sample / "sample.zarr").rglob("*") if path.is_file()]
    assert files == pytest.approx(len(found) + 4 * 40, rel=0.1) and 5 < megabytes < 30


def test_page_on_clusters_has_time_and_memory_of_the_jobs():
    rows = re.findall(r"^\| (\w+) \(mouse.*?\) \| (.*) \|$", (ROOT / "docs/cluster.md").read_text(), re.MULTILINE)
    assert [name for name, _ in rows] == ["demo", "sweep"]
    for name, cells in rows:
        config = load(ROOT / f"config/{name}.yaml")
        rules = ("mechanics", "phantom", "rf", "truth", "bmode", "points", "tracking")
        asked = [cost.resources(rule, config) for rule in rules]
        assert cells.split(" | ") == [f"{job['runtime']} min, {job['mem_mb'] / 1000:.1f} GB" for job in asked]


@pytest.mark.parametrize(
    ("given", "words", "is_absurd"),
    [
        ({"geometry": {"preset": "human"}, "rf": {"focus_mm": 40.0, "focal_zones": 1},
          "bmode": {"field_of_view_mm": 45.0}},
         "bmode.field_of_view_mm = 45: the heart is", True),
        ({"bmode": {"size_px": 64, "downsampling": [1]}}, "bmode.size_px = 64: a pixel is", False),
        ({"tracking": {"grid": 0.06}}, "tracking.grid = 0.06: points", False),
        ({}, "", False),
    ],
)  # fmt: skip
def test_what_speaks_against_a_run_is_told_with_key_and_remedy(given, words, is_absurd):
    found = list(concerns(Config.model_validate(given, strict=False)))
    assert any(concern.text.startswith(words) and ": use " in concern.text for concern in found) == bool(words)
    assert any(concern.is_absurd for concern in found) == is_absurd
