"""Videos and images, read by OpenCV and ffmpeg: every grey level, its place, and the time of a frame."""

import json
import struct
import subprocess

import cv2
import imageio_ffmpeg
import numpy as np
import pytest
from known_repository import FRAMES, SHIFT, SIZES

from echotruth.repository.reader import Repository
from echotruth.sharing.export import ExportError, mp4
from echotruth.sharing.export.clip import ExportedClip

PERIOD = 0.12
"""Of the default cycle of a mouse, s."""


def frames(path):
    """Frames of a video or animation as OpenCV decodes them, (frame, row, column), and its frames per second."""
    video, found = cv2.VideoCapture(str(path)), []
    while (read := video.read())[0]:
        found.append(read[1])
    return np.array(found), video.get(cv2.CAP_PROP_FPS)


def described(path):
    """The comment of a file, by ffmpeg."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f", "ffmetadata", "-"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    (comment,) = [line.partition("=")[2] for line in text.splitlines() if line.lower().startswith("comment=")]
    return json.loads(comment.replace("\\", ""))


@pytest.mark.parametrize("name, tolerance", [("mp4", 4), ("gif", 0)])
def test_block_near_the_array_at_positive_lateral_is_at_the_upper_right(exported, known, name, tolerance):
    found, rate = frames(exported(name))
    assert (found.shape, rate) == ((FRAMES, *SIZES[:1] * 2, 3), 20)
    grey = found.astype(int).mean(axis=-1)
    inner = np.s_[:, 18:30, 98:110]  # H.264 blurs edges
    np.testing.assert_allclose(grey[inner], 220, atol=tolerance)
    np.testing.assert_allclose(
        grey[:, 98:110, 18:30].mean((1, 2)), 40 + 40 * np.arange(FRAMES), atol=max(tolerance, 1e-9)
    )
    np.testing.assert_allclose(grey[:, 98:110, 98:110], 10, atol=tolerance)


@pytest.mark.parametrize("name", ["mp4", "gif", "png"])
def test_file_says_its_scale_and_the_time_of_a_frame(exported, known, name):
    path = exported(name, size=SIZES[1])
    if name == "png":
        about = json.loads(chunks(path / "frame_000.png")[b"tEXt"].partition(b"\0")[2])
    else:
        about = json.loads(comment_of_gif(path)) if name == "gif" else described(path)
    assert about["spacing_m"] == pytest.approx(12e-3 / SIZES[1])
    assert about["frame_time_s"] == pytest.approx(PERIOD / FRAMES)
    assert about["first_pixel_lateral_m"] == pytest.approx(-6e-3 + 6e-3 / SIZES[1])
    assert about["first_pixel_axial_m"] == pytest.approx(6e-3 / SIZES[1])
    assert about["synthetic"] is True


def chunks(path):
    """Type -> data of the chunks of a PNG file (PNG specification, section 5)."""
    content, place, found = path.read_bytes(), 8, {}
    while place < len(content):
        length, kind = struct.unpack(">I4s", content[place : place + 8])
        found[kind] = content[place + 8 : place + 8 + length]
        place += length + 12
    return found


def comment_of_gif(path):
    """Text of the comment extension, 21 FE, in its blocks (GIF89a specification, section 24)."""
    content = path.read_bytes()
    place, text = content.index(b"\x21\xfe") + 2, b""
    while length := content[place]:
        text += content[place + 1 : place + 1 + length]
        place += 1 + length
    return text


def test_png_has_every_grey_level_and_its_pixels_per_metre(exported, known):
    folder = exported("png", "long")
    files = sorted(folder.iterdir())
    assert [file.name for file in files] == [f"frame_{number:03d}.png" for number in range(FRAMES)]
    found = np.stack([cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files])
    np.testing.assert_array_equal(found, known.images(SIZES[0]))
    x, y, unit = struct.unpack(">IIB", chunks(files[0])[b"pHYs"])
    assert (x, y, unit) == (pytest.approx(SIZES[0] / 12e-3, abs=0.5), x, 1)


def test_rate_is_that_of_the_video(exported):
    assert frames(exported("mp4", rate=50.0))[1] == pytest.approx(50)
    assert frames(exported("mp4", rate=0.125))[1] == 0.125
    assert frames(exported("gif", rate=25.0))[1] == pytest.approx(25)


def test_rate_that_a_gif_does_not_have_is_refused_and_leaves_no_file(exported, tmp_path):
    with pytest.raises(ExportError, match="--rate 60: a GIF shows 50 frames per second at most"):
        exported("gif", rate=60.0)
    assert not list(tmp_path.iterdir())


def overlaid(exported, *names):
    """Frames with an overlay, RGB, (frame, row, column, 3)."""
    files = sorted(exported("png", overlay=names).iterdir())
    return np.stack([cv2.cvtColor(cv2.imread(str(file)), cv2.COLOR_BGR2RGB) for file in files]).astype(int)


def is_coloured(pictures):
    return np.ptp(pictures, axis=-1) > 0


def test_segments_colour_the_wall_and_nothing_else_each_in_its_own_colour(exported, known):
    labels, found = known.labels("mid", SIZES[0]), overlaid(exported, "segments")
    layer, segment = labels["layer"], labels["segment"]
    np.testing.assert_array_equal(is_coloured(found)[layer == 0], False)
    plain = (layer > 0) & (known.images(SIZES[0]) == 10)
    tints = {number: np.unique(found[plain & (segment == number)], axis=0) for number in np.unique(segment[plain])}
    assert set(tints) == set(range(7, 13)) and all(len(tint) == 1 for tint in tints.values())
    assert len({tuple(tint[0]) for tint in tints.values()}) == 6


def test_wall_is_drawn_along_the_edge_of_the_mask(exported, known):
    mask = known.labels("mid", SIZES[0])["mask"].astype(np.uint8)
    found = is_coloured(overlaid(exported, "wall"))
    for drawn, inside in zip(found, mask, strict=True):
        edge = cv2.morphologyEx(inside, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
        assert drawn[edge].mean() > 0.5
        assert not drawn[cv2.dilate(edge.astype(np.uint8), np.ones((5, 5), np.uint8)) == 0].any()


def test_arrows_are_as_long_as_the_displacement(exported, known):
    """The last of them reaches further than the first by the displacement, in pixels."""
    found = is_coloured(overlaid(exported, "displacement"))
    start, end = (np.argwhere(frame) for frame in (found[0], found[-1]))
    moved = (end.max(axis=0) - start.max(axis=0), end.min(axis=0) - start.min(axis=0))
    axial, lateral = SHIFT[1] / known.spacing, SHIFT[0] / known.spacing
    assert moved[0][1] == pytest.approx(lateral, abs=1) and moved[1][0] == pytest.approx(axial, abs=1)
    opposite = found[-1].copy()  # the tails stay where the tissue was
    assert opposite[tuple(start.T)].mean() > 0.5


def test_video_of_an_odd_number_of_pixels_keeps_its_scale(known, tmp_path):
    clip = ExportedClip(Repository(known.folder), known.case, "mid", 127)
    clip.__dict__["image"] = known.images(SIZES[0])[:, :127, :127]
    mp4.write(clip, tmp_path / "odd.mp4", (), 20.0)
    found, _ = frames(tmp_path / "odd.mp4")
    assert found.shape[1:3] == (128, 128)
    np.testing.assert_allclose(found[:, 18:30, 98:110], 220, atol=4)
