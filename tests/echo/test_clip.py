"""Recorded clips: what a file holds comes back, with its scale and its time, or is told."""

import numpy as np
import pytest
from known_repository import FRAMES, SIZES
from PIL import Image

import echotruth as et
from echotruth.echo.failure import EchoError
from echotruth.echo.wall_file import part
from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export

GIVEN = {"spacing_mm": 0.3, "frame_time_ms": 20.0}
FILM = np.random.default_rng(1).integers(0, 255, (6, 32, 48), np.uint8)


def exported(known, folder, name):
    work = Export(Repository(known.folder), name, cases=["heart"], views=["mid"], sizes=[SIZES[0]], output=folder)
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
    colour = np.zeros((3, 4, 5, 3), np.uint8)
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


def test_levels_that_say_how_dark_it_is_are_inverted(tmp_path):
    path = written(tmp_path / "dark.dcm", 255 - FILM, PhotometricInterpretation="MONOCHROME1")
    np.testing.assert_array_equal(et.read_clip(path, **GIVEN)["image"], FILM)


def test_levels_of_a_palette_are_its_colours(tmp_path):
    colours = np.random.default_rng(2).permutation(256).astype(np.uint8)
    palette = {}
    for name in ("Red", "Green", "Blue"):
        palette[f"{name}PaletteColorLookupTableDescriptor"] = [256, 0, 8]
        palette[f"{name}PaletteColorLookupTableData"] = colours.tobytes()
    path = written(tmp_path / "palette.dcm", FILM, PhotometricInterpretation="PALETTE COLOR", **palette)
    np.testing.assert_array_equal(et.read_clip(path, **GIVEN)["image"], colours[FILM])


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("huge.gif", b"GIF89a" + b"\xff\xff\xff\xff" + bytes(3), "is no image that can be read"),
        ("header.npy", b"\x93NUMPY\x01\x00\x10\x00{'descr': (((    \n", "is no array that numpy.load reads"),
        ("missing.dcm", None, "is not there"),
        ("bad.dcm", b"no dicom", "is no DICOM clip that can be decoded"),
        ("bad.mp4", b"no video", "is no video that can be read"),
        ("bad.gif", b"no image", "is no image that can be read"),
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
        (dict.fromkeys(GIVEN), "its pixels and the time from frame to frame: give spacing_mm and frame_time_ms"),
        ({"frame_time_ms": None}, "array: does not say the time from frame to frame: give frame_time_ms"),
        ({"spacing_mm": 60}, "spacing_mm = 60: give a side from 0.001 to 10"),
        ({"frame_time_ms": float("nan")}, "frame_time_ms = nan: give a time from 0.01 to 1000"),
        ({"cycle": (3, 9)}, "cycle = 3, 9: give 3 or more of the 6 frames of array"),
        ({"crop": (0, 0, 60, 10)}, "crop = 0, 0, 60, 10: array is 48 x 32 px"),
    ],
)
def test_wrong_option_is_told(options, sentence):
    with pytest.raises(EchoError, match=sentence):
        et.read_clip(FILM, **(GIVEN | options))


@pytest.mark.parametrize(("frames", "sentence"), [(1, "has 1 frame: a clip needs 3"), (2, "has 2 frames: a clip")])
def test_clip_of_one_or_two_frames_is_refused(tmp_path, frames, sentence):
    Image.fromarray(FILM[0]).save(
        tmp_path / "a.gif", save_all=True, append_images=[*map(Image.fromarray, FILM[1:frames])]
    )
    for source in (FILM[:frames], tmp_path / "a.gif"):
        with pytest.raises(EchoError, match=sentence):
            et.read_clip(source, **GIVEN)


def scanned(shape=(300, 400), frames=8):
    """A fan of changing speckle, with writing that stays, a trace that moves below it, and noise of compression."""
    rng = np.random.default_rng(1)
    row, column = np.indices(shape)
    radius, angle = np.hypot(row - 20, column - 210), np.arctan2(column - 210, row - 20)
    fan = (radius > 15) & (radius < 220) & (abs(angle) < 0.6)
    film = np.where(fan, rng.integers(0, 200, (frames, *shape)), rng.integers(0, 4, (frames, *shape)))
    film[:, 30:45, 5:90] = 220
    film[np.arange(frames), 290, 40 * np.arange(frames)] = 255
    edges = [np.flatnonzero(fan.any(axis)) for axis in (0, 1)]
    return film.astype(np.uint8), [edges[0][0], edges[1][0], edges[0][-1] + 1, edges[1][-1] + 1]


