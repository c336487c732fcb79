"""DICOM, read by pydicom and examined by dciodvfy of dicom3tools."""

import shutil
import subprocess

import numpy as np
import pytest
from known_repository import FRAMES, SIZES

pydicom = pytest.importorskip("pydicom")


@pytest.fixture(scope="module")
def image(exported_once):
    return pydicom.dcmread(exported_once("dicom"))


def test_grey_levels_are_those_of_the_repository(image, known):
    assert image.SOPClassUID.name == "Ultrasound Multi-frame Image Storage"
    np.testing.assert_array_equal(image.pixel_array, known.images(SIZES[0]))


def test_frame_time_is_in_milliseconds_and_the_heart_rate_its_own(image):
    assert image.FrameIncrementPointer == pydicom.tag.Tag("FrameTime")
    assert float(image.FrameTime) == pytest.approx(120 / FRAMES)
    assert image.HeartRate == 500


def test_calibrated_region_says_where_a_pixel_is(image):
    """By PS3.3 C.8.5.5: the value at the reference pixel and the step from pixel to pixel, in cm (code 3)."""
    (region,) = image.SequenceOfUltrasoundRegions
    assert (region.PhysicalUnitsXDirection, region.PhysicalUnitsYDirection) == (3, 3)
    assert (region.RegionLocationMaxX1, region.RegionLocationMaxY1) == (SIZES[0] - 1, SIZES[0] - 1)
    row, column = np.argwhere(image.pixel_array[0] == 220).mean(axis=0)
    x = region.ReferencePixelPhysicalValueX + (column - region.ReferencePixelX0) * region.PhysicalDeltaX
    y = region.ReferencePixelPhysicalValueY + (row - region.ReferencePixelY0) * region.PhysicalDeltaY
    assert x == pytest.approx((104 - SIZES[0] / 2) * 1.2 / SIZES[0])  # cm to the side of positive lateral
    assert y == pytest.approx(24 * 1.2 / SIZES[0])  # cm below the array
    assert region.PhysicalDeltaX == pytest.approx(1.2 / SIZES[0])


def test_patient_is_marked_as_synthetic(image):
    assert "SYNTHETIC" in str(image.PatientName) and image.PatientID.startswith("SYNTHETIC")
    assert "No patient" in "".join(image.PatientComments)


def test_identifiers_follow_what_is_shown(exported):
    """A study is a heart, a series a view, and an instance a clip; all are valid, and the bytes the same twice."""
    paths = [exported("dicom", view, size) for view in ("mid", "long") for size in SIZES]
    images = [pydicom.dcmread(path) for path in paths]
    assert len({image.StudyInstanceUID for image in images}) == 1
    assert [images[0].SeriesInstanceUID == image.SeriesInstanceUID for image in images] == [True, True, False, False]
    assert len({image.SOPInstanceUID for image in images}) == 4
    assert all(image.SOPInstanceUID.is_valid and image.StudyInstanceUID.is_valid for image in images)
    before = paths[0].read_bytes()
    assert exported("dicom").read_bytes() == before


@pytest.mark.skipif(shutil.which("dciodvfy") is None, reason="needs dciodvfy of dicom3tools")
@pytest.mark.parametrize("view", ["mid", "long"])
def test_validator_finds_nothing(exported, view):
    done = subprocess.run(
        ["dciodvfy", "-new", exported("dicom", view)], capture_output=True, text=True, check=False, errors="replace"
    )
    assert (done.returncode, done.stdout + done.stderr) == (0, "USMultiFrameImage\n")
