"""The work of jobs, in closed forms, agrees with meshes and with what runs took, and follows what jobs take here."""

import json
from pathlib import Path

import numpy as np
import pytest
from job_files import write_benchmark

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.mechanics.geometry import left_ventricle
from echotruth.workflow.cost import core_seconds, mean_seconds, seconds, speed, units
from echotruth.workflow.imaged_tissue import areas, wall_scatterers
from echotruth.workflow.jobs import places

ROOT = Path(__file__).parents[2]
MEASURED = json.loads((Path(__file__).parent / "measured_costs.json").read_text())
"""CPU time without compilation of the stages of runs of the workflow, on one core of an AMD EPYC. Scatterers and echoes
of the realistic ones were measured again on the reference machine, and multiplied by `EPYC`."""
EPYC = 1.7
"""Time on that machine, with the code of then, over that on the reference machine."""
STAGES = {
    "mechanics": ("mechanics", "physiology"),
    "tracking": ("tracking", "evaluation"),
    **{rule: (rule,) for rule in ("phantom", "truth", "rf", "bmode")},
}


def configuration(name) -> Config:
    given = MEASURED[name]["config"]
    return load(ROOT / f"config/{given}.yaml") if isinstance(given, str) else validate(given, name)


@pytest.mark.parametrize("name", MEASURED)
def test_cpu_time_is_within_a_factor_of_1_5_of_what_a_run_took(name):
    configs = [case.config for case in expand(configuration(name))]
    expected = sum(mean_seconds(rule, configs) * len(places(rule, configs[0])) * len(configs) for rule in STAGES)
    measured = MEASURED[name]["stages"]
    took = sum(measured[stage]["cpu_seconds"] for stages in STAGES.values() for stage in stages)
    starts = 0.6 * sum(len(places(rule, configs[0])) for rule in STAGES) * len(configs)
    assert 1 / 1.5 < took / EPYC / (expected - starts) < 1.5


@pytest.mark.parametrize("name", ["demo", "human"])
def test_scatterers_of_the_wall_are_those_of_the_volume_of_its_mesh(name):
    config = load(ROOT / f"config/{name}.yaml")
    mesh = left_ventricle(config.geometry)
    corners = mesh.nodes[mesh.cells[:, :4]]
    volume = abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6 * 1e9
    assert wall_scatterers(config) == pytest.approx(volume * config.phantom.density_per_mm3, rel=0.05)


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
    assert areas(config, view)[1] == pytest.approx(cut.area, rel=0.1)


@pytest.mark.parametrize("rule, change", [
    ("mechanics", {"geometry": {"transmural_elements": 6}}),
    ("mechanics", {"loop": {"frames": 80}}),
    ("rf", {"phantom": {"density_per_mm3": 8000}}),
    ("rf", {"realism": {"surroundings": {"level_dB": -10}}}),
    ("phantom", {"geometry": {"scale": 1.5}}),
    ("truth", {"geometry": {"scale": 1.5}}),
    ("tracking", {"tracking": {"trackers": {"one": {"method": "ilk"}}}}),
])  # fmt: skip
def test_larger_work_has_more_units(rule, change):
    small = Config.model_validate({"tracking": {"trackers": {"one": {"method": "dis"}}}})
    large = Config.model_validate({"tracking": {"trackers": {"one": {"method": "dis"}}}} | change)
    assert units(rule, large, "mid", 512) > 1.3 * units(rule, small, "mid", 512)


@pytest.mark.parametrize("rule", ["truth", "bmode", "tracking"])
def test_smaller_images_take_less(rule):
    assert units(rule, Config(), "mid", 128) < 0.5 * units(rule, Config(), "mid", 512)


def test_jobs_that_have_ended_tell_how_fast_this_machine_is(tmp_path):
    config = load(ROOT / "config/demo.yaml")
    (case,) = expand(config)
    for view in config.views:
        write_benchmark(tmp_path, f"rf/{case.id}/{view}", 3 * seconds("rf", config, view))
        for size in config.bmode.sizes:
            write_benchmark(tmp_path, f"truth/{case.id}/{view}/{size}", 2 * seconds("truth", config, view, size))
    write_benchmark(tmp_path, f"rf/{case.id}/mid", 40 + 3 * seconds("rf", config, "mid"))  # it compiled
    write_benchmark(tmp_path, "rf/another/mid", 1e6)
    write_benchmark(tmp_path, f"rf/{case.id}/a_view_of_before", 1e6)
    found = speed(tmp_path, {case.id: config})
    assert found == {"rf": pytest.approx(3, rel=0.01), "truth": pytest.approx(2, rel=0.01)}


def test_without_jobs_nothing_is_known_of_this_machine(tmp_path):
    assert speed(tmp_path / "nothing", {}) == {}


def test_time_of_a_job_is_read_from_its_benchmark_file(tmp_path):
    assert core_seconds(write_benchmark(tmp_path, "rf/a/mid", 12.5)) == 12.5
    assert core_seconds(write_benchmark(tmp_path, "rf/a/mid", 12.5, 8.0)) == 12.5, (
        "its end is missing from the CPU time"
    )
    assert core_seconds(write_benchmark(tmp_path, "mechanics/a", 12.5, 40.0)) == 40, "of several threads"
    assert core_seconds(write_benchmark(tmp_path, "rf/a/mid", "NA", "-")) == 0
    (tmp_path / "cut.tsv").write_text("s\th:m")
    assert core_seconds(tmp_path / "cut.tsv") == core_seconds(tmp_path / "none.tsv") == 0
