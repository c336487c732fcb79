"""What a run is estimated to take agrees with what runs took, and the absurd is refused with a remedy."""

import json
import shutil
from pathlib import Path

import pytest
from finished_repository import configured, finish

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import schema
from echotruth.workflow import expected_cost
from echotruth.workflow.concerns import concerns
from echotruth.workflow.estimate import Estimate, estimate, number_of_files
from echotruth.workflow.estimate_text import short, table
from echotruth.workflow.imaged_tissue import imaged_tissue
from echotruth.workflow.machine_speed import Speed, measured_speed

ROOT = Path(__file__).parents[2]
MEASURED = json.loads((Path(__file__).parent / "measured_costs.json").read_text())
"""CPU time without compilation of the stages of runs of the workflow; `fitted` are those that gave the constants."""
AS_MEASURED = Speed({})


def configuration(name) -> Config:
    given = MEASURED[name]["config"]
    return load(ROOT / f"config/{given}.yaml") if isinstance(given, str) else validate(given, name)


def estimated(config, cores=2, speed=AS_MEASURED, folder=Path("none")) -> Estimate:
    return estimate(config, expand(config), cores, speed, folder)


@pytest.mark.parametrize("name", MEASURED)
def test_cpu_time_is_within_30_percent_of_what_a_run_took(name):
    parts, measured = estimated(configuration(name)).parts, MEASURED[name]
    seconds = sum(parts[part].seconds for part in ("mechanics", "images", "tracking"))
    took = measured["start_seconds"] + sum(stage["cpu_seconds"] for stage in measured["stages"].values())
    assert seconds == pytest.approx(took, rel=0.3)


@pytest.mark.parametrize("name", MEASURED)
def test_memory_of_a_job_is_enough_and_not_twice_what_one_took(name):
    found, stages = estimated(configuration(name)).megabytes, MEASURED[name]["stages"]
    took = max(stages[stage]["memory_MB"] for stage in ("phantom", "truth", "rf", "bmode"))
    assert 0.75 * took < found["imaging"] < 2 * took
    assert 0.75 * stages["mechanics"]["memory_MB"] < found["mechanics"] < 2 * stages["mechanics"]["memory_MB"]


@pytest.mark.slow
def test_this_machine_is_as_fast_as_its_records_say(tmp_path):
    config = configured(seeds=(1, 2))
    folder = tmp_path / config.name
    finish(folder, config)
    for case in expand(config):
        for stage in expected_cost.STAGES:
            for path in (folder / "ledger" / stage).glob(
                f"**/{case.id}*/*.json" if stage not in ("mechanics", "physiology") else f"{case.id}.json"
            ):
                record = json.loads(path.read_text())
                usual = {"mechanics": expected_cost.mechanics_seconds(case.config), "physiology": 0.2}
                if record["view"]:
                    usual = expected_cost.view_seconds(case.config, record["view"])
                record |= {"cpu_seconds": 3 * usual[stage] + 7, "compile_seconds": 7}
                path.write_text(json.dumps(record))
    speed = measured_speed(tmp_path)
    assert speed.repositories == (str(folder),)
    assert speed.of("") == pytest.approx(3) and speed.of("rf") == pytest.approx(3)
    slow, fast = estimated(config, speed=speed), estimated(config)
    assert slow.parts["tracking"].seconds == pytest.approx(3 * fast.parts["tracking"].seconds)


def test_without_records_the_constants_stand(tmp_path):
    assert measured_speed(tmp_path / "out") == Speed({})
    (tmp_path / "made/ledger/rf").mkdir(parents=True)
    assert measured_speed(tmp_path) == Speed({}), "a folder without a configuration tells nothing"


@pytest.mark.slow
def test_files_are_those_of_a_finished_repository(tmp_path):
    config = configured(seeds=(1, 2, 3))
    folder = tmp_path / config.name
    finish(folder, config)
    store, records = folder / f"{config.name}.zarr", folder / "ledger"
    jobs = {
        f"{group}/{array.name}" for group, arrays in schema.groups(config).items() for array in arrays if array.leading
    }
    paths = [path.relative_to(store).as_posix() for path in store.rglob("*") if path.is_file()]
    shards = [
        path for path in paths if path.partition("/c/")[0] in jobs and "/c/" in path and not path.startswith("cases")
    ]
    made = len(shards) + sum(1 for path in records.glob("*/**/*.json"))
    hearts = number_of_files(config, 3) - number_of_files(config, 0)
    logs_and_checkpoints = 3 * (2 + 2 * len(config.views) + 1 + len(config.views))
    assert hearts - logs_and_checkpoints == made


@pytest.mark.slow
def test_work_that_is_recorded_is_not_left(tmp_path):
    config = configured(seeds=(1, 2))
    folder = tmp_path / config.name
    assert estimated(config, folder=folder).seconds_left == pytest.approx(estimated(config, folder=folder).seconds)
    finish(folder, config)
    (folder / "ledger/repository.json").write_text("{}")
    assert estimated(config, folder=folder).parts["images"].seconds_left == 0
    shutil.rmtree(next((folder / "ledger/bmode").iterdir()))
    left = estimated(config, folder=folder).parts["images"]
    assert left.seconds_left == pytest.approx(left.seconds / 2)


