"""`echotruth evaluate` adds anyone's tracker to a repository, whose motion is an affine map, and scores it."""

import fcntl
import shutil
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from finished_repository import blank, configured, content, do, finish, remake, solved

import echotruth as et
from echotruth.cases import expand
from echotruth.cli import main
from echotruth.config import Bmode, Loop, PhaseCorrelation, Tracking
from echotruth.config.tracking import Dis, External
from echotruth.evaluation.tracker_options import parse_tracker
from echotruth.imaging.bmode import pixel_centres
from echotruth.repository.check import check
from echotruth.units import mm
from echotruth.workflow import added_tracker
from echotruth.workflow.added_tracker import AddedTracker, prepare
from echotruth.workflow.job import Job

COURSE = np.array([0, 0.4, 1, 0.3])
"""Share of the motion in each frame."""

CONFIG = configured(
    views=("mid",),
    loop=Loop(frames=len(COURSE)),
    bmode=Bmode(size_px=128, downsampling=(1, 2)),
    tracking=Tracking(
        grid=0.016,
        trackers={
            "ours": PhaseCorrelation(window_px=32),
            "lot": External(track="custom:drawn"),
        },
    ),
)
FIRST, SECOND = (case.id for case in expand(CONFIG))

CUSTOM = """
import atexit
import os
import numpy as np

def exact(frames, points, mask, spacing, frame_time, seed, course, gradient, shift):
    position = (points + 0.5) * spacing
    return np.multiply.outer(course, position @ np.transpose(gradient) + shift) / spacing

def still(frames, points, mask, spacing, frame_time, seed):
    return np.zeros((len(frames), *points.shape))

def small_only(frames, points, mask, spacing, frame_time, seed):
    if frames.shape[-1] > 64:
        raise MemoryError("no room")
    return still(frames, points, mask, spacing, frame_time, seed)

def nowhere(*given):
    raise MemoryError("no room")

def drawn(frames, points, mask, spacing, frame_time, seed):
    return np.random.default_rng(seed).normal(size=(1, *points.shape)) * np.arange(len(frames))[:, None, None]

def second_crashes(*given):
    if open("began", "a").tell():
        os._exit(1)
    atexit.register(open("began", "a").write, "by another process")
    return still(*given)
"""

PROGRAM = """
import sys
import numpy as np
clip = np.load(sys.argv[1])
np.savez(sys.argv[2], displacement=np.zeros((len(clip["frames"]), *clip["points"].shape)))
"""


@pytest.fixture(scope="module")
def made(affine, tmp_path_factory):
    """Folder of a repository of two cases whose heart is moved by an affine map."""

    def result(job):
        groups = solved(job) if job.stage in ("truth", "points") else blank(job)
        if job.stage == "mechanics":
            matrix, shift = affine
            motion = np.multiply.outer(COURSE, groups["geometry"]["node_position"] @ (matrix - np.eye(3)).T + shift)
            groups = groups | {"mechanics": groups["mechanics"] | {"displacement": motion, "es_frame": 2}}
        return groups

    return finish(tmp_path_factory.mktemp("made") / "small", CONFIG, result)


@pytest.fixture
def folder(made, tmp_path):
    """A copy of it."""
    return shutil.copytree(made, tmp_path / "small")


def run_here(added, case_view):
    """Do the job in this process: to start one takes longer than to track."""
    do(Job(added.repository.folder, "tracking", *case_view, added.name), solved)


def one_by_one(jobs):
    """In place of threads: what a tracker prints here goes to the errors, with what others print meanwhile."""
    return nullcontext(SimpleNamespace(map=map, shutdown=lambda cancel_futures: None))


