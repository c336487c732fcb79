"""Merging gives one repository the hearts of several, and leaves what was there as it was."""

from pathlib import Path
from shutil import copytree

import finished_repository as finished
import numpy as np
import pytest
import xarray as xr
import zarr

from echotruth.config import Probe
from echotruth.config.loading import load
from echotruth.repository import ledger
from echotruth.repository.check import check
from echotruth.repository.checksums import checksums
from echotruth.repository.ledger import record_path
from echotruth.repository.merge import MergeError, spanning
from echotruth.repository.store import Store
from echotruth.workflow.merging import merge_repositories

FIRST = finished.configured("first", seeds=(1, 2))
SECOND = finished.configured("second", seeds=(2, 3), views=("long_axis", "mid"))


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Folder of two repositories with one heart in common, and their views in another order."""
    folder = tmp_path_factory.mktemp("out")
    for config in (FIRST, SECOND):
        finished.finish(folder / config.name, config)
    return folder


@pytest.fixture
def out(made, tmp_path) -> Path:
    return copytree(made, tmp_path / "out")


def clips(folder: Path) -> dict[tuple[str, str], bytes]:
    """Case and view -> all images, by their labels."""
    images = xr.open_datatree(folder / f"{folder.name}.zarr")["bmode/64/image"]
    cases, views = (images[name].values for name in ("case", "view"))
    return {(case, view): images.sel(case=case, view=view).values.tobytes() for case in cases for view in views}


def test_merged_repository_has_the_hearts_of_both_and_is_whole(out):
    before = {folder: finished.content(out / folder) for folder in ("first", "second")}
    assert merge_repositories(out / "both", [out / "first", out / "second"]) == 0
    report = check(out / "both")
    assert report.faults == [] and report.notes == []
    assert load(out / "both/config.yaml").cases.grid == {"seed": [1, 2, 3]}
    assert clips(out / "both") == clips(out / "first") | clips(out / "second")
    assert len(clips(out / "both")) == 6
    assert {folder: finished.content(out / folder) for folder in before} == before
    tree = xr.open_datatree(out / "both/both.zarr")
    assert list(tree["cases/seed"].values) == [1, 2, 3]
    assert list(tree["cases/status"].values) == 3 * ["complete"]


@pytest.mark.parametrize("into", ["both", "first"])
def test_record_that_cannot_be_read_is_named(out, capsys, into):
    """One that names a file outside would be merged into a place of its choice."""
    path = record_path(out / "second", "bmode", next(iter(finished.expand(SECOND))).id, "mid", finished.SIZE)
    known = ledger.read(path)
    known["sha256"]["../../../mine/c/0/0"] = "0" * 64
    ledger.commit(path, known)
    assert merge_repositories(out / into, [out / "second"]) == 2
    told = capsys.readouterr().err
    assert (
        f"{path}: cannot be read (it names a file outside of the repository" in told and "before it is merged" in told
    )


def test_hearts_are_added_without_a_change_of_what_was_there(out):
    before, owners, times = finished.content(out / "first"), finished.owners(out / "first"), {}
    for path in (out / "first/ledger").glob("*/**/*.json"):
        times[path] = path.stat().st_mtime_ns
    assert merge_repositories(out / "first", [out / "second"]) == 0
    after = finished.content(out / "first")
    shards = [name for name in before if not owners[name].endswith("structure.json")]
    assert {name: after[name] for name in shards} == {name: before[name] for name in shards}
    assert {path: path.stat().st_mtime_ns for path in times} == times
    assert (out / "first/registry.txt").read_text().split()[:2] == [case.id for case in finished.expand(FIRST)]
    assert check(out / "first").faults == []


def test_records_keep_their_times_so_that_nothing_is_run_again(out):
    merge_repositories(out / "both", [out / "first", out / "second"])
    for folder, case in (("first", 0), ("second", 1)):
        id = [case.id for case in finished.expand({"first": FIRST, "second": SECOND}[folder])][case]
        paths = [record_path(out / name, "bmode", id, "mid", finished.SIZE) for name in (folder, "both")]
        assert paths[0].stat().st_mtime_ns == paths[1].stat().st_mtime_ns


HERE = "that of this machine"


def rewrite(folder, stage, group, index, instructions, **values):
    """Write arrays of a job of the common heart anew, as a machine of some kind would; give the name of the heart."""
    case, store = finished.expand(FIRST)[1].id, Store(folder / f"{folder.name}.zarr")
    store.write(group, values, *index)
    path = record_path(folder, stage, case, *(("mid", finished.SIZE) if len(index) > 1 else ()))
    record = ledger.read(path)
    kind = {} if instructions == HERE else {"instructions": instructions}
    ledger.commit(
        path, record | kind | {"sha256": record["sha256"] | checksums(store.files(group, *index), store.path)}
    )
    return case


def solve(out, change):
    """Give both repositories a displacement of the heart that both have, the first's made elsewhere and changed."""
    shape = np.shape(Store(out / "first/first.zarr").read("mechanics", 1)["displacement"])
    displacement = 1e-4 * np.random.default_rng(1).standard_normal(shape)
    rewrite(out / "second", "mechanics", "mechanics", (0,), HERE, displacement=displacement)
    return rewrite(out / "first", "mechanics", "mechanics", (1,), "native older", displacement=change(displacement))


