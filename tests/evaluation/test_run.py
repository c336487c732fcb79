"""`echotruth evaluate` scores anyone's tracker on a repository whose motion is an affine map."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from finished_repository import blank, finish, made_otherwise, solved

from echotruth.cases import expand
from echotruth.cli import main
from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Tracking, View
from echotruth.config.tracking import External
from echotruth.evaluation import scoring
from echotruth.evaluation.tracker_options import parse_tracker
from echotruth.imaging.bmode import pixel_centres
from echotruth.repository.reader import Repository
from echotruth.workflow.job import Job

COURSE = np.array([0, 0.4, 1, 0.3])
"""Share of the motion in each frame."""

CONFIG = Config(
    name="small",
    geometry=Geometry(circumferential_elements=12, longitudinal_elements=4, transmural_elements=1),
    loop=Loop(frames=len(COURSE)),
    views={"mid": View(), "apex": View(position=0.7)},
    bmode=Bmode(size_px=128, downsampling=(1, 2)),
    tracking=Tracking(
        grid=0.016,
        trackers={
            "ours": PhaseCorrelation(window_px=32),
            "lot": External(track="custom:drawn"),
            "poor": External(track="custom:small_only"),
        },
    ),
    cases={"seed": [1, 2]},
)

FIRST, SECOND = (case.id for case in expand(CONFIG))

CUSTOM = """
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

def drawn(frames, points, mask, spacing, frame_time, seed):
    return np.random.default_rng(seed).normal(size=(1, *points.shape)) * np.arange(len(frames))[:, None, None]

def crash(*given):
    os._exit(1)
