"""Recorded clips in files of other kinds than DICOM: video, animation, images, NIfTI, NumPy, EchoXFlow."""

import os
import re
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from echotruth.echo import dicom, echoxflow
from echotruth.echo.failure import FEWEST_FRAMES, EchoError, reading
from echotruth.echo.recording import Recording, check_size, grey
from echotruth.extras import optional

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Endings of the images of a folder, of which each is a frame, in the order of the numbers in their names."""
PHOTOMETRIC = 262
"""Tag of a TIFF that says whether 0 is black."""


def read(path: Path) -> Recording:
    """Read a clip by the ending of its name.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Recording

    Raises
    ------
    EchoError
        If there is no such file, or it holds no clip.
    """
    suffix = ".nii.gz" if path.name.lower().endswith(".nii.gz") else path.suffix.lower()
    if os.path.isdir(path):  # which is False of a name that is too long, where a Path raises
        return echoxflow.read(path) if suffix == ".zarr" else _folder(path)
    if not os.path.isfile(path):
        raise EchoError(f"{path}: is not there, or no file: give the path of a clip")
    if suffix not in READERS:
        raise EchoError(f"{path}: use a file of {', '.join(name for name in READERS if name)}, or a folder of images")
    return READERS[suffix](path)


def _folder(path: Path) -> Recording:
    """Frames of a folder of images."""
    from echotruth.mechanics.motion_file.files import natural_order

    images = (file for file in path.iterdir() if file.suffix.lower() in IMAGES and file.is_file())
    files = sorted((file for file in images if not file.name.startswith(".")), key=natural_order)
    _check_series(files)
    frames = [(file, page) for file in files for page in _pages(file)]
    if not frames:
        raise EchoError(f"{path}: has no images: a clip needs {FEWEST_FRAMES} or more ({', '.join(IMAGES)})")
    return _clip(frames, path)


def _check_series(files: list[Path]) -> None:
    """Raise an :class:`EchoError` that names an image whose name is like none of those that are numbered alike."""
    kinds = [re.sub(r"\d+", "#", file.stem) for file in files]
    series, count = max(Counter(kinds).items(), key=lambda kind: kind[1], default=("", 0))
    odd = [file for file, kind in zip(files, kinds, strict=True) if kinds.count(kind) == 1]
    if "#" in series and count >= FEWEST_FRAMES and odd:
        raise EchoError(
            f"{odd[0]}: is not numbered as the {count} images {series}: move it elsewhere, or name it alike"
        )


def _animation(path: Path) -> Recording:
    """Frames of a GIF, or pages of a TIFF."""
    return _clip([(path, page) for page in _pages(path)], path)


def _clip(frames: list[tuple[Path, NDArray[Any]]], path: Path) -> Recording:
    """Clip of frames, each with the file that it is of."""
    name, first = frames[0][0].name, frames[0][1]
    for file, frame in frames:
        if frame.shape != first.shape:
            sizes = "{1} x {0}".format(*frame.shape), "{1} x {0}".format(*first.shape)
            raise EchoError(f"{file}: has {sizes[0]} px, and {name} {sizes[1]}: frames must be of one size")
        if frame.dtype != first.dtype:
            kinds = f"levels of {frame.dtype}, and {name} of {first.dtype}"
            raise EchoError(f"{file}: has {kinds}: frames must be of one kind")
    return Recording(grey(np.stack([frame for _, frame in frames]), str(path)))


def _pages(path: Path) -> list[NDArray[Any]]:
    """Images (axial, lateral) of a file: the frames of an animation, the pages of a TIFF, or one."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        with reading(path, "no image that can be read"), Image.open(path) as image:
            check_size(image.width * image.height * getattr(image, "n_frames", 1), str(path))
            return [_levels(page, path) for page in ImageSequence.Iterator(image)]