def test_same_heart_with_other_bytes_is_refused_by_name_before_anything_changes(out, capsys):
    case = rewrite(out / "first", "bmode", "bmode/64", (1, 0), HERE, image=np.zeros((finished.FRAMES, 64, 64)))
    assert merge_repositories(out / "both", [out / "first", out / "second"]) == 2
    assert f"bmode of {case}, mid, 64 px has other bytes than in" in capsys.readouterr().err
    assert not (out / "both").exists()


@pytest.mark.parametrize("into, other, row", [("first", "second", 1), ("second", "first", 0)])
def test_heart_of_two_kinds_of_machines_that_differs_by_rounding_is_merged_and_stays_as_it_was(out, into, other, row):
    solve(out, lambda displacement: displacement * (1 + 1e-8))
    before = Store(out / f"{into}/{into}.zarr").read("mechanics", row)["displacement"]
    assert merge_repositories(out / into, [out / other]) == 0
    assert check(out / into).faults == []
    np.testing.assert_array_equal(Store(out / f"{into}/{into}.zarr").read("mechanics", row)["displacement"], before)


def test_heart_of_two_kinds_of_machines_that_differs_by_more_is_refused_with_the_array(out, capsys):
    case = solve(out, lambda displacement: displacement * (1 + 1e-4))
    assert merge_repositories(out / "both", [out / "first", out / "second"]) == 2
    told = capsys.readouterr().err
    assert f"mechanics of {case} was made with other instructions (" in told and "native older" in told
    assert "and mechanics/displacement differs by more than rounding from" in told and told.count("\n") == 1


def one_wrong(displacement):
    changed = displacement.copy()
    changed[-1, 7, 2] += 1e-5
    return changed


def test_one_wrong_number_of_a_solution_is_not_rounding(out):
    solve(out, one_wrong)
    assert merge_repositories(out / "first", [out / "second"]) == 2


def test_results_of_other_code_are_refused_though_they_differ_by_rounding(out):
    path = record_path(out / "first", "mechanics", solve(out, lambda displacement: displacement * (1 + 1e-8)))
    ledger.commit(path, ledger.read(path) | {"code": "other"})
    assert merge_repositories(out / "first", [out / "second"]) == 2


def test_damage_of_a_heart_of_another_kind_is_told_as_damage(out, capsys):
    solve(out, lambda displacement: displacement * (1 + 1e-8))
    shard = next(path for path in (out / "first/first.zarr/mechanics/displacement/c/1").rglob("*") if path.is_file())
    shard.write_bytes(shard.read_bytes()[:-1] + b"!")
    assert merge_repositories(out / "first", [out / "second"]) == 2
    assert "heal" in capsys.readouterr().err


@pytest.mark.parametrize("change, is_merged", [(1, True), (2, False)])
def test_images_of_two_kinds_of_machines_may_differ_by_a_grey_level(out, change, is_merged):
    images = Store(out / "first/first.zarr").read("bmode/64", 1, 0)["image"].astype(int)
    inwards = np.where(images < 128, change, -change)
    rewrite(out / "first", "bmode", "bmode/64", (1, 0), "native older", image=images + inwards)
    assert (merge_repositories(out / "first", [out / "second"]) == 0) == is_merged


@pytest.mark.parametrize("factor, is_merged", [(1 + 1e-7, True), (np.nan, False), (1.01, False)])
def test_measures_of_two_kinds_of_machines_may_differ_by_rounding_in_their_unit(out, factor, is_merged, capsys):
    scalars = np.asarray(zarr.open_array(out / "first/first.zarr", path="physiology/scalars")[1])
    assert np.abs(scalars).max() > 0
    rewrite(out / "first", "mechanics", "physiology", (1,), "native older", scalars=scalars * factor)
    assert (merge_repositories(out / "first", [out / "second"]) == 0) == is_merged
    assert is_merged or "physiology/scalars differs by more than rounding" in capsys.readouterr().err