def test_hearts_with_one_motion_are_solved_once():
    one, both = (
        estimated(validate({"cases": {key: values}}, "x")).parts["mechanics"].seconds
        for key, values in (("phantom.density_per_mm3", [2000, 2800]), ("fibres.endo_deg", [60, 66]))
    )
    single = estimated(Config()).parts["mechanics"].seconds
    assert both == pytest.approx(2 * single) and single < one < 1.2 * single


def test_more_cores_take_less_time_but_not_less_than_a_chain_of_jobs():
    config = load(ROOT / "config/sweep.yaml")
    walls = [estimated(config, cores).wall_seconds for cores in (1, 2, 16, 1000)]
    assert walls[0] == pytest.approx(2 * walls[1], rel=0.1) and walls[1] > walls[2] > walls[3]
    found = estimated(config, 1000)
    assert found.wall_seconds > found.expected["mechanics"] + found.expected["imaging"]
    assert estimated(config, 1).wall_seconds == pytest.approx(found.seconds, rel=0.1)


@pytest.mark.parametrize("name, view", [("demo", "mid"), ("demo", "long_axis"), ("human", "mid")])
def test_area_of_the_wall_in_a_plane_is_that_of_its_mesh(name, view):
    import pyvista as pv

    config = load(ROOT / f"config/{name}.yaml")
    mesh = left_ventricle(config.geometry)
    grid = pv.UnstructuredGrid({pv.CellType.TETRA: mesh.cells[:, :4]}, mesh.nodes * 1e3)
    if config.views[view].plane == "long_axis":
        cut = grid.slice(normal=(0, 1, 0), origin=(0, 0, 0))
    else:
        apex = mesh.nodes[mesh.endo.ravel(), 2].min() * 1e3
        cut = grid.slice(normal=(0, 0, 1), origin=(0, 0, config.views[view].position * apex))
    assert imaged_tissue(config, view).plane_mm2 == pytest.approx(cut.area, rel=0.1)


def absurdities(values, **changes):
    config = validate(values, "x")
    found = estimated(config, **changes)
    return [concern for concern in concerns(config, found, Path("none")) if concern.is_absurd]


HUMAN_AT_25_MHZ = {
    "geometry": {"preset": "human"},
    "probe": {"preset": "mouse_25MHz"},
    "rf": {"focus_mm": 70},
    "bmode": {"field_of_view_mm": 150},
    "phantom": {"density_per_mm3": 5},
}


def test_heart_deeper_than_its_array_sees_is_refused():
    (concern,) = absurdities(HUMAN_AT_25_MHZ)
    assert "probe.frequency_MHz = 25" in concern.text and "human_2_7MHz" in concern.text


def test_heart_outside_its_image_is_refused():
    scan = {"rf": {"focus_mm": 40, "focal_zones": 1}, "bmode": {"field_of_view_mm": 45}}
    (concern,) = absurdities({"geometry": {"preset": "human"}} | scan)
    assert "bmode.field_of_view_mm = 45" in concern.text


def test_file_that_holds_no_wall_is_refused(tmp_path):
    file = tmp_path / "heart.vtu"
    file.write_text("no mesh")
    (concern,) = absurdities({"geometry": {"file": str(file), "remesh": True}})
    assert f"{file}: cannot be read as .vtu" in concern.text


def test_more_than_the_disk_holds_is_refused():
    config = validate({"rf": {"keep": ["channels"]}}, "x")
    found = estimate(config, expand(config) * 60_000, 1, AS_MEASURED, Path("none"))
    (concern,) = [concern for concern in concerns(config, found, Path("none")) if "GB free" in concern.text]
    assert concern.is_absurd and "rf.keep" in concern.text


def test_years_of_cpu_time_and_millions_of_files_are_warned_of():
    config = Config()
    found = estimate(config, expand(config) * 60_000, 100, AS_MEASURED, Path("none"))
    texts = [concern.text for concern in concerns(config, found, Path("none")) if not concern.is_absurd]
    assert any("years of CPU time" in text for text in texts) and any("million files" in text for text in texts)


@pytest.mark.parametrize("name", ["demo", "human", "learning", "sweep", "paper", "realistic", "phantoms", "benchmark"])
def test_nothing_speaks_against_the_shipped_configurations_where_there_is_space(name, roomy_disk):
    config = load(ROOT / f"config/{name}.yaml")
    assert not concerns(config, estimated(config), Path("none"))


def test_text_tells_time_place_jobs_and_memory(tmp_path):
    found = estimated(load(ROOT / "config/demo.yaml"))
    text = table(found, tmp_path / "demo")
    assert f"{found.jobs:>7}" in text and "GB for the largest job" in text and "docs/estimate.md" in text
    assert f"{found.jobs} jobs" in short(found) and "on 2 cores" in short(found)
