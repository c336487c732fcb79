"""Hearts with the same motion are solved once, and each keeps its own record and its own names of the files."""

from __future__ import annotations

import numpy as np
import pytest

from echotruth.cases import expand
from echotruth.config.loading import validate
from echotruth.repository import ledger
from echotruth.repository.checksums import verify
from echotruth.repository.layout import lay_out
from echotruth.repository.settings import mechanics as motion
from echotruth.repository.settings import motions
from echotruth.repository.store import Store
from echotruth.workflow.job import Job, main
from echotruth.workflow.sharing import first_with_same
from workflow.scripts import mechanics as script

SETTINGS = {
    "name": "small",
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "loop": {"frames": 3},
    "motion": {"kind": "rigid"},
    "cases": {"seed": [1, 2]},
}


def configs(**changes):
    config = validate(SETTINGS | changes, "settings")
    return {case.id: case.config for case in expand(config)}


def mechanics(folder, case, same_as=None):
    """Run the script of the stage mechanics in this process."""
    options = ["--same-as", str(record_path(folder, same_as))] if same_as else []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["mechanics.py", str(folder), case, *options])
        main("mechanics", script.work, None)


def record_path(folder, case):
    return ledger.record_path(folder, "mechanics", case)


@pytest.fixture
def shared(tmp_path):
    """Folder of two hearts that differ in their speckle alone, of which the first is solved, and their ids."""
    folder = tmp_path / "small"
    config = validate(SETTINGS, "settings")
    lay_out(folder, config, expand(config))
    first, second = (case.id for case in expand(config))
    mechanics(folder, first)
    return folder, first, second


def files(folder, row):
    store = Store(folder / "small.zarr")
    groups = [group for group in ("geometry", "fibres", "pathology", "mechanics", "kinematics")]
    return [file for group in groups for file in store.files(group, row)]


def test_second_heart_takes_over_the_motion_without_solving_it(shared, monkeypatch):
    folder, first, second = shared
    monkeypatch.setattr(script, "simulate", lambda config: pytest.fail("solved again"))
    mechanics(folder, second, first)
    one, other = (ledger.read(record_path(folder, case)) for case in (first, second))
    assert (other["status"], other["shared_with"], other["case"]) == ("complete", first, second)
    assert other["bounded"] == one["bounded"]
    assert list(one["sha256"].values()) == list(other["sha256"].values())
    sources, targets = files(folder, 0), files(folder, 1)
    assert len(sources) == len(targets) > 30
    for source, target in zip(sources, targets, strict=True):
        assert source.samefile(target)
    store = Store(folder / "small.zarr")
    for group in ("mechanics", "kinematics"):
        for name, array in store.read(group, 0).items():
            np.testing.assert_array_equal(array, store.read(group, 1, names=(name,))[name])


@pytest.mark.slow
def test_files_are_copied_where_links_are_not_possible(shared, monkeypatch):
    folder, first, second = shared

    def refuse(*paths):
        raise PermissionError

    monkeypatch.setattr("os.link", refuse)
    mechanics(folder, second, first)
    assert not any(one.samefile(other) for one, other in zip(files(folder, 0), files(folder, 1), strict=True))
    assert verify(folder / "small.zarr", record_path(folder, second), ledger.read(record_path(folder, second)))


def test_heart_that_is_written_later_leaves_the_other_as_it_was(shared):
    folder, first, second = shared
    mechanics(folder, second, first)
    before = [file.read_bytes() for file in files(folder, 0)]
    store = Store(folder / "small.zarr")
    store.write("mechanics", {"pressure": np.ones(3)}, 1)
    assert [file.read_bytes() for file in files(folder, 0)] == before
    assert (store.read("mechanics", 1, names=("pressure",))["pressure"] == 1).all()


@pytest.mark.slow
def test_motion_taken_over_twice_leaves_no_drafts(shared):
    folder, first, second = shared
    for _ in range(2):
        mechanics(folder, second, first)
        record_path(folder, second).unlink()
    assert not list(folder.rglob("*.partial"))


def test_heart_fails_with_the_reason_of_the_one_whose_motion_it_shares(shared):
    folder, first, second = shared
    Job(folder, "mechanics", first, code="0").commit_without_result("failed", "no equilibrium")
    mechanics(folder, second, first)
    record = ledger.read(record_path(folder, second))
    assert (record["status"], record["reason"]) == ("failed", "no equilibrium")
    assert not files(folder, 1)


def test_damaged_motion_is_not_taken_over(shared):
    folder, first, second = shared
    damaged = files(folder, 0)[7]
    damaged.write_bytes(damaged.read_bytes()[1:])
    with pytest.raises(SystemExit, match="differs from what"):
        mechanics(folder, second, first)
    assert not record_path(folder, second).exists() and not files(folder, 1)


SAME = {
    "seed": {"seed": [1, 2]},
    "probe": {"probe.attenuation_dB_per_cm_MHz": [0.5, 0.7]},
    "speckle": {"phantom.density_per_mm3": [100, 200]},
    "bound": {"physiology.twist_max_deg": [20, 30]},
}
OTHER = {
    "fibres": ({"fibres.endo_deg": [60, 70]}, {}),
    "disarray": ({"seed": [1, 2]}, {"fibres": {"disarray_deg": 5}}),
    "geometry": ({"geometry.wall_mm": [0.9, 1.0]}, {}),
    "prescribed": ({"motion.rigid.rotation_deg": [3, 4]}, {}),
}


@pytest.mark.parametrize("key", SAME)
def test_hearts_that_differ_in_their_images_alone_share_a_motion(key):
    found = motions(configs(cases=SAME[key]))
    assert len(found) == 2 and len(set(found.values())) == 1


@pytest.mark.parametrize("key", OTHER)
def test_hearts_that_move_differently_do_not(key):
    cases, changes = OTHER[key]
    found = configs(cases=cases, **changes)
    assert len(set(motions(found).values())) == 2
    assert motions(found) == {case: motion(config) for case, config in found.items()}


def test_first_of_equal_hearts_stays_the_first_when_another_comes_before_it():
    settings = {"new": "x", "a": "x", "b": "y", "c": "x", "d": "y"}
    assert first_with_same(settings, {"a": 0, "b": 1, "c": 2}) == {"new": "a", "c": "a", "d": "b"}
    assert first_with_same(settings, {}) == {"a": "new", "c": "new", "d": "b"}