@pytest.fixture
def evaluate(tmp_path, monkeypatch, capsys):
    """Run the command where the trackers are; its status, output and errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    monkeypatch.delitem(sys.modules, "custom", raising=False)
    Path("custom.py").write_text(CUSTOM)

    def run(repository, *arguments, in_processes=False):
        monkeypatch.setattr(sys, "argv", ["echotruth", "evaluate", str(repository), *map(str, arguments)])
        with monkeypatch.context() as patch, pytest.raises(SystemExit) as left:
            if not in_processes:
                patch.setattr(AddedTracker, "_run", run_here)
                patch.setattr(added_tracker, "ThreadPoolExecutor", one_by_one)
            main()
        return left.value.code, *capsys.readouterr()

    return run


ONE = ("--case", FIRST, "--view", "mid")
"""One clip alone."""


def scores(folder, name):
    table = et.Repository(folder).scores
    return table[table["tracker"] == name]


def bytes_of(group):
    return {path.relative_to(group): path.read_bytes() for path in group.rglob("*") if path.is_file()}


def in_image(folder, affine, view):
    """The affine map in the image: its gradient less one, and the shift of the corner of the first pixel (m)."""
    matrix, shift = affine[0] - np.eye(3), affine[1]
    where = et.Repository(folder).plane(FIRST, view)
    axial, lateral = pixel_centres(CONFIG.bmode, 128)
    corner = np.array([lateral[0], axial[0]]) - CONFIG.bmode.field_of_view_mm * mm / 128 / 2
    axes = where.axes[:2]
    return axes @ matrix @ axes.T, axes @ (matrix @ (where.origin + corner @ axes) + shift)


def test_tracker_that_knows_the_motion_has_no_error_at_any_size(folder, evaluate, affine):
    gradient, shift = in_image(folder, affine, "mid")
    options = {"course": COURSE.tolist(), "gradient": gradient.tolist(), "shift": shift.tolist()}
    given = [word for key, value in options.items() for word in ("--option", f"{key}={value}")]
    status, output, errors = evaluate(folder, "--tracker", "custom:exact", *ONE, *given)
    assert (status, errors) == (0, "") and f"custom_exact is a tracker of {folder}" in output
    table = scores(folder, "custom_exact")
    assert list(table["size_px"]) == [128, 64]
    assert (table["nrmse_percent"] < 1e-3).all() and (table["coverage_percent"] == 100).all()
    assert et.Repository(folder).trackers == ["ours", "lot", "custom_exact"]


def test_every_complete_clip_is_tried_and_no_other_and_who_sees_no_motion_is_off_by_all_of_it(folder, evaluate):
    shutil.rmtree(folder / f"small.zarr/clips/{SECOND}/mid/bmode/128")
    status, output, _ = evaluate(folder, "--tracker", "custom:still")
    clips = [(FIRST, "mid", size) for size in (128, 64)]
    table = scores(folder, "custom_still")
    assert status == 0 and set(table[["case", "view", "size_px"]].itertuples(index=False, name=None)) == {*clips}
    np.testing.assert_allclose(table["nrmse_percent"], 100)
    assert output.splitlines()[: len(clips)] == [
        f"{case} {view} {size} px: NRMSE 100.0 %" for case, view, size in clips
    ]
    assert (table["failure"] == "").all() and not check(folder).faults


def test_failure_at_one_size_is_told_and_the_other_is_scored(folder, evaluate):
    status, output, _ = evaluate(folder, "--tracker", "custom:small_only", *ONE)
    table = scores(folder, "custom_small_only").set_index("size_px")
    assert status == 0 and "no room" in output
    assert table.loc[128, "failure"].startswith("custom:small_only raised MemoryError: no room")
    assert np.isnan(table.loc[128, "nrmse_percent"]) and table.loc[128, "coverage_percent"] == 0
    assert table.loc[64, "failure"] == "" and table.loc[64, "nrmse_percent"] == pytest.approx(100)


def test_tracker_that_fails_everywhere_ends_with_status_1(folder, evaluate):
    status, output, errors = evaluate(folder, "--tracker", "custom:nowhere", *ONE)
    assert (status, errors) == (1, "") and output.count("raised MemoryError: no room") == 2
    assert (scores(folder, "custom_nowhere")["nrmse_all_percent"] == 100).all()


@pytest.mark.slow
def test_program_and_method_of_ours_are_tried_too(folder, evaluate):
    Path("program.py").write_text(PROGRAM)
    command = f"'{sys.executable}' program.py {{input}} {{output}}"
    assert evaluate(folder, "--command", command, "--name", "program", *ONE)[0] == 0
    np.testing.assert_allclose(scores(folder, "program")["nrmse_percent"], 100)
    assert evaluate(folder, "--tracker", "dis", "--option", "preset=fast", *ONE)[0] == 0
    assert scores(folder, "dis")["nrmse_percent"].notna().all()
    assert et.Repository(folder).config.tracking.trackers["dis"] == Dis(preset="fast")


@pytest.mark.slow
def test_tracker_of_the_configuration_leaves_the_bytes_that_it_leaves_by_the_command_in_any_number_of_processes(
    folder, evaluate
):
    drawn = ("--tracker", "custom:drawn", "--view", "mid", "--jobs", "2")
    assert evaluate(folder, *drawn, in_processes=True)[0] == 0
    for case in (FIRST, SECOND):
        do(Job(folder, "tracking", case, "mid", "lot"), solved)
        found = [bytes_of(folder / f"small.zarr/clips/{case}/mid/tracking/{name}") for name in ("lot", "custom_drawn")]
        assert found[0] and found[0] == found[1]


@pytest.mark.slow
def test_later_evaluation_replaces_its_own_groups_and_touches_no_others(folder, evaluate):
    for tracker in ("custom:still", "custom:drawn"):
        before = content(folder)
        assert evaluate(folder, "--tracker", tracker, "--name", "one", *ONE)[0] == 0
    after, own = content(folder), f"small.zarr/clips/{FIRST}/mid/tracking/one/"
    differ = {name for name in {*before, *after} if before.get(name) != after.get(name)}
    described = {"config.yaml", "SHA256SUMS", "small.zarr/zarr.json", f"small.zarr/clips/{FIRST}/mid/zarr.json"}
    assert described < differ and differ - described == {name for name in differ if name.startswith(own)} != set()
    assert et.Repository(folder).trackers == ["ours", "lot", "one"]
    assert (scores(folder, "one")["nrmse_percent"] != 100).all() and not check(folder).faults


SMALL = configured(seeds=(1,), views=("mid",))
MINE = {"mine": External(track="custom:still")}
TOGETHER = SMALL.tracking.model_copy(update={"trackers": SMALL.tracking.trackers | MINE})


def tracked_by_mine(job):
    """Blank arrays, but for what the tracker `mine` finds."""
    return solved(job) if job.tracker == "mine" else blank(job)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("small") / "small", SMALL)


@pytest.fixture
def added(small, tmp_path, evaluate):
    """A repository of one clip to which `mine` was added."""
    folder = shutil.copytree(small, tmp_path / "added")
    status, _, errors = evaluate(folder, "--tracker", "custom:still", "--name", "mine")
    assert (status, errors) == (0, "")
    return folder


@pytest.mark.slow
def test_repository_with_an_added_tracker_is_one_made_at_once_with_that_tracker(added, tmp_path):
    together = finish(tmp_path / "together", SMALL.model_copy(update={"tracking": TOGETHER}), tracked_by_mine)
    assert content(added) == content(together)
    assert remake(added, SMALL) == []


@pytest.mark.slow
def test_run_makes_an_added_tracker_again_for_other_images(added):
    (case,), bmode = expand(SMALL), SMALL.bmode.model_copy(update={"dynamic_range_dB": 50.0})
    made = remake(added, SMALL.model_copy(update={"bmode": bmode}), tracked_by_mine)
    assert made[-3:] == [f"tracking {case.id} mid one", f"tracking {case.id} mid mine", "repository"]
    assert not check(added).faults


@pytest.mark.slow
def test_tracker_that_the_configuration_has_by_now_is_its_own(added, evaluate):
    config = SMALL.model_copy(update={"tracking": Tracking(trackers={"mine": Dis()})})
    remake(added, config)
    status, _, errors = evaluate(added, "--tracker", "custom:still", "--name", "mine")
    assert status == 2 and "mine is already a tracker of" in errors
    assert evaluate(added, "--tracker", "custom:still", "--name", "other")[0] == 0
    assert et.Repository(added).config.tracking.trackers["mine"] == Dis()


@pytest.mark.slow
def test_tracker_that_ends_its_process_is_told_in_one_sentence_and_leaves_the_repository_as_it_was(folder, evaluate):
    before = content(folder)
    status, _, errors = evaluate(folder, "--tracker", "custom:second_crashes", "--view", "mid", in_processes=True)
    assert status == 2 and errors.count("\n") == 1 and f"on {SECOND} mid: its process ended" in errors
    assert "--command" in errors and not (folder / "trackers.yaml").exists()
    assert content(folder) == before and not check(folder).faults


@pytest.mark.slow
def test_tracker_that_crashes_under_the_name_of_one_that_was_added_leaves_that_one_its_settings(added, evaluate):
    before = content(added), (added / "trackers.yaml").read_bytes()
    Path("began").write_text("by another process")
    crashing = ("--tracker", "custom:second_crashes", "--name", "mine")
    assert evaluate(added, *crashing, in_processes=True)[0] == 2
    assert (content(added), (added / "trackers.yaml").read_bytes()) == before


def test_damaged_clip_is_refused_in_one_sentence(folder, evaluate):
    path = folder / f"small.zarr/clips/{FIRST}/mid/bmode/128/image/c/0/0/0"
    shard = bytearray(path.read_bytes())
    shard[len(shard) // 3] ^= 1
    path.write_bytes(shard)
    status, _, errors = evaluate(folder, "--tracker", "custom:still", *ONE, in_processes=True)
    assert (status, errors.count("\n")) == (2, 1) and f"{path} is not what was written" in errors
    assert "trackers.yaml" not in {path.name for path in folder.iterdir()}


@pytest.mark.parametrize(
    "tracker, name", [("a:track", "a"), ("a.b:track", "a_b"), ("a:other", "a_other"), ("dis", "dis")]
)
def test_scores_stand_under_a_name_made_of_that_of_the_tracker(tracker, name):
    assert parse_tracker(tracker, None, [])[0] == name


@pytest.mark.parametrize(
    "command, name",
    [
        ("./my-tracker {input} {output}", "my_tracker"),
        ("python3 code/network.py {input} {output}", "network"),
        ("matlab -batch \"material_truth('{input}', '{output}')\"", "matlab"),
        ("track --config settings.yaml {input} {output}", "track"),
    ],
)
def test_scores_of_a_program_stand_under_the_name_of_its_script_or_its_own(command, name):
    assert parse_tracker(None, command, [])[0] == name


@pytest.mark.parametrize(
    "text, value",
    [("1e-3", 0.001), ("-1.5E3", -1500.0), ("[1e-3, 2]", [0.001, 2]), ("{b: 1e2}", {"b": 100.0}), ("e3", "e3")],
)
def test_option_that_looks_like_a_number_is_one(text, value):
    assert parse_tracker("a:b", None, [f"a={text}"])[1]["options"]["a"] == value


REFUSED = {
    "ours": (["--tracker", "a:b", "--name", "ours"], "ours is already a tracker of {folder}"),
    "name": (["--tracker", "a:b", "--name", "my tracker"], "'my tracker' cannot be the name of a tracker: use letters"),
    "its own name": (["--command", "./2d {input} {output}"], "'2d' cannot be the name of a tracker: use letters"),
    "path": (["--tracker", "code/own.py:track"], "write package.module:function (dots, no path, no .py)"),
    "method": (["--tracker", "bspline"], "bspline: is not a tracker: did you mean bspline_dic?"),
    "dot": (["--tracker", "custom.exact"], "custom.exact: is not a tracker: write package.module:function"),
    "nothing": (
        ["--tracker", "zzzzzz"],
        "write package.module:function or MODEL.onnx, or use one of phase_correlation, ",
    ),
    "model": (["--onnx", "none.onnx"], "none.onnx: is not there: give the path of a model in ONNX"),
    "option of a model": (["--onnx", "none.onnx", "--option", "side=3"], "side is not a key of the method onnx"),
    "module": (
        ["--tracker", "custon:exact"],
        "cannot be imported: ModuleNotFoundError: No module named 'custon'",
    ),
    "function": (["--tracker", "custom:exat"], "has no attribute 'exat'"),
    "needs an option": (["--tracker", "custom:exact"], "missing a required argument: 'course': it gets frames, points"),
    "program": (["--command", "trakk {input} {output}"], "trakk: is not there or cannot be run"),
    "case": (["--tracker", "a:b", "--case", "seed9"], "case = 'seed9': use one of heart, seed2_"),
    "option": (["--tracker", "a:b", "--option", "window"], "--option window: has no value: write key=value"),
    "YAML": (["--tracker", "a:b", "--option", "a=[1"], "--option a=[1: the value is not YAML"),
    "key": (["--tracker", "dis", "--option", "window=3"], "window is not a key of the method dis"),
    "window": (
        ["--tracker", "phase_correlation", "--option", "window_px=128"],
        "window_px = 128: must not exceed the smallest image, 64 px",
    ),
    "places": (["--command", "a {input}"], "must contain {{output}} where the path of that file belongs"),
    "timeout": (["--command", "a {input} {output}", "--timeout", "0"], "timeout_s = 0.0: should be greater than 0"),
    "untimed": (["--tracker", "a:b", "--timeout", "5"], "--timeout 5: a:b is not timed"),
    "jobs": (["--tracker", "custom:still", "--jobs", "0"], "--jobs 0: must be 1 or more"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_invalid_evaluation_is_refused_in_one_sentence(made, evaluate, case):
    arguments, expected = REFUSED[case]
    status, output, errors = evaluate(made, *arguments)
    assert (status, output) == (2, "") and errors.count("\n") == 1
    assert expected.format(folder=made) in errors


@pytest.mark.parametrize("name", ["nowhere", "."])
def test_folder_that_is_no_repository_is_refused_in_one_sentence(evaluate, name):
    status, output, errors = evaluate(name, "--tracker", "a:b")
    assert (status, output, errors.count("\n")) == (2, "", 1) and f"{name}: is not a repository" in errors


def test_repository_that_was_not_run_is_refused_in_one_sentence(folder, evaluate, tmp_path):
    shutil.rmtree(folder / "small.zarr")
    status, _, errors = evaluate(folder, "--tracker", "custom:still")
    assert (status, errors.count("\n")) == (2, 1) and "no complete clip" in errors


def test_repository_on_which_a_run_works_is_refused_in_one_sentence(folder, evaluate):
    with (folder / ".lock").open("ab") as run:
        fcntl.flock(run, fcntl.LOCK_EX)
        status, output, errors = evaluate(folder, "--tracker", "custom:still")
    assert (status, output, errors.count("\n")) == (2, "", 1) and "another run works on it" in errors
    assert not (folder / "trackers.yaml").exists()


def test_folder_that_cannot_be_written_is_refused_before_the_first_clip(folder, evaluate):
    (folder / "trackers.yaml").mkdir()
    status, output, errors = evaluate(folder, "--tracker", "custom:still")
    assert (status, output, errors.count("\n")) == (2, "", 1) and "trackers.yaml: Is a directory: the folder" in errors


def test_repository_whose_hearts_are_inferred_from_a_tracker_can_have_another_one(folder):
    config = configured(motion={"kind": "beat"}, inference={"tracker": "one"})
    (folder / "config.yaml").write_text(yaml.safe_dump(config.model_dump(mode="json")))
    assert prepare(et.Repository(folder), "mine", {"method": "dis"}).settings == Dis()
