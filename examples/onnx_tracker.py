"""A point tracker that was exported to ONNX, as a tracker for `echotruth evaluate`.

    pip install 'echotruth[onnx]'
    echotruth evaluate out/demo --tracker examples.onnx_tracker:track --option model=tracker.onnx --name mine

The model takes a video (T, H, W) and points (N, 2) of its first frame, both float32, and returns their tracks
(T, N, 2): x and y in pixels, 0 at the centre of the first one. A second result, if there is one, is the quality
(T, N), 0 to 1.
Clips are resized to the H x W of the model, 256 x 256 if it takes any, and the tracks are scaled back.
"""

import cv2
import numpy as np

SIDE = 256
"""Height and width of the video for a model that takes any."""


def track(frames, points, mask, spacing, frame_time, seed, model="tracker.onnx", greys=(0.0, 1.0)):
    """Displacement of points (frame, n, 2) in px since the first frame; see docs/trackers.md.

    `greys` are the values of black and white that the model expects.
    """
    session, (black, white) = opened(model), greys
    video, places = session.get_inputs()
    height, width = (side if isinstance(side, int) else SIDE for side in video.shape[1:])
    scale = np.array([width, height]) / frames.shape[:0:-1]
    inputs = {
        video.name: resized(frames, (width, height)) * np.float32((white - black) / 255) + np.float32(black),
        places.name: ((points + 0.5) * scale - 0.5).astype(np.float32),
    }
    tracks, *quality = session.run(None, inputs)
    # Less the model's own places in frame 0, lest half a pixel between conventions remain.
    displacement = (tracks.astype(float) - tracks[0]) / scale
    return (displacement, quality[0]) if quality else displacement


def opened(model):
    """Session of a model; ValueError if it does not take a video and points."""
    try:
        from onnxruntime import InferenceSession, SessionOptions
    except ImportError as error:
        raise RuntimeError("onnxruntime is not installed: pip install 'echotruth[onnx]'") from error
    options = SessionOptions()
    options.intra_op_num_threads = 1  # sums of several threads may differ in their last digits
    session = InferenceSession(model, options, providers=["CPUExecutionProvider"])
    ranks = [len(taken.shape) for taken in session.get_inputs()]
    if ranks != [3, 2]:
        raise ValueError(f"{model} takes arrays with {ranks} dimensions: export it with (T, H, W) and (N, 2)")
    return session


def resized(frames, size):
    """Frames (T, H, W), float32, of a width and height; smaller pixels are averaged and larger ones interpolated."""
    shrinks = size[0] < frames.shape[2] or size[1] < frames.shape[1]
    method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return np.stack([cv2.resize(frame.astype(np.float32), size, interpolation=method) for frame in frames])