def test_damaged_repository_is_not_merged(out, capsys):
    (out / "second/second.zarr/bmode/64/image/c/1/0/0/0/0").write_bytes(b"")
    assert merge_repositories(out / "first", [out / "second"]) == 2
    assert "heal" in capsys.readouterr().err
    assert check(out / "first").faults == []


def test_repositories_of_other_settings_are_refused_with_the_key(out, capsys):
    other = finished.configured("third", probe=Probe(elements=48))
    with pytest.raises(MergeError, match=r"out/third: probe.elements differs from that of out/first"):
        spanning("both", {Path("out/first"): FIRST, Path("out/third"): other})
    with pytest.raises(MergeError, match="views differs"):
        spanning("both", {Path("out/first"): FIRST, Path("out/third"): finished.configured(views=("mid",))})


def test_sweep_of_all_cases_spans_keys_that_one_repository_does_not_sweep():
    other = finished.configured("other", cases={"fibres.endo_deg": [60, 70]})
    joint = spanning("both", {Path("a"): FIRST, Path("b"): other})
    assert joint.cases.grid == {"seed": [1, 2], "fibres.endo_deg": [FIRST.fibres.endo_deg, 60, 70]}
    ids = {case.id for case in finished.expand(joint)}
    assert {case.id for config in (FIRST, other) for case in finished.expand(config)} <= ids


def test_sweep_of_all_cases_spans_keys_of_views():
    position = FIRST.views["mid"].position
    other = finished.configured("other", cases={"views.mid.position": [0.4, 0.6]})
    joint = spanning("both", {Path("a"): FIRST, Path("b"): other})
    assert joint.cases.grid == {"seed": [1, 2], "views.mid.position": [position, 0.4, 0.6]}


def test_hearts_of_the_joint_sweep_that_neither_has_are_left_to_a_run(out, capsys):
    finished.finish(out / "third", finished.configured("third", cases={"fibres.endo_deg": [60]}))
    assert merge_repositories(out / "first", [out / "third"]) == 0
    assert "jobs of the joint sweep were not made" in capsys.readouterr().out
    report = check(out / "first")
    assert report.faults == [] and "have not been run yet" in report.notes[0]


def test_repository_of_another_layout_is_refused_in_a_sentence(out, capsys):
    """A store in which image sizes and trackers were dimensions of one group."""
    store = out / "second/second.zarr"
    (store / "tracking/64/one").rename(store / "one")
    (store / "tracking").rename(store / "64")
    (store / "one").rename(store / "tracking")
    assert merge_repositories(out / "first", [out / "second"]) == 2
    told = capsys.readouterr().err
    assert f"{out / 'second'}: was made by an earlier version: run it again" in told and told.count("\n") == 1


def test_what_is_no_repository_is_refused_in_a_sentence(out, capsys):
    assert merge_repositories(out / "both", [out / "first", out / "absent"]) == 2
    assert merge_repositories(out / "first", [out / "first"]) == 2
    assert capsys.readouterr().err.count("\n") == 2


KILLED = [
    ["registry.txt"],
    ["registry.txt", "views.txt", "both.zarr/cases/zarr.json", "ledger/.structure.json.host.1.partial"],
    ["registry.txt", "views.txt", "both.zarr/zarr.json", "ledger/structure.json", "cases/heart.json", "cases.csv"],
]


@pytest.mark.parametrize("left", KILLED)
def test_merge_that_was_killed_before_its_configuration_is_repeated(out, left):
    for name in left:
        (out / "both" / name).parent.mkdir(parents=True, exist_ok=True)
        (out / "both" / name).write_text("")
    assert merge_repositories(out / "both", [out / "first", out / "second"]) == 0
    assert load(out / "both/config.yaml").cases.grid == {"seed": [1, 2, 3]}
    assert not [fault for fault in check(out / "both").faults if not fault.path.endswith(".partial")]


def test_folder_of_other_things_is_not_merged_into(out, capsys):
    (out / "both").mkdir()
    (out / "both/thesis.tex").write_text("words")
    assert merge_repositories(out / "both", [out / "first"]) == 2
    assert "both: is not a repository" in capsys.readouterr().err
    assert [path.name for path in (out / "both").iterdir()] == ["thesis.tex"]
