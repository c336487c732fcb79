"""Models in ONNX that are made here, block matching about every point, give back a motion that is known."""

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import echotruth as et
from echotruth.config.tracking import Onnx
from echotruth.tracking import TrackerFailed, track

onnx = pytest.importorskip(
    "onnx"
)  # what needs neither is in tests/test_light.py and tests/workflow/test_added_tracker.py
pytest.importorskip("onnxruntime")
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCK, REACH, SIDE = 15, 6, 256
"""Side of a block, the largest shift that is sought, and the side of the image, px of the model."""
FLOAT, BYTES = TensorProto.FLOAT, TensorProto.UINT8


class Graph:
    """A graph that grows node by node."""

    def __init__(self):
        self.nodes, self.constants = [], []

    def __call__(self, kind, *given, **attributes):
        """Add a node; arrays among what it is given become constants. Its output has the name that is returned."""
        names = [value if isinstance(value, str) else self._constant(np.asarray(value)) for value in given]
        self.nodes.append(helper.make_node(kind, names, [made := f"made{len(self.nodes)}"], **attributes))
        return made

    def _constant(self, value):
        value = value.astype(np.float32) if value.dtype == float else value
        self.constants.append(numpy_helper.from_array(value, f"constant{len(self.constants)}"))
        return self.constants[-1].name

    def save(self, path, inputs, outputs):
        """Write the model; inputs are name -> type and shape, outputs name -> name of the node's output and rank."""
        for name, (made, _) in outputs.items():
            self.nodes.append(helper.make_node("Identity", [made], [name]))
        given = [helper.make_tensor_value_info(name, *kind) for name, kind in inputs.items()]
        found = [helper.make_tensor_value_info(name, FLOAT, [None] * rank) for name, (_, rank) in outputs.items()]
        graph = helper.make_graph(self.nodes, "tracker", given, found, self.constants)
        onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=8), path)


def save_block_matching(path, size, frames="THW", points="N2", tracks="TN2", coordinates="xy", unit="px"):
    """Block matching to whole pixels of points in the first frame, with a signature.

    `size` has the sizes of the axes T and N, of which that of N is a number.
    """
    graph = Graph()
    places = graph("Slice", "points", [1], [3], [-1]) if points[-1] == "3" else "points"
    places = rows_and_columns(graph, graph("Reshape", places, np.array([size["N"], 2])), coordinates, unit)
    video = graph("Slice", "frames", [0], [1], [frames.index("3")]) if "3" in frames else "frames"
    video = graph("Reshape", video, np.array([-1, SIDE, SIDE]))

    corner = graph("Cast", graph("Round", places), to=TensorProto.INT64)
    corner = graph("Reshape", corner, np.array([size["N"], 1, 1, 2]))
    block, searched = (graph("Add", corner, square(side)) for side in (BLOCK, BLOCK + 2 * REACH))
    first = graph("Gather", video, np.array(0), axis=0)
    template = graph("Unsqueeze", graph("GatherND", first, block), [1])
    search = graph("GatherND", graph("Transpose", video, perm=[1, 2, 0]), searched)
    search = graph("Transpose", search, perm=[3, 0, 1, 2])
    product = graph("Conv", search, template, group=size["N"])
    ones = np.ones((size["N"], 1, BLOCK, BLOCK), np.float32)
    power = graph("Conv", graph("Mul", search, search), ones, group=size["N"])
    difference = graph("Sub", power, graph("Mul", product, np.float32(2)))
    best = graph("ArgMin", graph("Reshape", difference, np.array([0, 0, -1])), axis=2)
    lags = np.array(2 * REACH + 1)
    shift = graph("Concat", graph("Div", best, lags), graph("Mod", best, lags), axis=2)
    found = graph("Add", graph("Cast", graph("Sub", shift, np.array(REACH)), to=FLOAT), places)

    if coordinates == "xy":
        found = graph("Gather", found, [1, 0], axis=2)
    if unit == "normalised":
        found = graph("Div", graph("Add", found, np.float32(0.5)), np.float32(SIDE))
    if "NT" in tracks:
        found = graph("Transpose", found, perm=[1, 0, 2])
    found = graph("Unsqueeze", found, [0]) if tracks[0] == "1" else found
    shapes = {"frames": shape(frames, size), "points": shape(points, size)}
    graph.save(path, {name: (FLOAT, axes) for name, axes in shapes.items()}, {"tracks": (found, len(tracks))})
    return path


