"""The example of a tracker that was exported to ONNX, with a small tracker that is made here."""

import sys
from pathlib import Path

import numpy as np
import pytest

from echotruth.config.tracking import External
from echotruth.tracking import TrackerFailed, track

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / "examples"
HALF, REACH = 30, 8
"""Half the side of the template about the middle, and the largest shift that is sought, px of the model."""


def save_block_matching(path, with_quality=False, rank=3):
    """A tracker of the whole image: the least sum of squared differences to the middle of the first frame, whole px."""
    low, high, lags = 128 - HALF, 128 + HALF, 2 * REACH + 1
    constants = {
        "zero": np.array([0]),
        "one": np.array([1]),
        "axes": np.array([1, 2]),
        "channel": np.array([1]),
        "template_start": np.array([low, low]),
        "template_end": np.array([high, high]),
        "search_start": np.array([low - REACH] * 2),
        "search_end": np.array([high + REACH] * 2),
        "ones": np.ones((1, 1, 2 * HALF, 2 * HALF), np.float32),
        "two": np.array(2, np.float32),
        "flat": np.array([-1, lags**2]),
        "lags": np.array(lags),
        "reach": np.array(REACH),
        "last": np.array([1]),
        "half": np.array(0.5, np.float32),
    }
    steps = [
        ("Slice", ["video", "zero", "one", "zero"], "first"),
        ("Slice", ["first", "template_start", "template_end", "axes"], "middle"),
        ("Unsqueeze", ["middle", "channel"], "template"),
        ("Slice", ["video", "search_start", "search_end", "axes"], "area"),
        ("Unsqueeze", ["area", "channel"], "search"),
        ("Mul", ["search", "search"], "squared"),
        ("Conv", ["squared", "ones"], "power"),
        ("Conv", ["search", "template"], "product"),
        ("Mul", ["product", "two"], "doubled"),
        ("Sub", ["power", "doubled"], "difference"),
        ("Reshape", ["difference", "flat"], "listed"),
        ("ArgMin", ["listed"], "best"),
        ("Div", ["best", "lags"], "row"),
        ("Mod", ["best", "lags"], "column"),
        ("Concat", ["column", "row"], "pair"),
        ("Sub", ["pair", "reach"], "whole"),
        ("Cast", ["whole"], "shift"),
        ("Unsqueeze", ["shift", "channel"], "shifts"),
        ("Add", ["shifts", "points"], "tracks"),
    ]
    attributes = {"ArgMin": {"axis": 1, "keepdims": 1}, "Concat": {"axis": 1}, "Cast": {"to": TensorProto.FLOAT}}
    nodes = [helper.make_node(name, given, [made], **attributes.get(name, {})) for name, given, made in steps]
    outputs = [helper.make_tensor_value_info("tracks", TensorProto.FLOAT, ["T", "N", 2])]
    if with_quality:
        nodes.append(helper.make_node("ReduceMean", ["tracks", "two_axis"], ["mean"], keepdims=0))
        nodes.append(helper.make_node("Sub", ["mean", "mean"], ["none"]))
        nodes.append(helper.make_node("Add", ["none", "half"], ["sure"]))
        constants["two_axis"] = np.array([2])
        outputs.append(helper.make_tensor_value_info("sure", TensorProto.FLOAT, ["T", "N"]))
    shape = ["T", 256, 256] if rank == 3 else [1, "T", 256, 256, 3]
    inputs = [
        helper.make_tensor_value_info("video", TensorProto.FLOAT, shape),
        helper.make_tensor_value_info("points", TensorProto.FLOAT, ["N", 2]),
    ]
    weights = [numpy_helper.from_array(value, name) for name, value in constants.items()]
    graph = helper.make_graph(nodes if rank == 3 else [helper.make_node("Identity", ["points"], ["tracks"])],
                              "block_matching", inputs, outputs, weights)  # fmt: skip
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=8), path)
    return str(path)


@pytest.fixture
def found(monkeypatch):
    """Function that runs the example on frames of any size with a model and options."""
    monkeypatch.syspath_prepend(EXAMPLES)
    sys.modules.pop("onnx_tracker", None)

    def run(frames, points, **options):
        given = (frames, points, np.ones(frames.shape[1:], bool), 2e-5, np.arange(len(frames)) * 1e-3, 1)
        return track(*given, External(track="onnx_tracker:track", options=options))

    return run


def stretched(frames, rows, columns):
    """Frames whose pixels are repeated."""
    return np.repeat(np.repeat(frames, rows, axis=1), columns, axis=2)


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (2, 2), (2, 1)])
def test_motion_of_a_clip_of_any_size_is_found_in_its_own_pixels(found, tmp_path, speckle, rows, columns):
    """Each pixel of the model is a block of those of the clip, so that whole shifts stay whole and are exact."""
    image, shifts = speckle(300, lambda position: position), np.array([[0, 0], [3, -2], [-4, 5]])
    frames = np.stack([image[20 - y : 276 - y, 20 - x : 276 - x] for x, y in shifts])
    points = np.array([[40.0, 60.0], [100.25, 31.5]])
    displacement, quality = found(
        stretched(frames, rows, columns), points, model=save_block_matching(tmp_path / "a.onnx")
    )
    np.testing.assert_allclose(displacement, np.tile(shifts[:, None] * [columns, rows], (1, 2, 1)), atol=1e-4)
    assert (quality == 1).all()


def test_larger_pixels_are_interpolated(found, tmp_path, speckle):
    image = speckle(160, lambda position: position)
    frames = np.stack([image[10:138, 10 - x : 138 - x] for x in (0, 2)])
    displacement, _ = found(frames, np.array([[64.0, 64.0]]), model=save_block_matching(tmp_path / "a.onnx"))
    np.testing.assert_allclose(displacement[1], [[2.0, 0.0]], atol=1e-4)


def test_quality_of_the_model_is_taken(found, tmp_path, speckle):
    frames = np.stack([speckle(256, lambda position: position)] * 2)
    model = save_block_matching(tmp_path / "a.onnx", with_quality=True)
    _, quality = found(frames, np.array([[64.0, 64.0]]), model=model, greys=[-1, 1])
    assert (quality == 0.5).all()


def test_model_of_another_form_is_refused_in_a_sentence(found, tmp_path):
    model = save_block_matching(tmp_path / "a.onnx", rank=5)
    with pytest.raises(TrackerFailed, match=r"takes arrays with \[5, 2\] dimensions: export it with \(T, H, W\)"):
        found(np.zeros((2, 64, 64), np.uint8), np.array([[3.0, 3.0]]), model=model)
