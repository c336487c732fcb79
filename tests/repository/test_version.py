"""Versions: what a result depends on has another one, what it does not depend on has not, and no code is forgotten."""

import subprocess
import sys
from contextlib import chdir
from importlib.metadata import version
from pathlib import Path

import pytest
from finished_repository import configured

from echotruth.cases import expand
from echotruth.config import Config, shipped
from echotruth.config.loading import load
from echotruth.config.pathology import SCARS, Infarct, Pathology
from echotruth.repository.code import PACKAGE, _hash, code_hash, files_of, imported
from echotruth.repository.version import BEFORE, packages, version_of

ROOT = Path(__file__).parents[2]
STAGES = list(BEFORE)
OF_VIEW = [stage for stage in STAGES if stage != "inference"]


LOADED = "import {script}, sys; print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('echotruth')))"


@pytest.mark.parametrize("stage", ["bmode", pytest.param("tracking", marks=pytest.mark.slow)])
def test_modules_that_a_script_loads_are_counted_but_for_those_that_the_passing_ones_load(stage):
    def loaded(script):
        run = [sys.executable, "-c", LOADED.format(script=script)]
        return set(subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split())

    passing = loaded("echotruth.workflow.job")
    counted = {str(file) for file in files_of(stage)}
    extra = {
        name for name in loaded(f"workflow.scripts.{stage}") - passing - counted if not name.endswith("__init__.py")
    }
    assert {name for name in extra if "/repository/" not in name and "/config/" not in name} == set()


def changed(monkeypatch, change, **settings):
    """Stages of a view whose version is another one after a change of a file."""
    config = configured(**settings)

    def versions():
        _hash.cache_clear()
        imported.cache_clear()
        return {stage: version_of(stage, config, "mid", "one") for stage in OF_VIEW}

    before, read, text = versions(), Path.read_bytes, Path.read_text
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path.match(change)))
    after = versions()
    monkeypatch.setattr(Path, "read_bytes", read)
    _hash.cache_clear()
    assert Path.read_text is text
    return {stage for stage in OF_VIEW if before[stage] != after[stage]}


@pytest.mark.parametrize(
    ("file", "stages"),
    [
        ("tracking/trackers/phase_correlation.py", {"tracking"}),
        ("tracking/trackers/bspline_dic.py", set()),
        ("tracking/quality.py", {"tracking"}),
        ("imaging/bmode.py", {"truth", "bmode", "points", "tracking"}),
        ("mechanics/solver/newton.py", set(OF_VIEW)),
        ("materials/fung.py", set(OF_VIEW)),
        ("materials/neo_hooke.py", set()),
        ("mechanics/motion_file/series.py", set()),
        ("mechanics/geometry/remeshing.py", set()),
        ("repository/group.py", set()),
        ("repository/rounding.py", set(OF_VIEW)),
        ("echotruth/units.py", set(OF_VIEW)),
        ("report/style.py", set()),
        ("scripts/bmode.py", {"bmode", "tracking"}),
        ("scripts/points.py", {"points", "tracking"}),
    ],
)
def test_changed_file_changes_the_versions_of_the_stages_that_use_it_and_of_those_after_them(monkeypatch, file, stages):
    assert changed(monkeypatch, file, motion={}) == stages


def test_reader_of_a_motion_counts_where_a_motion_is_read(monkeypatch):
    assert code_hash("mechanics", (), ("echotruth.mechanics.motion_file",)) != code_hash("mechanics")


def test_unit_that_is_another_number_changes_every_version():
    assert PACKAGE / "units.py" in files_of("bmode") and "UNITS" in (PACKAGE / "units.py").read_text()


def test_data_of_a_module_count_as_it_does():
    names = {file.name for file in files_of("report")} | {file.name for file in files_of("inference")}
    assert {"page.css", "page.html.jinja", "player.js", "figure.mplstyle", "tracker_errors.csv", "arrays.csv"} <= names
    assert "bspline_cnn.npz" in {
        file.name for file in files_of("tracking", ["echotruth.tracking.trackers.bspline_cnn"])
    }


