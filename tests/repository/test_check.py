"""A check finds every fault of a repository, and healing it makes just what was damaged, byte for byte."""

import json
import os
import shutil
from pathlib import Path
from shutil import copytree, rmtree

import finished_repository as finished
import numpy as np
import pytest
import zarr

from echotruth.config import Motion, Phantom, PhaseCorrelation, Tracking
from echotruth.repository import ledger
from echotruth.repository.check import check
from echotruth.repository.checksums import checksums, commit_beside
from echotruth.repository.healing import heal
from echotruth.repository.inventory import CheckError
from echotruth.repository.ledger import record_path
from echotruth.repository.store import Store
from echotruth.workflow import lease
from echotruth.workflow.integrity import check_repository

CONFIG = finished.configured()
CASES = [case.id for case in finished.expand(CONFIG)]


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    return finished.finish(tmp_path_factory.mktemp("done") / "small", CONFIG)


@pytest.fixture
def folder(done, tmp_path) -> Path:
    return copytree(done, tmp_path / "small")


def faults(folder) -> dict[str, str]:
    return {fault.path: fault.problem for fault in check(folder).faults}


def flip(path: Path, random: np.random.Generator) -> None:
    """Flip one bit at a random place."""
    content = bytearray(path.read_bytes())
    bit = int(random.integers(8 * len(content)))
    content[bit // 8] ^= 1 << bit % 8
    replace(path, bytes(content))


def replace(path: Path, content: bytes) -> None:
    """Write a file of its own: others may be further names of the same data."""
    path.unlink()
    path.write_bytes(content)


def truncate(path: Path, random: np.random.Generator) -> None:
    content = path.read_bytes()
    replace(path, content[: int(random.integers(1, len(content)))])


def empty(path: Path, random: np.random.Generator) -> None:
    replace(path, b"")


def delete(path: Path, random: np.random.Generator) -> None:
    path.unlink()


def run(folder) -> list[str]:
    """Make what was dropped, as `echotruth run` does; give the records that were made."""
    return finished.remake(folder, CONFIG)


def test_whole_repository_has_no_fault(folder):
    report = check(folder)
    assert report.faults == [] and report.notes == []
    assert report.files == len(finished.content(folder))
    assert report.jobs == len(CASES) * (1 + 5 * len(CONFIG.views))


@pytest.mark.parametrize("harm, count", [(flip, 120), (truncate, 40), (empty, 40), (delete, 40)])
def test_every_damaged_file_is_found_wherever_it_is(folder, harm, count):
    random = np.random.default_rng(count)
    files = random.choice(sorted(finished.content(folder)), count, replace=False)
    for name in files:
        harm(folder / name, random)
    assert set(faults(folder)) == set(files)


@pytest.mark.parametrize(
    "seed, harm",
    [(0, flip), (3, delete), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((1, truncate), (2, empty)))],
)
def test_healing_makes_the_damaged_jobs_again_and_no_others_byte_for_byte(folder, seed, harm):
    before, owners, random = finished.content(folder), finished.owners(folder), np.random.default_rng(seed)
    files = random.choice(sorted(before), 5, replace=False)
    for name in files:
        harm(folder / name, random)
    heal(check(folder))
    concerned = {owners[name].replace("structure.json", "repository.json") for name in files}
    assert set(run(folder)) == concerned | {"ledger/repository.json"}
    assert finished.content(folder) == before
    assert check(folder).faults == []


@pytest.mark.slow
@pytest.mark.parametrize("seed, harm", list(enumerate([flip, truncate, empty])))
def test_damaged_records_are_found_and_made_again(folder, seed, harm):
    before, random = finished.content(folder), np.random.default_rng(seed)
    paths = [record_path(folder, "mechanics", CASES[1]), record_path(folder, "rf", CASES[0], "mid")]
    paths += [record_path(folder, stage, CASES[0], "mid", finished.SIZE) for stage in ("truth", "tracking")]
    names = {path.relative_to(folder).as_posix() for path in paths}
    for path in paths:
        harm(path, random)
    assert set(faults(folder)) == names
    heal(check(folder))
    assert set(run(folder)) == names | {"ledger/repository.json"}
    assert finished.content(folder) == before


