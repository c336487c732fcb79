"""Beams and scans of the cases, read only where cases differ in them."""

from functools import cached_property

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.flow import slice_thickness
from echotruth.repository.reader import Repository

BEAM = ("probe.", "rf.", "bmode.", "phantom.in_plane_only")
"""Keys on which it depends what a pixel shows: field of view, scan, and thickness of the slice."""
_RANGES = 1024
"""Ranges at which the thickness is kept."""


class Beams:
    """Configurations of the cases of a repository, as far as their beams and scans go.

    Parameters
    ----------
    repository : Repository
    """

    def __init__(self, repository: Repository) -> None:
        self._repository = repository
        self._configs: dict[str, Config] = {}
        self._tables: dict[str, tuple[Floats, Floats]] = {}

    def config(self, case: str) -> Config:
        """Configuration of a case; that of the repository if no case differs from it in its beam."""
        key = self.key(case)
        if key not in self._configs:
            self._configs[key] = self._repository.case(case).config if key else self._repository.config
        return self._configs[key]

    def range_(self, case: str, lateral: Floats, axial: Floats) -> Floats:
        """Range of points of the image along the lines of the scan, m: in a sector from the centre of the array."""
        config = self.config(case)
        return scan_lines(config.probe, config.rf).to_scan_coordinates(lateral, axial)[1]

    def thickness(self, case: str, range_: Floats) -> Floats:
        """Thickness of the slice at ranges within the image, m, of any shape; it is computed once."""
        key, config = self.key(case), self.config(case)
        if key not in self._tables:
            ranges = np.linspace(0, np.sqrt(2) * config.bmode.si().field_of_view, _RANGES)
            self._tables[key] = ranges, slice_thickness(config, ranges)
        return np.interp(range_, *self._tables[key])

    def key(self, case: str) -> str:
        """The same for all cases with the same beam; "" if no case differs from the repository in it."""
        return case if self.differ else ""

    @cached_property
    def differ(self) -> bool:
        """Whether the beams of some cases are not those of others."""
        return any(name.startswith(BEAM) for name in self._repository.names("cases"))
