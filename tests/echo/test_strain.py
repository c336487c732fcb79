"""Strain of a recorded clip: that of a ring whose motion is known, at any scale, and what makes one doubt."""

from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pytest
from contracting_ring import ENDO, EPI, FRAMES
from PIL import Image

import echotruth as et
from echotruth.cli import main
from echotruth.echo import page
from echotruth.echo.failure import EchoError
from echotruth.echo.wall import write_wall
from echotruth.sharing.export import Export

MIDDLE = (ENDO + EPI) / 2


def clip_of(ring, frames=slice(None), spacing_mm=0.04):
    return et.read_clip(ring.frames[frames], spacing_mm=spacing_mm, frame_time_ms=10)


@pytest.fixture(scope="module")
def tracked(ring):
    return et.speckle_tracking(clip_of(ring), ring.wall())


def test_global_strain_rotation_and_cavity_are_those_of_the_motion(ring, tracked):
    for contour, radius in zip(("endocardial", "middle", "epicardial"), (ENDO, MIDDLE, EPI), strict=True):
        found = tracked["line_strain"].sel(contour=contour)
        np.testing.assert_allclose(found, ring.line(radius), atol=0.01 if contour == "middle" else 0.02)
    np.testing.assert_allclose(tracked["rotation"], 0, atol=0.01)
    area = np.pi * (ENDO**2 - ring.lost) * (0.04e-3) ** 2
    np.testing.assert_allclose(tracked["cavity_area"], area, rtol=0.03)
    assert tracked.attrs["es_frame"] == FRAMES // 2
    assert tracked.attrs["gcs_percent"] == pytest.approx(100 * ring.line(MIDDLE)[FRAMES // 2], abs=1)
    assert "gls_percent" not in tracked.attrs and not tracked.attrs["notes"]


def test_segments_of_an_even_ring_are_equal(ring, tracked):
    strain = tracked["segment_strain"].sel(measure="engineering", wall_component="TT").isel(frame=FRAMES // 2)
    seen = strain.dropna("aha")
    assert seen["aha"].values.tolist() == [7, 8, 9, 10, 11, 12]
    assert page.curves(tracked)["segment_7_mid_anterior_percent"].min() == pytest.approx(100 * float(seen[0]), abs=0.5)
    assert float(seen.max() - seen.min()) < 0.02
    assert float(seen.mean()) == pytest.approx(ring.line(MIDDLE)[FRAMES // 2], abs=0.015)


def test_size_of_the_heart_does_not_matter_nor_does_a_thin_wall(ring, tracked):
    thin = et.speckle_tracking(clip_of(ring, spacing_mm=0.022), ring.wall())
    assert 0.5 < ring.wall().thickness() * 0.022 < 0.6
    np.testing.assert_allclose(thin["line_strain"], tracked["line_strain"], atol=1e-6)
    np.testing.assert_allclose(thin["cavity_area"], 0.55**2 * tracked["cavity_area"], rtol=1e-4)


def test_peaks_are_read_as_those_of_a_repository(tracked):
    peaks = et.strain_peaks(tracked[["line_strain", "time"]])
    assert float(peaks["line_strain_peak"].sel(contour="middle")) == pytest.approx(-0.10, abs=0.04)


def test_any_tracker_will_do(ring):
    still = et.speckle_tracking(
        clip_of(ring), ring.wall(), lambda frames, points, *rest: np.zeros((len(frames), *points.shape))
    )
    np.testing.assert_allclose(still["line_strain"], 0, atol=1e-9)
    np.testing.assert_allclose(still["cavity_area"], np.pi * ENDO**2 * (0.04e-3) ** 2, rtol=0.01)
    dis = et.speckle_tracking(clip_of(ring), ring.wall(), "dis")
    assert dis.attrs["gcs_percent"] == pytest.approx(100 * ring.line(MIDDLE)[FRAMES // 2], abs=2)


def test_clip_that_begins_elsewhere_and_does_not_close_is_told(ring):
    strain = et.speckle_tracking(clip_of(ring, slice(4, FRAMES)), ring.wall(), "dis")
    few, first, second = strain.attrs["notes"].splitlines()
    assert few == (
        "the cycle has only 6 frames, so that 7 % of the strain may be missed between two: record 10 or more"
    )
    assert "the cavity is largest in frame 5" in first and "begin the cycle at end-diastole" in first
    assert "is left in the last frame" in second


def test_closed_cycle_whose_last_frame_is_a_step_before_its_end_is_not_doubted(tmp_path, caplog):
    """The clips of the sample have ten frames, so that a fifth of the motion is left in the last."""
    pytest.importorskip("pydicom")
    work = Export(et.sample(), "dicom", cases=["healthy"], views=["mid"], output=tmp_path)
    (path,) = work.write(work.clips()[0])
    np.save(tmp_path / "wall.npy", et.sample().clip("healthy", "mid")["mask"][0].values)
    clip, wall = et.read_clip(path), et.read_wall(tmp_path / "wall.npy", "mid")
    assert len(clip["frame"]) == 10
    closed = et.speckle_tracking(clip, wall, "dis")
    assert closed.attrs["drift_percent"] > 15
    assert not closed.attrs["notes"] and not caplog.text
    cut = et.speckle_tracking(et.read_clip(path, cycle=(0, 8)), wall, "dis")
    assert "is left in the last frame: is it one whole cycle?" in cut.attrs["notes"]


def test_video_of_which_every_image_comes_twice_is_told(ring, tmp_path):
    path = tmp_path / "twice.mp4"
    size = ring.frames.shape[1:]
    video = imageio_ffmpeg.write_frames(str(path), size, pix_fmt_in="gray", fps=20, macro_block_size=1)
    video.send(None)
    for frame in np.repeat(ring.frames, 2, axis=0):
        video.send(np.ascontiguousarray(frame))
    video.close()
    clip = et.read_clip(path, spacing_mm=0.04, frame_time_ms=5)
    notes = et.speckle_tracking(clip, ring.wall(), "dis").attrs["notes"]
    assert notes.startswith("every image comes twice: take one frame of each pair")


def test_wall_that_does_not_go_with_its_cycle_is_told(ring):
    for spacing_mm, frame_time_ms, told in ((0.4, 10, True), (0.04, 100, True), (0.4, 90, False)):
        clip = et.read_clip(ring.frames, spacing_mm=spacing_mm, frame_time_ms=frame_time_ms)
        notes = et.speckle_tracking(clip, ring.wall(), "dis").attrs["notes"]
        assert (
            f"does not go with a cycle of {FRAMES * frame_time_ms} ms" in notes and "is it one cycle?" in notes
        ) == told
        assert bool(notes) == told


def test_lengths_of_a_mouse_in_a_human_heart_are_told(ring):
    human = et.read_clip(ring.frames, spacing_mm=0.4, frame_time_ms=90)
    notes = et.speckle_tracking(human, ring.wall(), "bspline_dic", knots_mm=0.4).attrs["notes"]
    assert notes.startswith("knots_mm = 0.4 suits a wall 0.85 mm thick, and this one has 9.7 mm: give about 4.6")


def test_wall_too_thin_and_no_clip_are_told(ring):
    wall = ring.wall()
    thin = et.Wall(wall.endocardium, 79.5 + (wall.endocardium - 79.5) * 1.1)
    with pytest.raises(EchoError, match=r"the wall is 3.6 px thick"):
        et.speckle_tracking(clip_of(ring), thin)
    with pytest.raises(EchoError, match=r"the wall is 0.096 mm thick, .* can be tracked: is the side of a pixel"):
        et.speckle_tracking(clip_of(ring, spacing_mm=0.004), wall)
    with pytest.raises(EchoError, match=r"clip: must be what echotruth.read_clip returns"):
        et.speckle_tracking(ring.frames, wall)


def test_wall_or_mask_beyond_the_image_is_refused_with_both_sizes(ring):
    wall, clip = ring.wall(), clip_of(ring)
    beyond = replace(wall, epicardium=wall.epicardium + [40.0, 0.0], endocardium=wall.endocardium + [40.0, 0.0])
    with pytest.raises(EchoError, match=r"columns 60 to 180 and rows 20 to 140, and the image 160 x 160 px: give"):
        et.speckle_tracking(clip, beyond)
    larger = replace(wall, mask_shape=(160, 200))
    with pytest.raises(EchoError, match=r"the mask of the wall has 200 x 160 px, and the image 160 x 160 px"):
        et.speckle_tracking(clip, larger)


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr("sys.argv", ["echotruth", "track", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, capsys.readouterr()


def test_wall_drawn_in_another_part_of_the_recording_is_refused(ring, tmp_path):
    clip, wall = clip_of(ring), ring.wall()
    assert clip.attrs["part"] == "cycle 0 10, crop 0 0 160 160"
    write_wall(tmp_path / "wall.csv", replace(wall, part="cycle 3 10, crop 8 0 160 160"))
    drawn = et.read_wall(tmp_path / "wall.csv")
    with pytest.raises(et.EchoError, match=r"drawn in a clip of cycle 3 10, .* this clip is cycle 0 10, .*: let both"):
        et.speckle_tracking(clip, drawn, "dis")


def test_wall_whose_part_cannot_be_read_is_refused(ring, tmp_path, monkeypatch, capsys):
    """Files of an earlier version say where the part begins, and not where it ends."""
    np.save(tmp_path / "clip.npy", ring.frames)
    drawn = replace(ring.wall(), part="from frame 0, column 120 and row 40 on")
    write_wall(tmp_path / "clip.wall.csv", drawn)
    sentence = 'the part "from frame 0, column 120 and row 40 on" in which the wall was drawn cannot be read: write'
    with pytest.raises(et.EchoError, match=f"^{sentence} .* --cycle and --crop$"):
        et.speckle_tracking(clip_of(ring), drawn, "dis")
    given = tmp_path / "clip.npy", "--spacing-mm", "0.04", "--frame-time-ms", "10", "-o", tmp_path / "out"
    status, told = run(monkeypatch, capsys, *given)
    assert status == 2 and told.err.count("\n") == 1
    assert told.err.startswith(f"echotruth: {tmp_path / 'clip.wall.csv'}: {sentence}")


def test_command_writes_page_curves_and_table_of_a_batch(ring, tmp_path, monkeypatch, capsys):
    wall = ring.wall()
    for name in ("one", "two", "three"):
        np.save(tmp_path / f"{name}.npy", ring.frames)
    rows = [("endocardium", *point) for point in wall.endocardium] + [
        ("epicardium", *point) for point in wall.epicardium
    ]
    for name in ("one", "two"):
        pd.DataFrame(rows, columns=["part", "lateral_px", "axial_px"]).to_csv(
            tmp_path / f"{name}.wall.csv", index=False
        )
    clips = [tmp_path / f"{name}.npy" for name in ("one", "two", "three")]
    options = [
        "--view",
        "mid",
        "--spacing-mm",
        "0.04",
        "--frame-time-ms",
        "10",
        "--tracker",
        "dis",
        "-o",
        tmp_path / "out",
    ]
    status, told = run(monkeypatch, capsys, *clips, *options)
    assert status == 1
    assert "three.wall.csv: is not there: draw the wall" in told.err
    table = pd.read_csv(tmp_path / "out/strain.csv")
    assert len(table) == 2 and table["gcs_percent"].iloc[0] == table["gcs_percent"].iloc[1]
    assert table["doubtful"].tolist() == [False, False]
    curves = pd.read_csv(tmp_path / "out/one.csv")
    np.testing.assert_allclose(curves["time_ms"], 10 * np.arange(FRAMES))
    np.testing.assert_allclose(curves["gcs_middle_percent"], 100 * ring.line(MIDDLE), atol=2)
    assert (tmp_path / "out/one.png").stat().st_size > 20_000


def test_command_refuses_what_cannot_be(ring, tmp_path, monkeypatch, capsys):
    np.save(tmp_path / "one.npy", ring.frames)
    clip, wall, scale = tmp_path / "one.npy", tmp_path / "ring.npy", ("--spacing-mm", 1, "--frame-time-ms", 1)
    np.save(wall, ring.wall().mask(ring.frames.shape[1:]))
    for arguments, sentence in (
        ([clip, "--view", "middle", "--wall", wall, *scale], "view = 'middle'"),
        ([clip, "--wall", wall], "and its view: give --spacing-mm, --frame-time-ms and --view"),
        ([clip, clip, "--view", "mid"], "one.npy: has the name of"),
        ([clip, "--view", "mid"], "one.wall.csv: is not there: draw the wall"),
        ([clip, "--view", "mid", "--wall", wall], "frame to frame: give --spacing-mm and --frame-time-ms\n"),
        (
            [clip, "--view", "mid", "--wall", wall, *scale, "--tracker", "diss"],
            "diss: is not a tracker: did you mean dis?",
        ),
        ([clip, "--view", "mid", "--wall", wall, *scale, "--onnx", "none.onnx"], "none.onnx: is not there: give the"),
        ([clip, clip.with_name("two.npy"), "--view", "mid", "--wall", wall], "suits one clip"),
    ):
        status, told = run(monkeypatch, capsys, *arguments, "-o", tmp_path / "out")
        assert status == 2
        assert sentence in told.err
        assert "Traceback" not in told.err


@pytest.fixture
def many(ring, tmp_path, monkeypatch):
    """Clips of one name in two folders, and one of the name of the table; and the options to track them."""
    mask = ring.wall().mask(ring.frames.shape[1:])
    for name in ("first/a", "second/a", "second/b", "second/strain"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        np.save(tmp_path / f"{name}.npy", ring.frames)
        Image.fromarray(mask).save(tmp_path / f"{name}.png")
    monkeypatch.chdir(tmp_path)
    return ("--spacing-mm", "0.04", "--frame-time-ms", "10", "--tracker", "dis", "--view", "mid")


def test_clip_is_tracked_from_the_frame_that_was_drawn_in_and_its_strain_marked_as_doubtful(
    ring, tmp_path, monkeypatch, capsys
):
    """The recording begins two frames earlier than the cycle, and ends in its midst."""
    np.save(tmp_path / "late.npy", np.pad(np.roll(ring.frames, 2, axis=0)[:8], [(0, 0), (3, 0), (5, 0)]))
    write_wall(tmp_path / "late.wall.csv", replace(ring.wall(), part="cycle 2 8, crop 5 3 165 163"))
    scale = ("--spacing-mm", "0.04", "--frame-time-ms", "10", "--tracker", "dis", "-o", tmp_path / "out")
    status, told = run(monkeypatch, capsys, tmp_path / "late.npy", *scale)
    assert status == 0 and "late.npy: tracks 6 frames by dis (cycle 2 8, crop 5 3 165 163)" in told.err
    assert "% (doubtful), " in told.out and "is it one whole cycle?" in told.err
    curves = pd.read_csv(tmp_path / "out/late.csv")
    np.testing.assert_allclose(curves["gcs_middle_percent"], 100 * ring.line(MIDDLE)[:6], atol=2)
    assert pd.read_csv(tmp_path / "out/strain.csv")["doubtful"].tolist() == [True]


def test_clips_of_one_name_are_refused_and_nothing_is_written_over(many, tmp_path, monkeypatch, capsys):
    status, told = run(monkeypatch, capsys, "first/a.npy", "second/a.npy", *many)
    assert status == 2 and "second/a.npy: has the name of first/a.npy: track it into another folder" in told.err
    for clip, output, written in (("second/strain", "out", "out/strain.csv"), ("first/a", "first", "first/a.png")):
        status, told = run(monkeypatch, capsys, f"{clip}.npy", *many, "--wall", f"{clip}.png", "-o", output)
        assert status == 2 and f"{clip}.npy: would be written to {written}, which is another file" in told.err
    assert not list(tmp_path.rglob("*.csv"))


def test_clips_of_several_commands_have_one_table(many, tmp_path, monkeypatch, capsys):
    def track(clip):
        return run(monkeypatch, capsys, f"{clip}.npy", *many, "--wall", f"{clip}.png")

    assert [track(clip)[0] for clip in ("first/a", "second/b", "./first/a")] == [0, 0, 0]
    assert pd.read_csv("strain/strain.csv")["source"].tolist() == ["second/b.npy", "first/a.npy"]
    page = (tmp_path / "strain/a.png").read_bytes()
    status, told = track("second/a")
    assert status == 2 and "second/a.npy: has the name of first/a.npy" in told.err
    assert (tmp_path / "strain/a.png").read_bytes() == page
    (tmp_path / "strain/strain.csv").write_text("mine\n1\n")
    assert "strain.csv: is no table of tracked clips" in track("second/b")[1].err
