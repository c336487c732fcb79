"""A learned point tracker in ONNX: a clip is resized to its image, and cut to its numbers of frames and points."""

from collections.abc import Sequence
from pathlib import Path
from threading import TIMEOUT_MAX, Timer
from typing import Any, get_args

import numpy as np
from PIL import Image

from echotruth.arrays import Floats
from echotruth.config.loading import checked, read_yaml
from echotruth.config.tracking import Onnx, OnnxSignature
from echotruth.extras import MissingPackage, optional
from echotruth.tracking.external_program import in_one_line
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.grey import grey_levels
from echotruth.tracking.tracker_input import TrackerInput

SIZES = {"T": "frames_per_call", "N": "points_per_call", "H": "side_px", "W": "side_px"}
"""Axis -> key of its size."""
SIDE = 256
"""Height and width of the image of a model that takes any: that of TAP-Vid (Doersch et al. 2022, arXiv:2211.03726)."""
LARGEST_START = 1 / 16
"""Median distance of the first tracks from the points, over the side of the image, above which they are others."""


def track(clip: TrackerInput, settings: Onnx) -> tuple[Floats, Floats]:
    """Run a model on a clip: displacement and quality, as :func:`echotruth.tracking.tracker.track` returns them.

    The quality is the visibility, and NaN of a model that gives none.
    """
    model = Model(settings)
    side = np.array([model.sizes["W"], model.sizes["H"]])
    images = (Image.fromarray(frame) for frame in np.nan_to_num(grey_levels(clip.frames)))
    video = np.stack([np.asarray(image.resize(tuple(side), Image.Resampling.BILINEAR)) for image in images])
    scale = side / clip.shape[::-1]
    points = np.clip((np.nan_to_num(clip.points) + 0.5) * scale - 0.5, 0, side - 1)
    moved, seen = np.zeros((len(video), *points.shape)), np.ones((len(video), len(points)))
    size = model.sizes.get("N", len(points)) or 1
    timer = Timer(min(settings.timeout_s, TIMEOUT_MAX), setattr, (model.run_options, "terminate", True))
    timer.start()
    try:
        for first in range(0, len(points), size):
            group = np.minimum(np.arange(first, first + size), len(points) - 1)  # the last one again if few are left
            moved[:, group], seen[:, group] = _followed(model, video, points[group])
    finally:
        timer.cancel()
    return moved / scale, seen