def test_sector_is_found_among_writing_and_traces():
    film, edges = scanned()
    clip = et.read_clip(film, **GIVEN, crop="sector")
    found = part(clip.attrs["part"])
    assert np.abs(np.array(found.crop) - edges).max() <= 8
    left, top, right, bottom = found.crop
    np.testing.assert_array_equal(clip["image"], film[:, top:bottom, left:right])
    still = np.repeat(film[:1], 3, axis=0)
    assert et.read_clip(still, **GIVEN, crop="sector")["image"].shape == still.shape


def test_part_of_a_wall_is_the_default_of_cycle_and_crop():
    clip = et.read_clip(FILM, **GIVEN, part="cycle 2 6, crop 8 4 40 30")
    np.testing.assert_array_equal(clip["image"], FILM[2:6, 4:30, 8:40])
    assert clip.attrs["part"] == "cycle 2 6, crop 8 4 40 30"
    assert et.read_clip(FILM, **GIVEN, part=clip.attrs["part"], cycle=(0, 3)).sizes["frame"] == 3


def outlier(level, base=FILM):
    pixels = base.astype(float)
    pixels[1, 2, 3] = level
    return pixels


@pytest.mark.parametrize(
    ("pixels", "sentence"),
    [
        (np.zeros((3, 4)), r"has the shape \(3, 4\) of float64"),
        (np.zeros((3, 4, 5, 0), np.uint8), r"has the shape \(3, 4, 5, 0\) of uint8"),
        (np.zeros((3, 4, 5), complex), ".* of complex128"),
        (np.array(["a"]), ".* of <U1"),
        (outlier(np.nan), "has the grey level nan: give finite ones"),
        (outlier(1e40), r"has the grey level 1e\+40: give finite ones, up to 1e\+20"),
        (outlier(1e10), r"has grey levels from 0 to 1e\+10, and almost none between"),
        (np.broadcast_to(np.uint8(0), (2**15, 2**10, 2**10)), r"has 3.4e\+10 pixels: .*, 2.1e\+09 are read"),
    ],
)
def test_array_that_is_no_clip_is_told(pixels, sentence):
    with pytest.raises(EchoError, match=f"array: {sentence}"):
        et.read_clip(pixels, **GIVEN)


def frames_as(folder, images, suffix="png", names=None):
    folder.mkdir()
    for number, image in enumerate(images):
        Image.fromarray(image).save(folder / f"{names[number] if names else f'{number:02}'}.{suffix}")
    return folder


@pytest.mark.parametrize(
    ("suffix", "images"),
    [
        ("png", FILM.astype(np.uint16) * 16),  # 12 bits of 16
        ("tif", FILM.astype(np.uint16) * 256),
        ("tif", FILM.astype(np.int32) * 1000 - 70_000),
        ("tif", FILM.astype(np.float32) / 254),
    ],
)
def test_images_of_more_than_8_bits_are_scaled_by_the_range_of_the_clip(tmp_path, suffix, images):
    clip = et.read_clip(frames_as(tmp_path / "frames", images, suffix), **GIVEN)
    np.testing.assert_allclose(clip["image"], FILM * (255 / FILM.max()), atol=0.501)


def test_16_bit_tiff_in_which_0_is_white_is_inverted(tmp_path):
    for number, image in enumerate(FILM.astype(np.uint16)):
        Image.fromarray(image).save(tmp_path / f"{number}.tif")
        content = (tmp_path / f"{number}.tif").read_bytes()
        tag = content.index(b"\x06\x01\x03\x00\x01\x00\x00\x00\x01")  # photometric interpretation, a short: 1
        (tmp_path / f"{number}.tif").write_bytes(content[: tag + 8] + b"\0" + content[tag + 9 :])
    expected = (FILM.max() - FILM.astype(float)) * (255 / FILM.max())
    np.testing.assert_allclose(et.read_clip(tmp_path, **GIVEN)["image"], expected, atol=0.501)


def test_frames_come_in_the_order_of_their_numbers(tmp_path):
    names = [0, 1, 2, 10, 11, 100]
    np.testing.assert_array_equal(et.read_clip(frames_as(tmp_path / "a", FILM, names=names), **GIVEN)["image"], FILM)