def test_other_stiffness_of_an_old_scar_is_another_version(monkeypatch):
    config = configured(pathology=Pathology(infarct=Infarct(segments=[7], age="old")))
    before = version_of("mechanics", config)
    monkeypatch.setitem(SCARS, "old", SCARS["old"] | {"stiffness_scale": 6.0})
    assert version_of("mechanics", config) != before


IMAGES = {"bmode", "tracking"}
RF = {"phantom", "rf", *IMAGES}
CHANGES = {
    "bmode.dynamic_range_dB": (35.0, IMAGES),
    "bmode.gain_dB": (3.0, IMAGES),
    "bmode.size_px": (128, IMAGES | {"truth", "points"}),
    "bmode.downsampling": ([2], IMAGES | {"truth", "points"}),
    "bmode.field_of_view_mm": (13.0, RF | {"truth", "points"}),
    "tracking.grid": (0.02, {"points", "tracking"}),
    "tracking.frame_step": (2, {"tracking"}),
    "probe.elements": (20, RF),
    "phantom.density_per_mm3": (60.0, RF),
    "seed": (5, RF),
    "views.mid.position": (0.6, RF | {"truth", "points"}),
    "fibres.endo_deg": (61.0, RF | {"truth", "points", "mechanics"}),
    "loop.heart_rate_per_min": (420.0, RF | {"truth", "points", "mechanics"}),
    "physiology.twist_max_deg": (50.0, set()),
    "name": ("other", set()),
}
"""Key -> other value, and the stages of a view that are made again with it."""


@pytest.mark.parametrize("key", CHANGES)
def test_setting_changes_the_versions_of_the_stages_that_depend_on_it_and_no_others(key):
    value, expected = CHANGES[key]
    values = configured().model_dump()
    section, parts = values, key.split(".")
    for part in parts[:-1]:
        section = section[part]
    assert section[parts[-1]] != value
    section[parts[-1]] = value
    before, after = configured(), Config.model_validate(values)
    found = {one for one in OF_VIEW if version_of(one, before, "mid", "one") != version_of(one, after, "mid", "one")}
    assert found == expected
    if not key.startswith("views"):
        assert version_of("bmode", before, "mid") != version_of("bmode", before, "long_axis")


def test_beats_change_the_version_of_the_heart():
    lengths = [[{}], [{}, {}], [{"length": 0.9}, {}], [{}, {"stroke": 0.9}]]
    assert len({version_of("mechanics", Config.model_validate({"loop": {"beats": beats}})) for beats in lengths}) == 4


@pytest.mark.parametrize(
    ("file", "tracker"),
    [
        ("program.py", {"method": "external", "command": ["python", "program.py", "{input}", "{output}"]}),
        ("model.onnx", {"method": "onnx", "model": "model.onnx"}),
        ("model.yaml", {"method": "onnx", "model": "model.onnx"}),
        ("model.onnx.data", {"method": "onnx", "model": "model.onnx"}),
    ],
)
def test_file_that_a_tracker_names_changes_its_tracking_alone(tmp_path, file, tracker):
    def versions(text):
        program = tmp_path / text / file
        program.parent.mkdir()
        program.write_text(text)
        with chdir(program.parent):
            config = configured(tracking={"trackers": {"own": tracker}})
            return {stage: version_of(stage, config, "mid", "own") for stage in OF_VIEW}

    one, other = versions("one"), versions("other")
    assert {stage for stage in one if one[stage] != other[stage]} == {"tracking"}


def test_reason_for_which_a_heart_is_not_imaged_is_in_the_version():
    assert version_of("rf", configured(), "mid", excluded="failed") != version_of("rf", configured(), "mid")


@pytest.mark.parametrize("name", [name for name in shipped.names() if name not in ("fimh25", "rodero")])
def test_cases_have_one_heart_if_and_only_if_they_move_alike(name):
    """Of two configurations the hearts are in files that are not here."""
    with chdir(ROOT):
        cases = expand(load(f"config/{name}.yaml"))[:40]
    motions = {case.heart: version_of("mechanics", case.config) for case in cases}
    assert all(version_of("mechanics", case.config) == motions[case.heart] for case in cases)
    assert len(set(motions.values())) == len(motions)


def test_versions_of_packages_are_those_of_their_distributions():
    found = packages()
    assert all(found[name] == version(name) for name in ("numpy", "scikit-image", "echotruth")) and "opencv" in found