def _levels(page: Image.Image, path: Path) -> NDArray[Any]:
    """Levels (axial, lateral) of an image: uint8, or as they are where they have more bits, which Pillow cuts off."""
    page.load()
    if page.mode == "P" and (most := int(np.asarray(page).max())) >= (colours := len(page.getpalette() or []) // 3):
        raise EchoError(f"{path}: has a pixel of colour {most}, and a palette of {colours}: save it again")
    if not page.mode.startswith(("I", "F")):
        return grey(np.asarray(page.convert("RGB"))[None], str(path))[0]
    levels = np.asarray(page)
    # Pillow inverts images of up to 8 bits in which 0 is white.
    is_white_0 = getattr(page, "tag_v2", {}).get(PHOTOMETRIC) == 0
    return -levels.astype(float) if is_white_0 else levels


def _video(path: Path) -> Recording:
    """Frames of a video."""
    try:
        reader = imageio_ffmpeg.read_frames(str(path), pix_fmt="gray", bits_per_pixel=8)
        width, height = next(reader)["size"]
        frames = [np.frombuffer(frame, np.uint8).reshape(height, width) for frame in reader]
    except (OSError, RuntimeError, StopIteration, ValueError):
        frames = []
    if not frames:
        raise EchoError(f"{path}: is no video that can be read")
    return Recording(np.stack(frames))


def _nifti(path: Path) -> Recording:
    """Frames of (lateral, axial, 1, frame) or (lateral, axial, frame), with their scale."""
    nibabel = optional("nibabel", "clinical", EchoError, f"{path}: ")
    with reading(path, "no NIfTI file that can be read"):
        image = nibabel.load(path)
        pixels = np.asarray(image.dataobj)
        sizes, units = [float(size) for size in image.header.get_zooms()], image.header.get_xyzt_units()
    if pixels.ndim == 4 and pixels.shape[2] == 1:
        pixels, sizes = pixels[:, :, 0], [*sizes[:2], *sizes[3:]]
    if pixels.ndim != 3:
        raise EchoError(f"{path}: has the shape {pixels.shape}: give (lateral, axial, frame), or with 1 before frame")
    length = {"mm": 1e-3, "micron": 1e-6, "meter": 1.0}.get(units[0], 1e-3)
    second = {"sec": 1.0, "msec": 1e-3, "usec": 1e-6}.get(units[1])
    times = np.arange(pixels.shape[2], dtype=float) * sizes[2] * second if second and sizes[2] > 0 else np.empty(0)
    return Recording(grey(pixels.transpose(2, 1, 0), str(path)), (sizes[1] * length, sizes[0] * length), times)


def _array(path: Path) -> Recording:
    """Frames of a NumPy file, (frame, axial, lateral)."""
    return of_array(_loaded(path), str(path))


def _loaded(path: Path) -> NDArray[Any]:
    """Array of a NumPy file, which is not read before its header is known to promise no more than the file holds."""
    with reading(path, "no array that numpy.load reads"):
        return np.lib.format.open_memmap(path, mode="r")  # parses the header as Python, and raises whatever that does


def of_image(path: Path) -> NDArray[np.bool_]:
    """Pixels of an image or a NumPy file that are not 0, (axial, lateral).

    Raises
    ------
    EchoError
        If it holds no image.
    """
    pixels = _loaded(path) if path.suffix.lower() == ".npy" else _pages(path)[0]
    if pixels.ndim != 2 or pixels.dtype.kind not in "uifb":
        raise EchoError(f"{path}: has the shape {pixels.shape} of {pixels.dtype}: give one image (axial, lateral)")
    return np.asarray(pixels != 0)


def of_array(pixels: object, name: str = "array") -> Recording:
    """Recording of an array (frame, axial, lateral), or with colours last.

    Raises
    ------
    EchoError
        If it has another shape, or values that are not finite.
    """
    return Recording(grey(np.asarray(pixels), name))


READERS: dict[str, Callable[[Path], Recording]] = {
    **dict.fromkeys((".dcm", ".dicom", ""), dicom.read),
    **dict.fromkeys((".mp4", ".avi", ".mov", ".mkv"), _video),
    **dict.fromkeys((".gif", ".tif", ".tiff"), _animation),
    **dict.fromkeys((".nii", ".nii.gz"), _nifti),
    ".npy": _array,
    ".zarr": echoxflow.read,
}
"""Ending of a name -> function that reads such a file."""