@pytest.mark.slow
@pytest.mark.parametrize("harm", [flip, delete])
@pytest.mark.parametrize("name", ["ledger/structure.json", "ledger/repository.json", "registry.txt", "views.txt"])
def test_damaged_record_of_the_structure_and_registries_are_found_and_written_again(folder, harm, name):
    before, whole = finished.content(folder), (folder / name).read_bytes()
    harm(folder / name, np.random.default_rng(5))
    if (harm, name) == (delete, "ledger/repository.json"):
        assert check(folder).notes == ["the repository has not been published yet: echotruth run does so"]
        return
    assert set(faults(folder)) == {name}
    heal(check(folder))
    assert run(folder) == ["ledger/repository.json"]
    assert finished.content(folder) == before and (folder / name).read_bytes() == whole
    assert check(folder).faults == []


@pytest.mark.slow
def test_strangers_are_found_and_deleted_and_what_is_not_made_yet_is_no_stranger(folder):
    before = finished.content(folder)
    strays = ["bmode/64/image/c/0/0/0/0/0.0123.partial", "bmode/64/image/c/7/0/0/0/0", "mechanics/note.txt", "stray"]
    for name in strays:
        (folder / "small.zarr" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "small.zarr" / name).write_bytes(b"half")
    assert set(faults(folder)) == {f"small.zarr/{name}" for name in strays}
    assert heal(check(folder)) == (0, len(strays))
    assert finished.content(folder) == before
    record_path(folder, "bmode", CASES[0], "mid", finished.SIZE).unlink()
    assert faults(folder) == {}


def test_jobs_that_were_not_run_yet_are_told_and_are_no_damage(folder, capsys):
    record_path(folder, "tracking", CASES[0], "mid", finished.SIZE).unlink()
    assert check_repository(folder, healing=False) == 0
    assert "1 of 22 jobs have not been run yet" in capsys.readouterr().out


@pytest.mark.slow
def test_command_names_each_fault_in_one_line_and_what_heals_it(folder, capsys):
    delete(folder / "small.zarr/bmode/64/image/c/0/0/0/0/0", None)
    assert check_repository(folder, healing=False) == 1
    assert capsys.readouterr().out.splitlines()[-1].startswith(f"To mend it: echotruth check {folder} --heal, and then")
    assert check_repository(folder, healing=True) == 1
    lines = capsys.readouterr().out.splitlines()
    job = f"bmode of {CASES[0]}, mid, 64 px"
    assert lines[0] == f"small.zarr/bmode/64/image/c/0/0/0/0/0: is missing: echotruth run makes it again ({job})"
    assert lines[-1] == "dropped: 1 records and 0 files: echotruth run makes them again"
    assert check_repository(folder, healing=False) == 0


def test_folder_that_is_no_repository_is_refused_in_a_sentence(tmp_path, capsys):
    with pytest.raises(CheckError):
        check(tmp_path)
    assert [check_repository(tmp_path, healing=healing) for healing in (False, True)] == [2, 2]
    assert capsys.readouterr().err.count("is not a repository") == 2
    assert not list(tmp_path.iterdir())


def test_repository_that_a_run_is_writing_is_not_healed(folder, capsys):
    held = lease.acquire(folder, "another", wait=False)
    try:
        assert check_repository(folder, healing=True) == 2
        assert check_repository(folder, healing=False) == 0
    finally:
        held.release()
    told = capsys.readouterr()
    assert "is in use by another run" in told.err and "is in use by another run" in told.out


def rewrite(folder, stage, group, *place, **values) -> None:
    """Write other values with right checksums, as wrong code would."""
    store, row = Store(folder / "small.zarr"), (0, 0) if place else (0,)
    store.write(group, values, *row)
    path = record_path(folder, stage, CASES[0], *place)
    record = ledger.read(path)
    record["sha256"] |= checksums(store.files(group, *row), store.path)
    ledger.commit(path, record)


def stored(folder, group, name, *row):
    return np.array(zarr.open_array(folder / "small.zarr", path=f"{group}/{name}", mode="r")[row])


def test_impossible_value_is_found_and_is_not_taken_for_damage(folder):
    motion = stored(folder, "truth/64", "displacement", 0, 0)
    motion[0, 8, 9] = 1e-4
    rewrite(folder, "truth", "truth/64", "mid", 64, displacement=motion)
    report = check(folder)
    assert [fault.path for fault in report.faults] == ["small.zarr/truth/64/displacement"]
    assert "is not 0 at end-diastole" in report.faults[0].problem
    assert heal(report) == (0, 0)


