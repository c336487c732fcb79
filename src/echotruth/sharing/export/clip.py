"""One clip of a repository, of which each part is read when it is used."""

import json
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.view import Plane
from echotruth.notebook.point_tracks import point_tracks
from echotruth.repository.reader import Repository
from echotruth.units import mm


@dataclass(frozen=True)
class ExportedClip:
    """A heart, one of its views, or one of its clips.

    Attributes
    ----------
    repository : Repository
    case : Case
    view : str
        Name of the view; "" for the heart itself.
    size : int
        Pixels along a side, of volumes the most voxels along one; 0 for the heart or the view itself.
    """

    repository: Repository
    case: Case
    view: str = ""
    size: int = 0

    @property
    def name(self) -> str:
        """CASE_VIEW_SIZE, or the part of it that there is."""
        return "_".join(str(part) for part in (self.case.id, self.view, self.size) if part)

    @cached_property
    def image(self) -> NDArray[np.uint8]:
        """Grey levels, (frame, axial, lateral), or (frame, axial, elevation, lateral)."""
        name = "volume" if self.case.config.has_volumes else self.size
        return self.repository.arrays(f"bmode/{name}", self.case.id, self.view, "image")["image"]

    def truth(self, *variables: str) -> xr.Dataset:
        """Some variables of the clip, or all, as :meth:`echotruth.Repository.clip` returns them."""
        return self.repository.clip(self.case.id, self.view, self.size, variables or None)

    @cached_property
    def heart(self) -> Heart:
        """The heart."""
        return self.repository.heart(self.case.id)

    @cached_property
    def plane(self) -> Plane:
        """The imaging plane in the heart frame."""
        return self.repository.plane(self.case.id, self.view)

    @cached_property
    def time(self) -> Floats:
        """Time since end-diastole of the frames, (frame,), s."""
        return self.repository.read("mechanics/time", self.case.id)

    @property
    def frame_time(self) -> float:
        """Time from one frame to the next, s; all steps are equal."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    @property
    def spacing(self) -> float:
        """Distance of pixel centres, m, the same in both directions."""
        return float(self.case.config.bmode.field_of_view_mm * mm) / self.size

    @property
    def sides(self) -> Floats:
        """Sides of a pixel, which is as thick as wide, or of a voxel, (3,), m: lateral, axial, elevation."""
        config = self.case.config
        if config.has_volumes:
            return np.array(config.volume.voxel_mm)[[2, 0, 1]] * mm
        return np.full(3, self.spacing)

    @property
    def corner(self) -> Floats:
        """Centre of the first pixel or voxel before the array, (3,), m: lateral, axial, elevation."""
        if self.case.config.has_volumes:
            axial, elevation, lateral = (along[0] for along in voxel_centres(self.case.config))
            return np.array([lateral, axial, elevation])
        return np.array([self.lateral[0], self.axial[0], 0.0])

    @property
    def axial(self) -> Floats:
        """Depth of the pixel centres below the array, (size,), m."""
        return pixel_centres(self.case.config.bmode, self.size)[0]

    @property
    def lateral(self) -> Floats:
        """Lateral coordinate of the pixel centres, (size,), m."""
        return pixel_centres(self.case.config.bmode, self.size)[1]

    def tracks(self, step: int) -> xr.Dataset:
        """Points of the tissue, at the centres of every so many pixels of the wall at end-diastole, and their paths.

        The paths are exact, by the mesh: `pixel` (frame, point, plane), px, `elevation` (frame, point), m, and
        `visible` (frame, point), as :func:`echotruth.point_tracks` returns them.
        """
        along = np.arange(step // 2, self.size, step)
        pixels = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
        found = point_tracks(self.heart, self.truth("image"), pixels)
        return found.isel(point=found["elevation"].isel(frame=0).notnull().values)

    @property
    def note(self) -> str:
        """Scale, orientation and frame time as JSON, for the comment of a file whose format has no place for them."""
        about = {"case": self.case.id, "view": self.view, "spacing_m": self.spacing, "frame_time_s": self.frame_time}
        first = {"first_pixel_lateral_m": float(self.lateral[0]), "first_pixel_axial_m": float(self.axial[0])}
        return json.dumps(about | first | {"synthetic": True, "source": "echotruth"})
