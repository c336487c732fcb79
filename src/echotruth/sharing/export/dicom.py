"""DICOM: Ultrasound Multi-frame Image Storage, uncompressed, of a synthetic patient.

Attributes are those of the modules Patient, General Study, General Series, General Equipment, General Image, Image
Pixel, Cine, Multi-frame, US Region Calibration, US Image and SOP Common (DICOM PS3.3, A.7 and C.8.5).
"""

from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any
from uuid import UUID

import numpy as np

import echotruth
from echotruth.extras import optional
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.units import MHz

US_MULTI_FRAME = "1.2.840.10008.5.1.4.1.1.3.1"
"""SOP class Ultrasound Multi-frame Image Storage."""

TWO_DIMENSIONAL, TISSUE, CENTIMETRES = 1, 1, 3
"""Spatial format and data type of a region, and unit of its directions (PS3.3 C.8.5.5.1)."""

CM = 1e2
"""Centimetres in a metre."""

NO_DATE, NO_TIME = "19000101", "000000"
"""A simulation has no date, but folders of DICOM files (DICOMDIR) need one."""

NOTICE = "SYNTHETIC image simulated by echotruth. No patient, not for clinical use."


def write(clip: ExportedClip, path: Path) -> None:
    """Write a clip with its calibrated region and its frame time.

    Its identifiers are hashes of what it shows (a study is a heart, a series a view): the bytes are the same twice.

    Parameters
    ----------
    clip : ExportedClip
    path : Path

    Raises
    ------
    ExportError
        If pydicom is not installed.
    """
    pydicom = optional("pydicom", "clinical", ExportError)
    image = pydicom.Dataset()
    _subject(image, clip)
    _series(image, clip)
    _pixels(image, clip)
    region = pydicom.Dataset()
    _calibrate(region, clip)
    image.SequenceOfUltrasoundRegions = [region]
    image.file_meta = pydicom.dataset.FileMetaDataset()
    image.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    image.file_meta.MediaStorageSOPClassUID = image.SOPClassUID
    image.file_meta.MediaStorageSOPInstanceUID = image.SOPInstanceUID
    file = BytesIO()  # pydicom wraps what is wrong with a disk in pages
    image.save_as(file, enforce_file_format=True)
    path.write_bytes(file.getvalue())


def _subject(image: Any, clip: ExportedClip) -> None:
    """Patient and study: the heart, which is synthetic."""
    name, case = clip.case.config.name, clip.case.id
    image.SpecificCharacterSet = "ISO_IR 192"
    image.PatientName = "SYNTHETIC^ECHOTRUTH"
    image.PatientID = f"SYNTHETIC-{name}-{case}"[:64]
    image.PatientBirthDate = image.PatientSex = ""
    image.PatientComments = NOTICE
    image.StudyInstanceUID = _uid("study", *_heart(clip))
    image.StudyDate, image.StudyTime, image.StudyID = NO_DATE, NO_TIME, str(clip.repository.rows[clip.case.id] + 1)
    image.AccessionNumber = image.ReferringPhysicianName = ""
    image.StudyDescription = f"Synthetic heart {case}"[:64]


def _series(image: Any, clip: ExportedClip) -> None:
    """Series, equipment and identity: a view, and in it one instance for each size."""
    image.Modality = "US"
    image.SeriesInstanceUID = _uid("series", *_heart(clip), clip.view.encode())
    image.SeriesNumber = list(clip.case.config.views).index(clip.view) + 1
    image.SeriesDescription, image.BodyPartExamined = f"Synthetic {clip.view}"[:64], "HEART"
    image.Manufacturer, image.ManufacturerModelName = "echotruth", "simulated scanner"
    image.SoftwareVersions = echotruth.__version__
    image.SOPClassUID = US_MULTI_FRAME
    scale = np.array([clip.spacing, clip.frame_time]).tobytes()
    image.SOPInstanceUID = _uid("instance", image.SeriesInstanceUID.encode(), clip.image.tobytes(), scale)
    image.InstanceNumber = clip.case.config.bmode.sizes.index(clip.size) + 1


def _pixels(image: Any, clip: ExportedClip) -> None:
    """Image, its pixels and its time."""
    frames, rows, columns = clip.image.shape
    image.ImageType = ["ORIGINAL", "PRIMARY", "TTE", "0001"]  # transthoracic, two-dimensional (PS3.3 C.8.5.6.1.1)
    image.ImageComments = NOTICE
    image.PatientOrientation = ""
    image.BurnedInAnnotation = "NO"
    image.LossyImageCompression = "00"
    image.UltrasoundColorDataPresent = 0
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.BitsAllocated = image.BitsStored = 8
    image.HighBit, image.PixelRepresentation = 7, 0
    image.Rows, image.Columns, image.NumberOfFrames = rows, columns, frames
    image.FrameIncrementPointer = 0x00181063
    image.FrameTime = f"{1e3 * clip.frame_time:.10g}"  # ms, in at most 16 characters, as the format has it
    image.HeartRate = round(60 * len(clip.case.config.loop.beats) / (frames * clip.frame_time))
    image.add_new(0x7FE00010, "OB", clip.image.tobytes() + b"\0" * (clip.image.size % 2))


def _calibrate(region: Any, clip: ExportedClip) -> None:
    """Region of the whole image: lateral and axial position of its pixels, cm."""
    region.RegionSpatialFormat, region.RegionDataType, region.RegionFlags = TWO_DIMENSIONAL, TISSUE, 0
    region.RegionLocationMinX0 = region.RegionLocationMinY0 = 0
    region.RegionLocationMaxX1 = region.RegionLocationMaxY1 = clip.size - 1
    region.PhysicalUnitsXDirection = region.PhysicalUnitsYDirection = CENTIMETRES
    region.PhysicalDeltaX = region.PhysicalDeltaY = CM * clip.spacing
    region.ReferencePixelX0 = region.ReferencePixelY0 = 0
    region.ReferencePixelPhysicalValueX = CM * float(clip.lateral[0])
    region.ReferencePixelPhysicalValueY = CM * float(clip.axial[0])
    region.TransducerFrequency = round(clip.case.config.probe.frequency_MHz * MHz / 1e3)  # kHz


def _heart(clip: ExportedClip) -> tuple[bytes, ...]:
    """What identifies a heart: its name and its motion."""
    names = f"{clip.case.config.name}/{clip.case.id}".encode()
    return names, np.ascontiguousarray(clip.heart.nodes).tobytes(), clip.heart.displacement.tobytes()


def _uid(*parts: bytes | str) -> str:
    """Unique identifier from a hash, as a UUID made of a name (PS3.5 B.2, RFC 9562 version 8)."""
    digest = sha256()
    for part in parts:
        digest.update(sha256(part if isinstance(part, bytes) else part.encode()).digest())
    number = bytearray(digest.digest()[:16])
    number[6], number[8] = 0x80 | number[6] & 0x0F, 0x80 | number[8] & 0x3F
    return f"2.25.{UUID(bytes=bytes(number)).int}"