def test_all_pages_of_a_tiff_are_frames(tmp_path):
    first, *others = map(Image.fromarray, FILM)
    (tmp_path / "pages").mkdir()
    path = tmp_path / "pages/film.tif"
    first.save(path, save_all=True, append_images=others)
    for source in (path, path.parent):
        np.testing.assert_array_equal(et.read_clip(source, **GIVEN)["image"], FILM)


def test_frames_of_two_kinds_are_told(tmp_path):
    folder = frames_as(tmp_path / "a", [FILM[0], FILM[1].astype(np.uint16)])
    with pytest.raises(EchoError, match=r"01.png: has levels of uint16, and 00.png of uint8: frames must be of one"):
        et.read_clip(folder, **GIVEN)


def test_header_that_claims_more_than_the_file_holds_is_told_without_reading(tmp_path):
    header = np.lib.format.header_data_from_array_1_0(np.zeros(1)) | {"shape": (10**6, 10**4, 11368)}
    with (tmp_path / "big.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(file, header)
    for read in (lambda path: et.read_clip(path, **GIVEN), lambda path: et.read_wall(path, "mid")):
        with pytest.raises(EchoError, match=r"big.npy: is no array that numpy.load reads: .*"):
            read(tmp_path / "big.npy")


def test_animation_of_an_impossible_size_is_told_without_decoding(tmp_path):
    path = tmp_path / "big.gif"
    Image.fromarray(FILM[0]).save(path)
    content = path.read_bytes()
    size = (20_000).to_bytes(2, "little") * 2
    place = content.index(b",")
    path.write_bytes(content[:6] + size + content[10 : place + 5] + size + content[place + 9 :])
    with pytest.raises(EchoError, match=r"big.gif: is no image that can be read: Image size"):
        et.read_clip(path, **GIVEN)


def test_nifti_of_an_unknown_unit_is_told(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(FILM.T, np.eye(4))
    image.header["xyzt_units"] = 128
    image.to_filename(tmp_path / "unit.nii")
    with pytest.raises(EchoError, match=r"unit.nii: is no NIfTI file that can be read"):
        et.read_clip(tmp_path / "unit.nii", **GIVEN)


@pytest.mark.parametrize(
    ("zooms", "sentence"),
    [
        ((60, 60, 0.02), "has pixels of 60 x 60 mm: give spacing_mm from 0.001 to 10"),
        ((5, 0.01, 0.02), "has pixels of 0.01 x 5 mm, more than 100 to 1: if they are square give spacing_mm"),
        ((1, 1, 1e30), r"has a time from frame to frame of 1e\+33 ms: give frame_time_ms from 0.01 to 1000"),
        ((1, 1, np.inf), "has frames of which the times do not increase: give frame_time_ms"),
    ],
)
def test_scale_and_time_of_no_echo_are_told(tmp_path, zooms, sentence):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(FILM.T, np.eye(4))
    image.header.set_zooms(zooms)
    image.header.set_xyzt_units("mm", "sec")
    image.to_filename(tmp_path / "clip.nii")
    with pytest.raises(EchoError, match=f"clip.nii: {sentence}"):
        et.read_clip(tmp_path / "clip.nii")


def test_images_of_two_sizes_are_told(tmp_path):
    for number, width in enumerate((4, 5)):
        Image.new("L", (width, 4)).save(tmp_path / f"{number}.png")
    with pytest.raises(EchoError, match=r"1.png: has 5 x 4 px, and 0.png 4 x 4"):
        et.read_clip(tmp_path, **GIVEN)


def test_hidden_files_of_a_folder_are_no_frames_and_an_image_beside_the_series_is_named(tmp_path):
    folder = frames_as(tmp_path / "a", FILM)
    (folder / "._00.png").write_bytes(b"\0\5\x16\7")  # what macOS leaves on other disks
    np.testing.assert_array_equal(et.read_clip(folder, **GIVEN)["image"], FILM)
    Image.fromarray(FILM[0]).save(folder / "thumbnail.png")
    with pytest.raises(
        EchoError, match=r"thumbnail.png: is not numbered as the 6 images #: move it elsewhere, or name"
    ):
        et.read_clip(folder, **GIVEN)
    named = frames_as(tmp_path / "b", FILM[:3], names=["before", "during", "then"])
    assert len(et.read_clip(named, **GIVEN)["image"]) == 3
