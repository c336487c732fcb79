"""Export of a repository to files that other programs read (docs/export.md): one module a format.

Its function `write` takes a clip, view or heart, the path of its file or folder, and the options of the format:
`overlay` (what is drawn over the images), `rate` (frames per second) and `trackers` (their names).
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Literal

from echotruth.config import shipped
from echotruth.repository.choice import chosen
from echotruth.repository.reader import Repository
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.destination import draft
from echotruth.sharing.export.error import ExportError

FRAME_RATE = 20.0
"""Frames per second of a video, slow motion for a mouse."""


@dataclass(frozen=True)
class Format:
    """A format.

    Attributes
    ----------
    module : str
        Module of this package with its function `write`.
    suffix : str
        Suffix of its files, of which a .zarr is a folder; "" for folders without suffix.
    stages : tuple of str
        Stages of which it needs the arrays, besides the heart.
    holds : {"clip", "view", "heart"}
        What a file is of.
    options : tuple of {"overlay", "rate", "trackers"}
        What options it takes, beside which cases, views and sizes to write.
    of : {"slices", "volumes"}
        What it can hold; of a heart it holds no images.
    table : str
        Name of one more file, of all clips, that its module writes with `write_summary`; "" for none.
    """

    module: str
    suffix: str
    stages: tuple[str, ...] = ("truth", "bmode")
    holds: Literal["clip", "view", "heart"] = "clip"
    options: tuple[str, ...] = ()
    of: tuple[str, ...] = ("slices",)
    table: str = ""

    def takes(self, option: str) -> bool:
        """Whether an option, or a choice of views or sizes, does something for it."""
        return option in (*self.options, *{"clip": ("views", "sizes"), "view": ("views",), "heart": ()}[self.holds])

    def problem(self, clip: ExportedClip) -> str:
        """Why a clip, view or heart cannot be exported, in one sentence; "" if it can."""
        return clip.repository.problem(clip.case.id, clip.view, "mechanics", *self.stages)

    @property
    def writer(self) -> ModuleType:
        """The module with its functions, which may need packages that others do not."""
        return import_module(f"echotruth.sharing.export.{self.module}")


BOTH = ("slices", "volumes")
FORMATS = {
    "mp4": Format("mp4", ".mp4", options=("overlay", "rate")),
    "gif": Format("gif", ".gif", options=("overlay", "rate")),
    "png": Format("png", "", options=("overlay",)),
    "nifti": Format("nifti", ".nii.gz", of=BOTH),
    "dicom": Format("dicom", ".dcm"),
    "vtk": Format("vtk", "", (), "heart", of=BOTH),
    "vti": Format("vti", "", of=("volumes",)),
    "csv": Format("curves", ".csv", ("points",), options=("trackers",), table="summary.csv"),
    "tap": Format("tap", ".npz", of=BOTH),
    "uff": Format("uff", ".uff", ("rf",), "view"),
    "zea": Format("zea", ".hdf5", ("rf",), "view"),
    "echoxflow": Format("echoxflow", ".zarr", ("rf",), "view", table="croissant.json"),
}
"""What can be written, by the name of the format."""

OVERLAYS = ("wall", "segments", "tissue", "displacement")
"""What can be drawn over the images."""


@dataclass(frozen=True)
class Export:
    """What is to be written, and where to.

    Attributes
    ----------
    repository : Repository
    format : str
        One of :data:`FORMATS`.
    cases, views, trackers : sequence of str
        Their names; all if empty.
    sizes : sequence of int
        Pixels along a side; the largest if empty.
    overlay : sequence of {"wall", "segments", "tissue", "displacement"}
        What to draw over the images of mp4, gif and png.
    rate : float
        Frames per second of mp4 and gif.
    output : Path, optional
        Folder; for a single file also its path. Default: `export/FORMAT` in the folder of the repository, for that
        which comes with the package in `out/sample`.
    """

    repository: Repository
    format: str
    cases: Sequence[str] = ()
    views: Sequence[str] = ()
    sizes: Sequence[int] = ()
    trackers: Sequence[str] = ()
    overlay: Sequence[str] = ()
    rate: float | None = None
    output: Path | None = None

    def __post_init__(self) -> None:
        has, name = "volumes" if self.repository.config.has_volumes else "slices", self.repository.config.name
        if has not in FORMATS[self.format].of:
            able = ", ".join(key for key, form in FORMATS.items() if has in form.of)
            raise ExportError(f"--format {self.format}: {name} has {has}, for which there are {able}")
        for name in ("overlay", "rate", "views", "sizes", "trackers"):
            if getattr(self, name) and not FORMATS[self.format].takes(name):
                able = ", ".join(key for key, form in FORMATS.items() if form.takes(name))
                raise ExportError(f"--{name.removesuffix('s')} does nothing for {self.format}: it is for {able}")
        if self.repository.is_sample and "rf" in FORMATS[self.format].stages:
            remedy = "echotruth run sample makes it in out/sample (rf.keep in a configuration keeps channels too)"
            raise ExportError(f"{shipped.SAMPLE}: comes without RF, which {self.format} needs: {remedy}")
        if self.rate is not None and not 0.1 <= self.rate <= 1000:
            raise ExportError(f"--rate {self.rate:g}: give 0.1 to 1000 frames per second")
        if unknown := [name for name in self.overlay if name not in OVERLAYS]:
            raise ExportError(f"--overlay {unknown[0]}: use {', '.join(OVERLAYS)}")

    @property
    def _trackers(self) -> list[str]:
        """Names of the chosen trackers; all of the repository's own if none is named."""
        own = list(self.repository.config.tracking.trackers)
        return chosen("tracker", self.trackers, self.repository.trackers if self.trackers else own)

    def clips(self) -> tuple[list[ExportedClip], list[str]]:
        """What is to be written, and why other things are left out.

        Raises
        ------
        ValueError
            If there is no such thing, none is finished, or one is not whose case was named.
        """
        found, problems = [], []
        for clip in self._asked(FORMATS[self.format].holds):
            if reason := FORMATS[self.format].problem(clip):
                problems.append(reason)
            else:
                found.append(clip)
        if problems and (self.cases or not found):
            raise ExportError(problems[0])
        return found, problems

    def _asked(self, holds: str) -> Iterator[ExportedClip]:
        """The clips, views or hearts that are asked for."""
        cases, views = self.repository.every, self.repository.views
        sizes = self.sizes or self.repository.sizes[:1]
        for case in chosen("case", self.cases, cases):
            for view in [""] if holds == "heart" else chosen("view", self.views, views):
                for size in chosen("size", sizes, self.repository.sizes) if holds == "clip" else [0]:
                    yield ExportedClip(self.repository, cases[case], view, size)

    def write(self, clips: Sequence[ExportedClip]) -> Iterator[Path]:
        """Write a file or folder for each clip, view or heart, and give its path when it is whole.

        The table of a format is written last, unless `output` is the path of a single file.

        Raises
        ------
        ExportError
            If an optional package is missing, or a clip cannot be read.
        OSError
            If a file cannot be written.
        """
        form = FORMATS[self.format]
        options = {"overlay": self.overlay, "rate": self.rate or FRAME_RATE, "trackers": self._trackers}
        for clip, target in zip(clips, self._targets(clips), strict=True):
            with draft(target) as path, _told(clip):
                # A copy, with which goes what was read.
                form.writer.write(replace(clip), path, **{name: options[name] for name in form.options})
            yield target
        if form.table and clips and not self._is_file:
            with draft(self._output / form.table) as path, _told(clips[0]):
                form.writer.write_summary(clips, path, self._trackers)

    @property
    def _output(self) -> Path:
        """Folder of the files, or path of a single file."""
        home = Path("out") / shipped.SAMPLE if self.repository.is_sample else self.repository.folder
        return self.output or home / "export" / self.format

    @property
    def _is_file(self) -> bool:
        """Whether `output` is the path of a single file."""
        suffix = FORMATS[self.format].suffix
        is_folder = self._output.is_dir() and suffix != ".zarr"
        return bool(suffix) and self._output.name.endswith(suffix) and not is_folder

    def _targets(self, clips: Sequence[ExportedClip]) -> list[Path]:
        if self._is_file:
            if len(clips) > 1:
                remedy = "give a folder, or choose one with --case, --view and --size"
                raise ExportError(f"{self.output} is one file, but there are {len(clips)} to write: {remedy}")
            return [self._output]
        return [self._output / f"{clip.name}{FORMATS[self.format].suffix}" for clip in clips]


@contextmanager
def _told(clip: ExportedClip) -> Iterator[None]:
    """Tell in a sentence that a clip cannot be read."""
    try:
        yield
    except ExportError:
        raise
    except (ValueError, KeyError, RuntimeError, FileNotFoundError) as error:
        said = " ".join(str(error).split())
        remedy = f"see what echotruth check {clip.repository.folder} says"
        raise ExportError(f"{clip.repository.folder} cannot be read at {clip.name}: {remedy} ({said})") from error


__all__ = ["FORMATS", "OVERLAYS", "Export", "ExportError"]