def _followed(model: "Model", video: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Displacement (frame, n, 2), px of the model, and visibility (frame, n); a call goes on where the last one ended.

    The last frame comes again in the last call until there are as many as the model takes.
    """
    size = model.sizes.get("T", len(video))
    moved, seen = np.zeros((len(video), *points.shape)), np.ones((len(video), len(points)))
    for first in range(0, len(video) - 1, size - 1):
        frames, count = np.minimum(np.arange(first, first + size), len(video) - 1), len(video) - first
        tracks, visibility = model(video[frames], points + moved[first])
        # Less the model's own places in the first frame, lest half a pixel between conventions remain.
        moved[first : first + size] = moved[first] + (tracks - tracks[0])[:count]
        seen[first : first + size] = np.minimum(seen[first], visibility[:count])
    return moved, seen


class Model:
    """A model that is loaded; TrackerFailed, ConfigError or MissingPackage says why it cannot be."""

    def __init__(self, settings: Onnx) -> None:
        self.path, self.beside, _ = map(Path, settings.files)
        self.session, self.run_options = _session(self.path)
        self.timeout_s = settings.timeout_s
        declared = read_yaml(self.beside) if self.beside.is_file() else {}
        self.signature = checked(declared, str(self.beside), OnnxSignature)
        by_name = {node.name: node for node in sorted(self.session.get_inputs(), key=lambda node: -len(node.shape))}
        names, known = self.signature.inputs or list(by_name), [node.name for node in self.session.get_outputs()]
        if sorted(names) != sorted(by_name) or len(names) != 2:
            fault = f"takes {' and '.join(by_name)}: it must take frames and points, named in this order"
            raise TrackerFailed(f"{self.beside}: inputs = {names}: {self.path} {fault}")
        self.outputs = self.signature.outputs or known[:1]
        if not {*self.outputs} <= {*known}:
            fault = f"{self.path} gives {' and '.join(known)}: use these names"
            raise TrackerFailed(f"{self.beside}: outputs = {self.outputs}: {fault}")
        self.inputs = {key: by_name[name] for key, name in zip(("frames", "points"), names, strict=True)}
        self.layouts = {key: self._layout(key, node.name, node.shape, {}) for key, node in self.inputs.items()}
        shapes = [*self.inputs["frames"].shape, *self.inputs["points"].shape]
        axes = zip("".join(self.layouts.values()), shapes, strict=True)
        self.sizes = {axis: size for axis, size in axes if axis in SIZES and isinstance(size, int)}
        for axis, key in SIZES.items():
            given = getattr(self.signature, key)
            if given is not None and self.sizes.setdefault(axis, given) != given:
                fault = f"{self.path} takes {self.sizes[axis]}: leave it out"
                raise TrackerFailed(f"{self.beside}: {key} = {given}: {fault}")
        if self.sizes.get("T", 2) < 2:
            raise TrackerFailed(f"{self.path}: takes one frame: export it with two or more, or with any number")
        self.sizes = {"H": SIDE, "W": SIDE} | self.sizes

    def __call__(self, video: Floats, points: Floats) -> tuple[Floats, Floats]:
        """Tracks (T, N, 2) and visibility (T, N), or NaN, of points (N, 2) of the first frame of a video (T, H, W)."""
        is_normalised, side = self.signature.unit == "normalised", np.array(video.shape[:0:-1], float)
        turned = slice(None, None, -1 if self.signature.coordinates == "row_column" else 1)
        places = ((points + 0.5) / side if is_normalised else points)[:, turned]
        if self.layouts["points"].endswith("3"):
            places = np.insert(places, 0, 0.0, axis=1)
        of_bytes = self.inputs["frames"].type == "tensor(uint8)"
        black, white = self.signature.values or ([0, 255] if of_bytes else [0, 1])
        found = self._run(black + (white - black) * video, places)
        shape, sizes = found[0].shape, {"T": len(video), "N": len(points)}
        axes = (1, 0) if "NT" in self._layout("tracks", self.outputs[0], shape, sizes) else (0, 1)
        tracks = found[0].reshape(shape[-3:]).transpose(*axes, 2)[..., turned]
        tracks = tracks * side - 0.5 if is_normalised else tracks
        if (start := np.median(np.hypot(*(tracks[0] - points).T))) > LARGEST_START * side.max():
            remedy = f"give the tracks, coordinates and unit in {self.beside}"
            raise TrackerFailed(f"{self.path}: {self.outputs[0]} begins {start:.0f} px from the points: {remedy}")
        visible = found[1] if found[1:] else np.full(shape[:-1], np.nan)
        if visible.shape not in (shape[:-1], (*shape[:-1], 1)) or (np.abs(visible - 0.5) > 0.5).any():
            fault = f"has the shape {visible.shape}, and is {visible.min():.3g} to {visible.max():.3g}"
            remedy = f"a visibility has the shape {shape[:-1]}, and is 0 to 1"
            raise TrackerFailed(f"{self.path}: {self.outputs[1]} {fault}: {remedy}")
        return tracks, visible.reshape(shape[-3:-1]).transpose(axes)

    def _run(self, video: Floats, places: Floats) -> list[np.ndarray]:
        """Outputs, which are finite, of a call with values and coordinates of the model."""
        arrays = {"frames": (video, self.layouts["frames"]), "points": (places, self.layouts["points"][:-1])}
        try:
            given = {node.name: _given(node, *arrays[key]) for key, node in self.inputs.items()}
            found = [np.asarray(array, float) for array in self.session.run(self.outputs, given, self.run_options)]
        except Exception as error:  # ONNX Runtime raises many kinds
            late = f"took longer than timeout_s = {self.timeout_s:g}" if self.run_options.terminate else ""
            raise TrackerFailed(f"{self.path}: {late or f'failed on a call: {in_one_line(str(error))}'}") from error
        for name, array in zip(self.outputs, found, strict=True):
            if lost := int(np.sum(~np.isfinite(array))):
                raise TrackerFailed(f"{self.path}: {lost} of the {array.size} numbers of {name} are not finite")
        return found

    def _layout(self, key: str, name: str, shape: Sequence[Any], sizes: dict[str, int]) -> str:
        """Layout of an input or output: the one that is declared, or the first that has such a shape."""
        declared = getattr(self.signature, key)
        usual = get_args(get_args(OnnxSignature.model_fields[key].annotation)[0])
        for layout in (declared,) if declared else usual:
            # The size of channels and coordinates is known, or declared; that of a batch, the first axis, need not be.
            expected = [int(axis) if axis.isdigit() else sizes.get(axis) for axis in layout]
            fits = [
                wanted in (None, size) or (not isinstance(size, int) and (declared or place == 0))
                for place, (wanted, size) in enumerate(zip(expected, shape, strict=False))
            ]
            if len(layout) == len(shape) and all(fits):
                return str(layout)
        given = f"{key} = {declared}" if declared else f"{key} is missing"
        fault = f"{name} of {self.path} has the shape ({', '.join(map(str, shape))})"
        call = f", in a call with T = {sizes['T']} and N = {sizes['N']}" if sizes else ""
        raise TrackerFailed(f"{self.beside}: {given}: {fault}{call}: give the one of {', '.join(usual)} that fits")


def _session(path: Path) -> tuple[Any, Any]:
    """Session on one core, because sums of several threads may differ in last digits, and options of its calls."""
    if not path.is_file():
        raise TrackerFailed(f"{path}: is not there: give the path of a model in ONNX")
    onnxruntime = optional("onnxruntime", "onnx", MissingPackage, f"{path} ")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4  # errors are raised, and reported once
    try:
        session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime raises many kinds
        raise TrackerFailed(f"{path}: is no model that ONNX Runtime can load: {in_one_line(str(error))}") from error
    return session, onnxruntime.RunOptions()


def _given(node: Any, array: Floats, layout: str) -> np.ndarray:
    """An array in the layout and type of an input; it is repeated along axes that are numbers."""
    for place, axis in enumerate(layout):
        array = np.expand_dims(array, place).repeat(int(axis), axis=place) if axis.isdigit() else array
    name = node.type.removeprefix("tensor(").removesuffix(")")
    kind = np.dtype({"float": "float32", "double": "float64"}.get(name, name))
    return np.ascontiguousarray(array if kind.kind == "f" else np.rint(array), kind)