def test_measured_loop_error_that_the_curves_do_not_have_is_found(folder):
    measured = Store(folder / "small.zarr").read("physiology", 0)
    rewrite(folder, "mechanics", "physiology", **measured | {"loop_error": 0.001})
    assert faults(folder) == {
        "small.zarr/physiology/scalars": f"loop_error is 0.001, but the curves give 0 (mechanics of {CASES[0]})"
    }


def test_quantum_that_is_not_that_of_the_configuration_is_found(folder):
    file = folder / "small.zarr/tracking/64/one/quality/zarr.json"
    replace(file, file.read_bytes().replace(b'"quantum": 0.00390625', b'"quantum": 0.5'))
    record = ledger.read(folder / "ledger/structure.json")
    record["sha256"] |= checksums([file], folder / "small.zarr")
    ledger.commit(folder / "ledger/structure.json", record)
    assert faults(folder) == {"small.zarr/tracking/64/one/quality": "has quantum 0.5, not 0.00390625"}


def test_units_that_are_not_those_of_the_schema_are_found(folder):
    file = folder / "small.zarr/mechanics/pressure/zarr.json"
    replace(file, file.read_bytes().replace(b'"units": "Pa"', b'"units": "kPa"'))
    record = ledger.read(folder / "ledger/structure.json")
    record["sha256"] |= checksums([file], folder / "small.zarr")
    ledger.commit(folder / "ledger/structure.json", record)
    assert faults(folder) == {"small.zarr/mechanics/pressure": "has units 'kPa', not 'Pa'"}


def exchange(one: Path, other: Path) -> None:
    contents = one.read_bytes(), other.read_bytes()
    for path, content in zip((other, one), contents, strict=True):
        path.write_bytes(content)


EXCHANGED = [
    ("bmode/64/image", "truth/64/labels"),
    ("mechanics/volume", "evaluation/64/reference"),
    ("fibres/xyz", "mechanics/displacement"),
    ("geometry/node_position", "evaluation/64/one/score_units"),
]


@pytest.mark.parametrize("arrays", EXCHANGED)
def test_exchanged_metadata_are_found_and_no_values_are_read_by_them(folder, arrays):
    paths = [folder / "small.zarr" / array / "zarr.json" for array in arrays]
    exchange(*paths)
    assert set(faults(folder)) == {path.relative_to(folder).as_posix() for path in paths}


@pytest.mark.parametrize("array", ["bmode/64/image", "physiology/scalars", "mechanics/pressure"])
@pytest.mark.parametrize(
    "edited",
    [
        {"shape": [0, 0, 0, 0]},
        {"data_type": "int16"},
        {"codecs": [{"name": "bytes"}]},
        {"node_type": "group"},
        {"attributes": []},
    ],
)
def test_edited_metadata_are_found_even_if_the_record_has_their_checksum(folder, array, edited):
    path, before = folder / "small.zarr" / array / "zarr.json", finished.content(folder)
    document = json.loads(path.read_bytes())
    if "shape" in edited:
        edited = {"shape": [0] * len(document["shape"])}
    path.write_text(json.dumps(document | edited))
    record = ledger.read(folder / "ledger/structure.json")
    record["sha256"] |= checksums([path], folder / "small.zarr")
    ledger.commit(folder / "ledger/structure.json", record)
    found = check(folder)
    assert [fault.path for fault in found.faults] == [
        f"small.zarr/{array.rpartition('/')[0] if 'codecs' in edited else array}"
    ]
    heal(found)
    run(folder)
    assert check(folder).faults == [] and finished.content(folder) == before


def test_edited_configuration_is_found_and_stands_alone(folder):
    """By other settings nearly all files would be wrong, and healing would drop them."""
    path = folder / "config.yaml"
    text = path.read_text()
    path.write_text(text.replace("frames: 3", "frames: 4"))
    assert faults(folder) == {"config.yaml": "differs from what was written"}
    assert heal(check(folder)) == (0, 0)
    run(folder)
    assert path.read_text() == text and check(folder).faults == []


