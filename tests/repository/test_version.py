"""Versions: what a result depends on has another one, what it does not depend on has not, and no code is forgotten."""

import ast
from collections.abc import Iterator
from contextlib import chdir
from importlib.metadata import version
from pathlib import Path

import pytest
from finished_repository import configured

from echotruth.cases import expand
from echotruth.config import Config, shipped
from echotruth.config.loading import load
from echotruth.repository.version import BEFORE, CODE, NO_RF, PACKAGE, code_hash, motion_hash, packages, version_of

ROOT = Path(__file__).parents[2]
STAGES = list(CODE)
PASSING = (
    "__init__.py",
    "cases",
    "config",
    "extras.py",
    "files.py",
    "repository",
    "section.py",
    "threads.py",
    "workflow",
)
"""Modules and folders that pass numbers on, and whose changes make nothing again."""


def file_of(module: str) -> Path | None:
    """File of a module of the package."""
    path = PACKAGE.parent / Path(*module.split("."))
    found = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return found if module.startswith("echotruth") and found.is_file() else None


def imported(file: Path) -> Iterator[Path]:
    """Files of the package that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{file} imports by a relative name"
            names = [str(node.module), *(f"{node.module}.{name}" for name in names)]
        yield from filter(None, map(file_of, names))


def reached(stage: str) -> set[str]:
    """Files, below the package, that the script of a stage reaches by imports, less those that pass numbers on."""
    found: set[Path] = set()
    waiting = [ROOT / f"workflow/scripts/{stage}.py"]
    while waiting:
        new = {path for path in imported(waiting.pop()) if path.relative_to(PACKAGE).parts[0] not in PASSING} - found
        found |= new
        waiting += new
    return {path.relative_to(PACKAGE).as_posix() for path in found}


@pytest.mark.parametrize("stage", STAGES)
def test_version_has_all_code_that_a_stage_reaches(stage):
    files = reached(stage)
    left_out = {name for name in files if not any(name == part or name.startswith(f"{part}/") for part in CODE[stage])}
    if stage in ("phantom", "rf"):
        left_out |= files & set(NO_RF)
    assert left_out == set() and files


def test_every_place_of_the_code_is_there():
    assert [name for names in (*CODE.values(), NO_RF, PASSING) for name in names if not (PACKAGE / name).exists()] == []


@pytest.mark.parametrize(
    ("file", "stages"),
    [
        ("tracking/trackers/dis.py", {"tracking", "inference"}),
        ("imaging/bmode.py", {"truth", "bmode", "tracking", "inference"}),
        ("mechanics/solver/newton.py", set(STAGES)),
        ("repository/group.py", set()),
    ],
)
def test_changed_file_changes_the_code_of_the_stages_that_depend_on_it(monkeypatch, file, stages):
    before = {stage: code_hash.__wrapped__(stage) for stage in STAGES}
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path == PACKAGE / file))
    assert {stage for stage in STAGES if code_hash.__wrapped__(stage) != before[stage]} == stages


def test_changed_script_changes_the_code_of_its_stage_and_of_those_after_it(monkeypatch):
    before, read = {stage: code_hash.__wrapped__(stage) for stage in STAGES}, Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * path.match("scripts/bmode.py"))
    assert {stage for stage in STAGES if code_hash.__wrapped__(stage) != before[stage]} == {
        "bmode",
        "tracking",
        "inference",
    }


IMAGES = {"bmode", "tracking"}
RF = {"phantom", "rf", *IMAGES}
CHANGES = {
    "bmode.dynamic_range_dB": (35.0, IMAGES),
    "bmode.gain_dB": (3.0, IMAGES),
    "bmode.size_px": (128, IMAGES | {"truth"}),
    "bmode.downsampling": ([2], IMAGES | {"truth"}),
    "bmode.field_of_view_mm": (13.0, RF | {"truth"}),
    "tracking.grid": (0.02, {"tracking"}),
    "probe.elements": (20, RF),
    "phantom.density_per_mm3": (60.0, RF),
    "seed": (5, RF),
    "views.mid.position": (0.6, RF | {"truth"}),
    "fibres.endo_deg": (61.0, RF | {"truth", "mechanics"}),
    "loop.heart_rate_per_min": (420.0, RF | {"truth", "mechanics"}),
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
    stages = [stage for stage in BEFORE if stage != "inference"]
    changed = {stage for stage in stages if version_of(stage, before, "mid") != version_of(stage, after, "mid")}
    assert changed == expected
    if not key.startswith("views"):
        assert version_of("bmode", before, "mid") != version_of("bmode", before, "long_axis")


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
            return {stage: version_of(stage, config, "mid") for stage in BEFORE if stage != "inference"}

    one, other = versions("one"), versions("other")
    assert {stage for stage in one if one[stage] != other[stage]} == {"tracking"}


def test_reason_for_which_a_heart_is_not_imaged_is_in_the_version():
    assert version_of("rf", configured(), "mid", "failed") != version_of("rf", configured(), "mid")


@pytest.mark.parametrize("name", [name for name in shipped.names() if name not in ("fimh25", "rodero")])
def test_cases_have_one_heart_if_and_only_if_they_move_alike(name):
    """Of two configurations the hearts are in files that are not here."""
    with chdir(ROOT):
        cases = expand(load(f"config/{name}.yaml"))[:40]
    motions = {case.heart: motion_hash(case.config) for case in cases}
    assert all(motion_hash(case.config) == motions[case.heart] for case in cases)
    assert len(set(motions.values())) == len(motions)


def test_versions_of_packages_are_those_of_their_distributions():
    found = packages()
    assert all(found[name] == version(name) for name in ("numpy", "scikit-image", "echotruth")) and "opencv" in found