def rows_and_columns(graph, places, coordinates, unit):
    """Points as rows and columns, px."""
    if unit == "normalised":
        places = graph("Sub", graph("Mul", places, np.float32(SIDE)), np.float32(0.5))
    return graph("Gather", places, [1, 0], axis=1) if coordinates == "xy" else places


def square(side):
    """Rows and columns about a pixel (side, side, 2)."""
    return np.stack(np.meshgrid(*[np.arange(side) - side // 2] * 2, indexing="ij"), axis=-1)


def shape(layout, size):
    return [int(axis) if axis.isdigit() else {"H": SIDE, "W": SIDE}.get(axis, size.get(axis)) for axis in layout]


def halves(speckle, frames, columns=1, rows=1):
    """Clip of two halves that move apart by whole pixels, and the motion (frame, half, 2) of both, px of the clip."""
    t = np.arange(frames) / max(frames - 1, 1)
    motion = np.rint(np.stack([np.outer(t, [9, -4]), np.outer(t, [-5, 8])], axis=1)).astype(int)
    if frames < 100:  # no more than REACH in a call
        motion = motion * 2 // 3
    left, right = (speckle(SIDE, lambda place, offset=offset: place + offset) for offset in (0, 31))
    half = [[np.roll(image, shift[::-1], (0, 1)) for shift in motion[:, n]] for n, image in enumerate((left, right))]
    clip = np.concatenate([np.array(half[0])[:, :, : SIDE // 2], np.array(half[1])[:, :, SIDE // 2 :]], axis=2)
    return clip.repeat(rows, axis=1).repeat(columns, axis=2), motion * [columns, rows]


def places(number, columns=1, rows=1):
    """Points, px of the clip, and the half in which each of them lies; rows and columns are not alike."""
    random = np.random.default_rng(5)
    half = np.arange(number) % 2
    lateral = 45 + 128 * half + random.uniform(0, 40, number)
    points = np.column_stack([lateral, random.uniform(30, 226, number)])
    return (points + 0.5) * [columns, rows] - 0.5, half


def run(model, frames, points, **keys):
    given = (frames, points, np.ones(frames.shape[1:], bool), 2e-5, np.arange(len(frames)) * 1e-3, 1)
    return track(*given, Onnx(model=str(model), **keys))


MYOTRACKER = dict(frames="1T1HW", points="1N2", tracks="1TN2", coordinates="row_column")
SIGNATURES = {
    "graph alone": (dict(), dict()),
    "names": (dict(frames="T1HW", points="1N2"), dict(inputs=["frames", "points"], outputs=["tracks"])),
    "rows first": (MYOTRACKER, dict(coordinates="row_column")),
    "like TAPIR": (dict(frames="1THW3", points="1N3", tracks="1NT2", coordinates="row_column"),) * 2,
    "normalised": (dict(frames="THW1", tracks="NT2", unit="normalised"), dict(unit="normalised")),
    "batch of bytes": (dict(frames="1THW", points="1N2", tracks="1NT2"), dict(values=[0, 255])),
}
"""What a model is made like, and what is declared of it."""


@pytest.mark.parametrize(("number", "frames"), [(3, 9), (11, 15), (10, 8)])
@pytest.mark.parametrize("name", SIGNATURES)
def test_motion_is_given_back_whatever_the_signature_and_the_numbers_of_frames_and_points(
    speckle, tmp_path, name, number, frames
):
    """Of a model with 8 frames and 5 points: padded, chained and in groups."""
    made, declared = SIGNATURES[name]
    model = save_block_matching(tmp_path / "a.onnx", {"T": 8, "N": 5}, **made)
    if declared:
        declare(model, **declared)
    (clip, motion), (points, half) = halves(speckle, frames), places(number)
    displacement, quality = run(model, clip, points)
    np.testing.assert_allclose(displacement, motion[:, half], atol=1e-3)
    assert np.isnan(quality).all()


@pytest.mark.parametrize(("columns", "rows"), [(2, 2), (2, 1), (1, 3)])
def test_motion_in_a_clip_of_any_size_is_in_its_own_pixels(speckle, tmp_path, columns, rows):
    """Each pixel of the model is a block of those of the clip, so that whole shifts stay whole."""
    model = save_block_matching(tmp_path / "a.onnx", {"T": "time", "N": 4})
    (clip, motion), (points, half) = halves(speckle, 5, columns, rows), places(4, columns, rows)
    np.testing.assert_allclose(run(model, clip, points)[0], motion[:, half], atol=2e-3)


@pytest.mark.parametrize("frames", [20, 64, 130])
def test_model_with_the_signature_of_myotracker_gives_back_the_motion(speckle, tmp_path, frames):
    """With the declaration of examples/: 64 frames and 64 points in each call."""
    model = save_block_matching(tmp_path / "myotracker.onnx", {"T": 64, "N": 64}, **MYOTRACKER)
    shutil.copy(EXAMPLES / "myotracker.yaml", tmp_path)
    (clip, motion), (points, half) = halves(speckle, frames), places(70)
    displacement, _ = run(model, clip, points)
    assert np.abs(displacement - motion[:, half]).max() < 0.1


def test_speckle_of_smaller_pixels_is_averaged(speckle, tmp_path):
    """Two pixels of the clip are one of the model, which places the point between two of its own."""
    image = speckle(2 * SIDE, lambda place: place)
    clip = np.stack([image, np.roll(image, (-4, 6), (0, 1))])
    model = save_block_matching(tmp_path / "a.onnx", {"T": 2, "N": 1})
    np.testing.assert_allclose(run(model, clip, np.array([[201.0, 300.0]]))[0][1], [[6, -4]], atol=1e-3)


def save_brightness(path, kind=FLOAT, frames="THW", size=SIDE, points="N2", shift=0.0, visible=None, factor=1.0):
    """A model of any number of frames and points whose tracks move by the mean grey value; (T, size, size), (N, 2)."""
    graph = Graph()
    level = graph("ReduceMean", graph("Cast", "frames", to=FLOAT), [1, 2], keepdims=1)
    move = graph("Mul", level, np.float32(factor))
    found = graph("Add", move, graph("Add", "points", np.float32(shift)))
    outputs = {"tracks": (found, 3)}
    if visible is not None:
        zeros = graph("Mul", graph("ReduceMean", found, [2], keepdims=0), np.float32(0))
        outputs["seen"] = (graph("Add", zeros, np.float32(visible)), 2)
    inputs = {"frames": (kind, ["T", size, size]), "points": (FLOAT, ["N", 2])}
    graph.save(path, inputs, outputs)
    return path


def declare(path, **keys):
    path.with_suffix(".yaml").write_text(yaml.safe_dump(keys))
    return path


def flash(frames=3, side=64):
    """A black frame, and then white ones."""
    return np.repeat(np.uint8([0] + [255] * (frames - 1)), side**2).reshape(frames, side, side)


POINTS = np.array([[30.0, 20.0], [11.0, 40.0], [25.5, 33.0]])


@pytest.mark.parametrize(
    ("kind", "values", "difference"), [(FLOAT, None, 1), (BYTES, None, 255), (FLOAT, [-1, 1], 2), (BYTES, [10, 30], 20)]
)
def test_values_are_those_that_are_declared_or_suit_the_type(tmp_path, kind, values, difference):
    model = save_brightness(tmp_path / "a.onnx", kind)
    if values:
        declare(model, values=values)
    moved, _ = run(model, flash(), POINTS)
    np.testing.assert_allclose(moved[1:], difference * 64 / 256, atol=1e-4)


def test_sizes_that_are_declared_are_those_of_a_call(tmp_path):
    """Means of frames of 100 px; the first of each call is the reference, as of the model's own places."""
    model = declare(save_brightness(tmp_path / "a.onnx", size="S"), side_px=100, frames_per_call=2, points_per_call=2)
    moved, _ = run(model, flash(5), POINTS)
    np.testing.assert_allclose(moved[1:], 0.64, rtol=1e-5)


def test_visibility_is_the_quality_if_it_is_declared_and_unknown_otherwise(tmp_path):
    model = save_brightness(tmp_path / "a.onnx", visible=0.25)
    assert np.isnan(run(model, flash(), POINTS)[1]).all()
    assert (run(declare(model, outputs=["tracks", "seen"]), flash(), POINTS)[1] == 0.25).all()


def test_points_without_a_place_are_unknown_and_the_others_found(tmp_path):
    points = np.vstack([POINTS, [[np.nan, 3.0], [1e9, -1e9]]])
    moved, _ = run(save_brightness(tmp_path / "a.onnx"), flash(), points)
    assert np.isfinite(moved[:, :3]).all() and np.isnan(moved[:, 3:]).all()
    assert run(tmp_path / "a.onnx", flash(), np.zeros((0, 2)))[0].shape == (3, 0, 2)


def test_results_are_the_same_bytes_again(speckle, tmp_path):
    model = save_block_matching(tmp_path / "a.onnx", {"T": 8, "N": 5})
    (clip, _), (points, _) = halves(speckle, 9), places(7)
    first, again = (run(model, clip, points)[0].tobytes() for _ in range(2))
    assert first == again


REFUSED = {
    "key": (dict(), dict(coordinate="xy"), r"a\.yaml: coordinate is not a key: did you mean coordinates\?"),
    "value": (dict(), dict(coordinates="yx"), r"a\.yaml: coordinates = 'yx': .*'xy' or 'row_column'"),
    "layout": (
        dict(),
        dict(frames="1T1HW"),
        r"a\.yaml: frames = 1T1HW: frames of .*a\.onnx has the shape \(T, 256, 256\): give the one of THW, .* that fit",
    ),
    "inputs": (
        dict(),
        dict(inputs=["video", "points"]),
        r"a\.yaml: inputs = \['video', 'points'\]: .*a\.onnx takes frames and points: it must take frames and points",
    ),
    "outputs": (dict(), dict(outputs=["flow"]), r"a\.yaml: outputs = \['flow'\]: .* gives tracks: use these names"),
    "size": (dict(), dict(side_px=128), r"a\.yaml: side_px = 128: .*a\.onnx takes 256: leave it out"),
    "tracks": (
        dict(),
        dict(tracks="NT2"),
        r"a\.yaml: tracks = NT2: tracks of .* has the shape \(4, 3, 2\), in a call with T = 4 and N = 3: give the one",
    ),
    "places": (dict(shift=40.0), dict(), r"a\.onnx: tracks begins 57 px from the points: give the tracks, coord"),
    "infinite": (dict(factor=np.inf), dict(), r"a\.onnx: \d+ of the 24 numbers of tracks are not finite"),
    "visibility": (
        dict(visible=3.5),
        dict(outputs=["tracks", "seen"]),
        r"a\.onnx: seen has the shape \(4, 3\), and is 3\.5 to 3\.5: a visibility has the shape \(4, 3\), and is 0 to",
    ),
}
"""How a model is made, what is declared of it, and the sentence."""


@pytest.mark.parametrize("name", REFUSED)
def test_model_or_declaration_that_does_not_suit_is_refused_in_a_sentence(tmp_path, name):
    made, declared, sentence = REFUSED[name]
    model = declare(save_brightness(tmp_path / "a.onnx", **made), **declared)
    with pytest.raises(TrackerFailed, match=sentence) as refused:
        run(model, flash(4), POINTS)
    assert "\n" not in str(refused.value)


def test_file_that_is_no_model_is_refused(tmp_path):
    with pytest.raises(TrackerFailed, match=r"none\.onnx: is not there: give the path of a model in ONNX"):
        run(tmp_path / "none.onnx", flash(), POINTS)
    (tmp_path / "a.onnx").write_text("no graph")
    with pytest.raises(TrackerFailed, match=r"a\.onnx: is no model that ONNX Runtime can load: "):
        run(tmp_path / "a.onnx", flash(), POINTS)


def test_graph_with_unknown_shapes_needs_a_declaration(tmp_path):
    graph = Graph()
    inputs = {"frames": (FLOAT, list("btchw")), "points": (FLOAT, ["n", "k"])}
    graph.save(tmp_path / "a.onnx", inputs, {"tracks": ("points", 2)})
    with pytest.raises(
        TrackerFailed, match=r"a\.yaml: frames is missing: frames of .* has the shape \(b, t, c, h, w\)"
    ):
        run(tmp_path / "a.onnx", flash(), POINTS)
    with pytest.raises(
        TrackerFailed, match=r"points is missing: points of .* has the shape \(n, k\): give the one of N2"
    ):
        run(declare(tmp_path / "a.onnx", frames="1T1HW"), flash(), POINTS)
    sentence = r"tracks is missing: tracks of .* has the shape \(3, 2\), in a call with T = 3 and N = 3"
    with pytest.raises(TrackerFailed, match=sentence):
        run(declare(tmp_path / "a.onnx", frames="1T1HW", points="N2"), flash(), POINTS)


def test_model_of_one_frame_is_refused(tmp_path):
    Graph().save(tmp_path / "a.onnx", {"f": (FLOAT, [1, 1, 9, 9]), "p": (FLOAT, ["N", 2])}, {"tracks": ("p", 2)})
    with pytest.raises(TrackerFailed, match=r"a\.onnx: takes one frame: export it with two or more"):
        run(tmp_path / "a.onnx", flash(), POINTS)


def test_failure_within_the_model_is_told(tmp_path):
    graph = Graph()
    found = graph("Add", graph("Reshape", "f", np.array([7, 7])), np.float32(0))
    graph.save(tmp_path / "a.onnx", {"f": (FLOAT, ["T", 9, 9]), "p": (FLOAT, ["N", 2])}, {"tracks": (found, 2)})
    with pytest.raises(TrackerFailed, match=r"a\.onnx: failed on a call: "):
        run(tmp_path / "a.onnx", flash(), POINTS)


def test_model_without_an_end_is_ended_after_its_time(tmp_path):
    """A loop that adds 1 to the points as long as a condition holds, which always does."""
    kinds = {"step": (TensorProto.INT64, []), "goes": (TensorProto.BOOL, []), "sum": (FLOAT, None)}
    inputs = [helper.make_tensor_value_info(name, *kind) for name, kind in kinds.items()]
    outputs = [helper.make_tensor_value_info(f"{name}_on", *kinds[name]) for name in ("goes", "sum")]
    one = numpy_helper.from_array(np.float32(1), "one")
    nodes = [helper.make_node("Identity", ["goes"], ["goes_on"]), helper.make_node("Add", ["sum", "one"], ["sum_on"])]
    graph = Graph()
    found = graph("Loop", "", np.array(True), "p", body=helper.make_graph(nodes, "body", inputs, outputs, [one]))
    model = tmp_path / "a.onnx"
    graph.save(model, {"f": (FLOAT, ["T", 9, 9]), "p": (FLOAT, ["N", 2])}, {"tracks": (found, 2)})
    with pytest.raises(TrackerFailed, match=r"a\.onnx: took longer than timeout_s = 0\.5$"):
        run(model, flash(), POINTS, timeout_s=0.5)


@pytest.fixture
def command(tmp_path, monkeypatch, capsys):
    """Function that runs the command line in an empty folder, and returns its status and what it said."""
    from echotruth.cli import main

    monkeypatch.chdir(tmp_path)

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["echotruth", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        told = capsys.readouterr()
        return end.value.code, told.out + told.err

    return call


def test_command_scores_a_model_under_its_name_and_says_in_one_line_why_it_cannot(command, tmp_path):
    shutil.copytree(et.sample().folder, tmp_path / "hearts", copy_function=shutil.copyfile)
    for folder, _, _ in os.walk(tmp_path / "hearts"):
        os.chmod(folder, 0o755)
    save_block_matching(tmp_path / "my-net.onnx", {"T": 64, "N": 64}, **MYOTRACKER)
    chosen = ("evaluate", "hearts", "--case", "healthy", "--view", "mid", "--onnx", "my-net.onnx")
    declare(tmp_path / "my-net.onnx", coordinates="row_column")
    status, said = command(*chosen)
    assert status == 0 and "my_net is a tracker of" in said, said
    scores = et.Repository(tmp_path / "hearts").scores
    assert scores.loc[scores["tracker"] == "my_net", "nrmse_percent"].notna().tolist() == [True]
    status, said = command(*chosen, "--option", "window=3")
    assert status == 2 and "window is not a key of the method onnx" in said
    status, said = command(*chosen, "--timeout", "0")
    assert status == 2 and "timeout_s = 0.0: should be greater than 0" in said
    declare(tmp_path / "my-net.onnx", values=[1])
    status, said = command(*chosen)
    assert status == 2 and said.startswith("echotruth: my-net.yaml: values = [1]: ") and said.count("\n") == 1


def test_model_is_taken_where_a_tracker_is_named(tmp_path):
    model = declare(save_brightness(tmp_path / "still.onnx", factor=0.0))
    hearts = et.sample()
    tracked = et.track(hearts.clip("healthy", "mid"), str(model))
    assert et.evaluate(tracked, hearts.heart("healthy"))["nrmse_percent"] == pytest.approx(100)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    clip = et.read_clip(np.tile(flash(2, 128), (2, 1, 1)), spacing_mm=0.1, frame_time_ms=5)
    strain = et.speckle_tracking(clip, et.Wall(64 + 20 * circle, 64 + 35 * circle, "mid"), str(model))
    assert strain.attrs["gcs_percent"] == pytest.approx(0, abs=1e-3)
