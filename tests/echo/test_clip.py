"""Recorded clips: what a file holds comes back, with its scale and its time, or is told."""

import imageio_ffmpeg
import numpy as np
import pytest
from known_repository import FRAMES, SIZES
from PIL import Image

import echotruth as et
from echotruth.echo.failure import EchoError
from echotruth.export import Export, Selection
from echotruth.repository.reader import Repository

GIVEN = {"spacing_mm": 0.3, "frame_time_ms": 20.0}
FILM = np.random.default_rng(1).integers(0, 255, (6, 32, 48), np.uint8)


def exported(known, folder, name):
    work = Export(Repository(known.folder), Selection(["heart"], ["mid"], [SIZES[0]]), name, output=folder)
    (path,) = work.write(work.clips()[0])
    return path


@pytest.mark.parametrize("name", ["dicom", "nifti"])
def test_export_comes_back_with_scale_and_time(known, tmp_path, name):
    pytest.importorskip({"dicom": "pydicom", "nifti": "nibabel"}[name])
    clip = et.read_clip(exported(known, tmp_path, name))
    np.testing.assert_array_equal(clip["image"], known.images(SIZES[0]))
    assert clip.attrs["spacing"] == pytest.approx(12e-3 / SIZES[0])
    np.testing.assert_allclose(clip["time"], np.arange(FRAMES) * 0.12 / FRAMES)
    np.testing.assert_allclose(np.diff(clip["lateral"]), 12e-3 / SIZES[0])


def test_video_comes_back_within_its_compression(known, tmp_path):
    clip = et.read_clip(exported(known, tmp_path, "mp4"), spacing_mm=12 / SIZES[0], frame_time_ms=40)
    apart = clip["image"].values.astype(float) - known.images(SIZES[0])
    assert np.sqrt(np.mean(apart**2)) < 3