@pytest.mark.parametrize("name", ["cases.csv", f"cases/{CASES[1]}.json"])
@pytest.mark.parametrize("harm", [flip, empty, delete])
def test_damaged_table_and_configurations_of_hearts_are_found_and_written_again(folder, name, harm):
    before = (folder / name).read_bytes()
    harm(folder / name, np.random.default_rng(2))
    assert set(faults(folder)) == {name}
    heal(check(folder))
    run(folder)
    assert (folder / name).read_bytes() == before and check(folder).faults == []


@pytest.mark.parametrize("harm", [flip, truncate, empty, delete])
def test_damaged_report_and_figures_are_found_and_deleted(folder, harm):
    files = [folder / "report.html", folder / "figures/loop.png"]
    for file in files:
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(b"drawn once")
    commit_beside(folder, folder / "ledger/report.json", files)
    assert check(folder).faults == []
    harm(files[1], np.random.default_rng(3))
    assert set(faults(folder)) == {"figures/loop.png"}
    heal(check(folder))
    assert files[0].exists() and not files[1].exists()


@pytest.mark.parametrize(("name", "page"), [("configuration", False), ("report", True)])
def test_missing_record_of_the_files_beside_the_store_is_found(folder, name, page):
    """Without it nothing vouches for them."""
    (folder / "report.html").write_bytes(b"drawn once")
    commit_beside(folder, folder / "ledger/report.json", [folder / "report.html"])
    (folder / f"ledger/{name}.json").unlink()
    assert faults(folder) == {f"ledger/{name}.json": "is missing"}
    heal(check(folder))
    run(folder)
    assert check(folder).faults == []
    assert (folder / "report.html").exists() is not page  # a run draws it again


def test_record_of_the_report_in_place_of_that_of_the_publication_is_found(folder):
    commit_beside(folder, folder / "ledger/repository.json", [])
    assert faults(folder) == {"ledger/repository.json": "cannot be read (it is not that of a publication)"}


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def loop(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)


def directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize("harm", [pipe, device, loop, directory])
def test_what_is_no_file_is_found_without_waiting_for_its_end_and_made_again(folder, harm):
    names = ["small.zarr/bmode/64/image/c/0/0/0/0/0", "small.zarr/bmode/64/image/zarr.json", "cases.csv"]
    names.append(record_path(folder, "truth", CASES[0], "mid", finished.SIZE).relative_to(folder).as_posix())
    before = finished.content(folder)
    for name in names:
        harm(folder / name)
    assert set(names) <= set(faults(folder))
    heal(check(folder))
    run(folder)
    assert check(folder).faults == [] and finished.content(folder) == before


@pytest.mark.parametrize("record", ["structure.json", "configuration.json", "bmode"])
def test_healing_touches_no_file_outside(folder, record):
    """The records of a repository that comes from elsewhere may name any file."""
    path = (
        record_path(folder, "bmode", CASES[0], "mid", finished.SIZE)
        if record == "bmode"
        else folder / "ledger" / record
    )
    mine, key = folder.with_name("mine"), "files" if record == "configuration.json" else "sha256"
    mine.write_text("mine")
    known = ledger.read(path)
    known[key] |= {name: "0" * 64 for name in (str(mine), "../mine", "../../mine")}
    ledger.commit(path, known)
    found = check(folder)
    assert path.relative_to(folder).as_posix() in {fault.path for fault in found.faults}
    heal(found)
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    ("changes", "concerned"),
    [
        ({"tracking": Tracking(trackers={"one": PhaseCorrelation(window_px=24)})}, ["tracking"]),
        ({"phantom": Phantom(density_per_mm3=50)}, ["phantom", "rf", "bmode", "tracking"]),
        ({"motion": Motion(kind="rigid")}, [*ledger.stages(CONFIG)]),
    ],
)
def test_results_of_other_settings_are_found_though_their_records_vouch_for_them(folder, tmp_path, changes, concerned):
    other = finished.finish(tmp_path / "other" / "small", finished.configured(**changes))
    for path in ["small.zarr", *(f"ledger/{stage}" for stage in ledger.stages(CONFIG))]:
        rmtree(folder / path)
        copytree(other / path, folder / path)
    shutil.copy(other / "ledger/structure.json", folder / "ledger")
    expected = {
        path.relative_to(folder).as_posix() for stage in concerned for path in folder.glob(f"ledger/{stage}/**/*.json")
    }
    found = faults(folder)
    assert set(found) == expected and set(found.values()) == {"is of other settings than those of config.yaml"}