"""

PROGRAM = """
import sys
import numpy as np
clip = np.load(sys.argv[1])
np.savez(sys.argv[2], displacement=np.zeros((len(clip["frames"]), *clip["points"].shape)))
"""


@pytest.fixture(scope="module")
def made(affine, tmp_path_factory):
    """Folder of a repository of two cases whose heart is moved by an affine map; the second has one view only."""

    def result(job):
        if job.stage in ("mechanics", "truth"):
            groups = solved(job) if job.stage == "truth" else blank(job)
            if job.stage == "mechanics":
                matrix, shift = affine
                motion = np.multiply.outer(COURSE, groups["geometry"]["node_position"] @ (matrix - np.eye(3)).T + shift)
                groups = groups | {"mechanics": groups["mechanics"] | {"displacement": motion, "es_frame": 2}}
            return groups
        return blank(job)

    folder = finish(tmp_path_factory.mktemp("made") / "small", CONFIG, result)
    (folder / f"small.zarr/clips/{SECOND}/apex/bmode/128/zarr.json").unlink()
    return folder


@pytest.fixture
def evaluate(made, tmp_path, monkeypatch, capsys):
    """Run the command where the trackers are; its status, output and errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    monkeypatch.delitem(sys.modules, "custom", raising=False)
    Path("custom.py").write_text(CUSTOM)

    def run(*arguments, repository=made):
        monkeypatch.setattr(sys, "argv", ["echotruth", "evaluate", str(repository), *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main()
        return left.value.code, *capsys.readouterr()

    return run


def scores(made, name):
    return pd.read_csv(made / f"external/{name}.csv")


def in_image(made, affine, view):
    """The affine map in the image: its gradient less one, and the shift of the corner of the first pixel (m)."""
    matrix, shift = affine[0] - np.eye(3), affine[1]
    where = Repository(made).plane(FIRST, view)
    axial, lateral = pixel_centres(CONFIG.bmode, 128)
    corner = np.array([lateral[0], axial[0]]) - CONFIG.bmode.si().field_of_view / 128 / 2
    axes = where.axes[:2]
    return axes @ matrix @ axes.T, axes @ (matrix @ (where.origin + corner @ axes) + shift)


def test_tracker_that_knows_the_motion_has_no_error_at_any_size(made, evaluate, affine):
    gradient, shift = in_image(made, affine, "mid")
    options = {"course": COURSE.tolist(), "gradient": gradient.tolist(), "shift": shift.tolist()}
    given = [word for key, value in options.items() for word in ("--option", f"{key}={value}")]
    status, output, errors = evaluate("--tracker", "custom:exact", "--view", "mid", *given)
    assert (status, errors) == (0, "")
    table = scores(made, "custom_exact")
    assert str(made / "external/custom_exact.csv") in output
    assert list(table["size_px"]) == [128, 64, 128, 64]
    assert (table["nrmse_percent"] < 1e-3).all() and (table["coverage_percent"] == 100).all()


def test_tracker_that_sees_no_motion_is_off_by_all_of_it(made, evaluate):
    assert evaluate("--tracker", "custom:still")[0] == 0
    table = scores(made, "custom_still")
    np.testing.assert_allclose(table["nrmse_percent"], 100)
    assert list(table.columns[:4]) == ["case", "view", "size_px", "tracker"] and table.columns[-1] == "failure"
    assert set(table["tracker"]) == {"custom_still"} and table["failure"].isna().all()


def test_every_complete_clip_is_tried_and_no_other(made, evaluate):
    evaluate("--tracker", "custom:still", "--name", "all")
    tried = list(scores(made, "all")[["case", "view", "size_px"]].itertuples(index=False, name=None))
    assert tried == [
        (*case_view, size) for case_view in ((FIRST, "mid"), (FIRST, "apex"), (SECOND, "mid")) for size in (128, 64)
    ]
    evaluate("--tracker", "custom:still", "--name", "few", "--case", FIRST, "--view", "apex", "--size", "64")
    assert list(scores(made, "few")[["case", "view", "size_px"]].iloc[0]) == [FIRST, "apex", 64]
    assert len(scores(made, "few")) == 1


def test_failure_on_one_clip_is_a_row_and_the_others_go_on(made, evaluate):
    status, output, _ = evaluate("--tracker", "custom:small_only", "--view", "mid")
    table = scores(made, "custom_small_only").set_index("size_px")
    assert status == 0 and "no room" in output
    assert table.loc[128, "failure"].str.startswith("custom:small_only raised MemoryError: no room").all()
    assert table.loc[128, "nrmse_percent"].isna().all() and (table.loc[128, "coverage_percent"] == 0).all()
    assert table.loc[64, "failure"].isna().all() and np.allclose(table.loc[64, "nrmse_percent"], 100)


def test_tracker_that_fails_everywhere_ends_with_status_1(made, evaluate):
    status, output, errors = evaluate("--tracker", "custom:small_only", "--size", "128", "--name", "nothing")
    assert (status, errors) == (1, "") and output.count("raised MemoryError: no room") == 3
    assert scores(made, "nothing")["failure"].notna().all()


def test_program_and_method_of_ours_are_tried_too(made, evaluate):
    Path("program.py").write_text(PROGRAM)
    command = f"'{sys.executable}' program.py {{input}} {{output}}"
    assert evaluate("--command", command, "--name", "program", "--view", "apex")[0] == 0
    np.testing.assert_allclose(scores(made, "program")["nrmse_percent"], 100)
    ours = ("--tracker", "phase_correlation", "--option", "window_px=16", "--view", "apex", "--size", "64")
    assert evaluate(*ours)[0] == 0
    assert scores(made, "phase_correlation")["nrmse_percent"].notna().all()


@pytest.mark.slow
def test_scores_are_the_same_bytes_whatever_the_number_of_processes(made, evaluate):
    read = [
        (
            evaluate("--tracker", "custom:drawn", "--view", "mid", "--jobs", jobs),
            (made / "external/custom_drawn.csv").read_bytes(),
        )
        for jobs in (1, 2)
    ]
    assert [outcome[0] for outcome, _ in read] == [0, 0]

    assert read[0] == read[1]


def test_later_run_replaces_its_own_scores_and_no_others(made, evaluate):
    for name in ("one", "two"):
        evaluate("--tracker", "custom:still", "--name", name, "--view", "mid")
    before = {path.name: path.read_bytes() for path in made.rglob("*") if path.is_file()}
    evaluate("--tracker", "custom:still", "--name", "two", "--view", "apex")
    after = {path.name: path.read_bytes() for path in made.rglob("*") if path.is_file()}
    assert {name for name in {*before, *after} if before.get(name) != after.get(name)} == {"two.csv"}


def test_scores_of_images_made_anew_are_of_another_clip(made, evaluate, tmp_path):
    again = tmp_path / "again"
    shutil.copytree(made, again, ignore=shutil.ignore_patterns("external"))
    evaluate("--tracker", "custom:still", "--view", "mid", "--size", "64", repository=again)
    before = scores(again, "custom_still")
    assert list(before["clip"]) == [Repository(again).version(case, "mid") for case in before["case"]]
    made_otherwise(again / f"small.zarr/clips/{FIRST}/mid/bmode/128")
    read = Repository(again)
    same = [clip == read.version(case, "mid") for case, clip in zip(before["case"], before["clip"], strict=True)]
    assert same == [False, True]


def test_scores_that_could_not_be_written_are_refused_before_the_first_clip(made, evaluate, tmp_path):
    shutil.copytree(made, tmp_path / "taken", ignore=shutil.ignore_patterns("external"))
    (tmp_path / "taken/external").write_text("")
    status, output, errors = evaluate("--tracker", "custom:still", repository=tmp_path / "taken")
    assert (status, output, errors.count("\n")) == (2, "", 1) and "taken/external cannot hold the scores" in errors


@pytest.mark.slow
def test_tracker_that_ends_its_process_is_told_in_one_sentence(made, evaluate):
    status, _, errors = evaluate("--tracker", "custom:crash", "--view", "apex", "--jobs", "2")
    assert status == 2 and errors.count("\n") == 1 and "--command" in errors
    assert not (made / "external/custom_crash.csv").exists()


@pytest.mark.parametrize("path", ["clips/heart/mid/bmode/128/image", "hearts/heart/fibres/wall_depth"])
def test_repository_with_damaged_metadata_is_refused_in_one_sentence(made, evaluate, tmp_path, path):
    """Zarr raises a TypeError of these shapes and names."""
    shutil.copytree(made, tmp_path / "damaged")
    metadata = tmp_path / f"damaged/small.zarr/{path}/zarr.json"
    written = json.loads(metadata.read_text())
    metadata.write_text(json.dumps(written | {"shape": ["x"], "dimension_names": [True]}))
    status, _, errors = evaluate("--tracker", "custom:still", repository=tmp_path / "damaged")
    assert (status, errors.count("\n")) == (2, 1) and "cannot be read at" in errors


def test_repository_with_a_damaged_clip_is_refused_in_one_sentence(made, evaluate, tmp_path):
    shutil.copytree(made, tmp_path / "damaged")
    shard = tmp_path / f"damaged/small.zarr/clips/{FIRST}/mid/bmode/128/image/c/0/0/0"
    content = bytearray(shard.read_bytes())
    content[len(content) // 3] ^= 1
    shard.write_bytes(content)
    status, _, errors = evaluate("--tracker", "custom:still", repository=tmp_path / "damaged")
    assert (status, errors.count("\n")) == (2, 1) and "cannot be read at" in errors


@pytest.mark.parametrize(
    "tracker, name", [("a:track", "a"), ("a.b:track", "a_b"), ("a:other", "a_other"), ("a-b", "a_b"), ("dis", "dis")]
)
def test_scores_stand_under_a_name_made_of_that_of_the_tracker(tracker, name):
    assert parse_tracker(tracker, None, [])[0] == name


@pytest.mark.parametrize(
    "command, name",
    [
        ("./my-tracker {input} {output}", "my_tracker"),
        ("python3 code/network.py {input} {output}", "network"),
        ("julia -t 4 --project=. flow.jl {input} {output}", "flow"),
        ("Rscript warp.R {input} {output}", "warp"),
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
@pytest.mark.parametrize("tracker", ["a:b", "dis"])
def test_option_that_looks_like_a_number_is_one(tracker, text, value):
    settings = parse_tracker(tracker, None, [f"a={text}"])[1]
    assert settings.get("options", settings)["a"] == value


@pytest.fixture
def worked(made, evaluate):
    """Jobs and results of the workflow's own script, by image size, on one view of the first heart."""
    jobs = {size: Job(made, "tracking", FIRST, "mid", size) for size in CONFIG.bmode.sizes}
    return {size: (job, solved(job)[f"tracking/{size}"]) for size, job in jobs.items()}


def test_external_tracker_of_the_configuration_gets_the_scores_it_gets_on_the_command_line(made, worked, evaluate):
    evaluate("--tracker", "custom:drawn", "--case", FIRST, "--view", "mid")
    truth = scoring.read_truth(Repository(made), FIRST, "mid")
    for _, found in scores(made, "custom_drawn").iterrows():
        size = found["size_px"]
        tracked = worked[size][1]["displacement"][list(CONFIG.tracking.trackers).index("lot")]
        for name, value in scoring.metrics(scoring.score(tracked, truth), "short_axis").items():
            np.testing.assert_allclose(found[name], value, rtol=1e-9, err_msg=name)


def test_external_tracker_of_the_configuration_that_fails_leaves_the_others_their_motion(worked):
    found = {
        (size, name): tracked
        for size, (_, result) in worked.items()
        for name, tracked in zip(CONFIG.tracking.trackers, result["displacement"], strict=True)
    }
    failures = {size: job.notes["failures"] for size, (job, _) in worked.items()}
    assert list(failures[128]) == ["poor"] and failures[64] == {} and "no room" in failures[128]["poor"]
    assert np.isnan(found.pop((128, "poor"))).all() and not np.nanmax(abs(found.pop((64, "poor"))))
    for tracked in found.values():
        assert np.nanmax(abs(tracked)) > 0


REFUSED = {
    "ours": (["--tracker", "a:b", "--name", "ours"], "ours is already a tracker of {made}"),
    "name": (["--tracker", "a:b", "--name", "my tracker"], "'my tracker' cannot be the name of a tracker: use letters"),
    "its own name": (["--command", "./2d {input} {output}"], "'2d' cannot be the name of a tracker: use letters"),
    "path": (["--tracker", "code/own.py:track"], "write package.module:function (dots, no path, no .py)"),
    "method": (["--tracker", "bspline"], "--tracker bspline: is not a tracker: did you mean bspline_dic?"),
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
    status, output, errors = evaluate(*arguments)
    assert (status, output) == (2, "") and errors.count("\n") == 1
    assert expected.format(made=made) in errors


@pytest.mark.parametrize("name", ["nowhere", "."])
def test_folder_that_is_no_repository_is_refused_in_one_sentence(evaluate, name):
    status, output, errors = evaluate("--tracker", "a:b", repository=name)
    assert (status, output, errors.count("\n")) == (2, "", 1) and f"{name}: is not a repository" in errors


def test_repository_that_was_not_run_is_refused_in_one_sentence(made, evaluate, tmp_path):
    for name in ("config.yaml", "cases.csv"):
        (tmp_path / name).write_text((made / name).read_text())
    status, _, errors = evaluate("--tracker", "custom:still", repository=tmp_path)
    assert (status, errors.count("\n")) == (2, 1) and "no complete clip" in errors