def test_folder_animation_and_array_hold_the_same(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    images = [Image.fromarray(frame) for frame in FILM]
    for number, image in enumerate(images):
        image.save(folder / f"{number:02}.png")
    images[0].save(tmp_path / "film.gif", save_all=True, append_images=images[1:], duration=100)
    np.save(tmp_path / "film.npy", FILM)
    for source in (folder, tmp_path / "film.gif", tmp_path / "film.npy", FILM):
        np.testing.assert_array_equal(et.read_clip(source, **GIVEN)["image"], FILM)


def test_colours_become_their_brightness():
    colour = np.zeros((2, 4, 5, 3), np.uint8)
    colour[..., 1] = 200
    np.testing.assert_array_equal(et.read_clip(colour, **GIVEN)["image"], 117)  # 0.587 * 200


def test_cycle_and_crop_choose_frames_and_pixels():
    clip = et.read_clip(FILM, **GIVEN, cycle=(2, 6), crop=(8, 4, 40, 30))
    np.testing.assert_array_equal(clip["image"], FILM[2:6, 4:30, 8:40])
    np.testing.assert_allclose(clip["time"], [0, 0.02, 0.04, 0.06])


def written(path, pixels, **attributes):
    """A DICOM file of an echo in colour or grey."""
    pydicom = pytest.importorskip("pydicom")
    image = pydicom.Dataset()
    image.SOPClassUID, image.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.3.1", "2.25.1"
    image.Rows, image.Columns, image.NumberOfFrames = pixels.shape[1], pixels.shape[2], len(pixels)
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.BitsAllocated = image.BitsStored = 8
    image.HighBit, image.PixelRepresentation = 7, 0
    for name, value in attributes.items():
        setattr(image, name, value)
    image.file_meta = pydicom.dataset.FileMetaDataset()
    image.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    image.file_meta.MediaStorageSOPClassUID = image.SOPClassUID
    image.file_meta.MediaStorageSOPInstanceUID = image.SOPInstanceUID
    image.add_new(0x7FE00010, "OB", pixels.tobytes())
    image.save_as(path, enforce_file_format=True)
    return path


def region(box, spacing):
    pydicom = pytest.importorskip("pydicom")
    found = pydicom.Dataset()
    found.RegionSpatialFormat, found.RegionDataType, found.RegionFlags = 1, 1, 0
    found.RegionLocationMinX0, found.RegionLocationMinY0, found.RegionLocationMaxX1, found.RegionLocationMaxY1 = box
    found.PhysicalUnitsXDirection = found.PhysicalUnitsYDirection = 3
    found.PhysicalDeltaX, found.PhysicalDeltaY = spacing
    return found


def test_region_r_waves_and_oblong_pixels_of_a_scanner(tmp_path):
    """The cycle is that from R to R, the image that of the region, and its pixels are made square."""
    attributes = {
        "FrameTimeVector": [0, 20, 20, 30, 20, 20],
        "RWaveTimeVector": [20, 90],
        "SequenceOfUltrasoundRegions": [region((8, 4, 39, 23), (0.04, 0.02))],
    }
    clip = et.read_clip(written(tmp_path / "scan.dcm", FILM, **attributes))
    np.testing.assert_allclose(clip["time"], [0, 0.02, 0.05])  # frames 1, 2 and 3; the fourth is the next R
    assert clip.attrs["spacing"] == pytest.approx(2e-4)
    assert clip["image"].shape == (3, 20, 64)


def test_region_beyond_the_image_has_lost_its_scale(tmp_path):
    path = written(
        tmp_path / "small.dcm", FILM, FrameTime=20, SequenceOfUltrasoundRegions=[region((8, 4, 90, 60), (1, 1))]
    )
    with pytest.raises(EchoError, match=r"small.dcm: does not say the side of its pixels: give spacing_mm"):
        et.read_clip(path)
    assert et.read_clip(path, spacing_mm=0.5)["image"].shape == FILM.shape


def test_scale_that_is_empty_is_told(tmp_path):
    broken = region((8, 4, 39, 23), (0.04, 0.02))
    broken.PhysicalDeltaX = None
    path = written(tmp_path / "empty.dcm", FILM, FrameTime=20, SequenceOfUltrasoundRegions=[broken])
    with pytest.raises(EchoError, match=r"empty.dcm: is a damaged DICOM clip: its region, scale or times cannot be"):
        et.read_clip(path)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("huge.gif", b"GIF89a" + b"\xff\xff\xff\xff" + bytes(3), "is no animation that can be read"),
        ("header.npy", b"\x93NUMPY\x01\x00\x10\x00{'descr': (((    \n", "is no array that numpy.load reads"),
        ("missing.dcm", None, "is not there"),
        ("bad.dcm", b"no dicom", "is no DICOM clip that can be decoded"),
        ("bad.mp4", b"no video", "is no video that can be read"),
        ("bad.gif", b"no image", "is no animation that can be read"),
        ("bad.nii", b"no image", "is no NIfTI file that can be read"),
        ("bad.npy", b"no array", "is no array that numpy.load reads"),
        ("clip.docx", b"", "use a file of .dcm"),
    ],
)
def test_what_is_no_clip_is_told(tmp_path, name, content, sentence):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(EchoError, match=f"{name}: .*{sentence}|{name}: {sentence}"):
        et.read_clip(path, **GIVEN)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"spacing_mm": None}, "array: does not say the side of its pixels: give spacing_mm"),
        ({"frame_time_ms": None}, "array: does not say the time from frame to frame: give frame_time_ms"),
        ({"spacing_mm": -1}, "spacing_mm = -1: give a positive number"),
        ({"frame_time_ms": float("nan")}, "frame_time_ms = nan: give a positive number"),
        ({"cycle": (3, 9)}, "cycle = 3, 9: array has 6 frames"),
        ({"cycle": (3, 4)}, "cycle = 3, 4"),
        ({"crop": (0, 0, 60, 10)}, "crop = 0, 0, 60, 10: array is 48 x 32 px"),
    ],
)
def test_wrong_option_is_told(options, sentence):
    with pytest.raises(EchoError, match=sentence):
        et.read_clip(FILM, **(GIVEN | options))


@pytest.mark.parametrize("pixels", [np.zeros((3, 4)), np.full((3, 4, 5), np.nan), np.array(["a"])])
def test_array_that_is_no_clip_is_told(pixels):
    with pytest.raises(EchoError, match="array: has"):
        et.read_clip(pixels, **GIVEN)


def test_images_of_two_sizes_are_told(tmp_path):
    for number, width in enumerate((4, 5)):
        Image.new("L", (width, 4)).save(tmp_path / f"{number}.png")
    with pytest.raises(EchoError, match=r"1.png: has 5 x 4 px, and 0.png 4 x 4"):
        et.read_clip(tmp_path, **GIVEN)


def test_video_with_an_odd_frame_size_is_read(tmp_path):
    """As any program writes it: frames come with the size that the file says."""
    writer = imageio_ffmpeg.write_frames(
        str(tmp_path / "a.avi"), (48, 32), pix_fmt_in="gray", macro_block_size=1, fps=10
    )
    writer.send(None)
    for frame in FILM:
        writer.send(frame)
    writer.close()
    assert et.read_clip(tmp_path / "a.avi", **GIVEN)["image"].shape == FILM.shape
