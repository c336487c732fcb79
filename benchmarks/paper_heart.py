"""A heart of a repository as the paper describes its own: strains, spread of displacement, errors of the trackers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.optimize import brentq

import echotruth as et
from echotruth.evaluation.displacement_error import transmural_gradient
from echotruth.evaluation.polar import resolve
from echotruth.fem.volume import cell_volumes
from echotruth.imaging.truth import cavity_centroid
from echotruth.repository import estimates, schema
from echotruth.units import mm

if TYPE_CHECKING:
    import echotruth.heart

SLICES = ("base", "mid", "apex")
SCORES = ("rms_error", "nrmse", "true_segment_displacement", "tracked_segment_displacement")
UL, UM = 1e-9, 1e-6
"""m^3, m."""


def least_strain(first: ArrayLike, second: ArrayLike) -> np.ndarray:
    """Smallest mean of the third normal strain that an incompressible wall can have, of any orthogonal axes.

    det C = 1 at every point, and det C is at most the product of the diagonal of C = 2 E + I (Hadamard's inequality),
    so that the logarithms of 1 + 2 E_RR, 1 + 2 E_CC and 1 + 2 E_LL add up to 0 at least. The logarithm of a mean is at
    least the mean of the logarithms (Jensen's inequality), so the same holds for means over the wall, whatever the
    shear.

    Parameters
    ----------
    first, second : array_like
        Means of two normal Green-Lagrange strains.
    """
    return (1 / ((1 + 2 * np.asarray(first)) * (1 + 2 * np.asarray(second))) - 1) / 2


def tube_strain(edv: float, ejection_fraction: float, wall: float, longitudinal: float) -> tuple[float, float]:
    """Mean E_RR and E_CC of an incompressible tube that ejects by getting narrower and shorter, without torsion.

    With the inner radius A, a point at radius R goes to r with r^2 - a^2 = (R^2 - A^2) / l at the axial stretch l; its
    stretches are r / R around the axis, l along it, and R / (r l) through the wall.

    Parameters
    ----------
    edv, wall : float
        Volumes of cavity and wall at end-diastole, in one unit.
    ejection_fraction, longitudinal : float
        Fraction of the volume, and E_LL.
    """
    axial = np.sqrt(1 + 2 * longitudinal)
    # Radii squared over that of the cavity: the volume of a shell is uniform in them.
    before = 1 + (np.arange(2000) + 0.5) / 2000 * wall / edv
    after = (1 - ejection_fraction) / axial + (before - 1) / axial
    around = after / before
    return float(np.mean((1 / (around * axial**2) - 1) / 2)), float(np.mean((around - 1) / 2))


def tube_ejection_fraction(edv: float, wall: float, longitudinal: float, component: int, mean: float) -> float:
    """Ejection fraction at which :func:`tube_strain` has a mean; component 0 is E_RR, 1 is E_CC."""
    return float(brentq(lambda fraction: tube_strain(edv, fraction, wall, longitudinal)[component] - mean, 0.01, 0.95))


@dataclass(frozen=True)
class Heart:
    """First heart of a repository, in short-axis views.

    Attributes
    ----------
    repository : Path
        Its folder.
    """

    repository: Path

    @cached_property
    def read(self) -> et.Repository:
        """The repository, to be read."""
        return et.Repository(self.repository)

    def group(self, path: str, view: str | None = None) -> xr.Dataset:
        """A group of this heart, or of its clip in a view."""
        return self.read.tree[self.read.path(path, self.case, view)].to_dataset()

    @property
    def case(self) -> str:
        """Case id."""
        return self.read.present[0]

    @cached_property
    def es(self) -> int:
        """Frame of end-systole."""
        return int(self.read.read("mechanics/es_frame", self.case))

    @property
    def sizes(self) -> list[int]:
        """Image sizes, px, the largest first."""
        return self.read.sizes

    @property
    def trackers(self) -> list[str]:
        """Names of the trackers."""
        return list(self.read.config.tracking.trackers)

    @cached_property
    def field_of_view(self) -> float:
        """Side of the images, m."""
        return self.read.config.bmode.field_of_view_mm * mm

    @cached_property
    def mesh(self) -> echotruth.heart.Heart:
        """Mesh and motion."""
        return self.read.heart(self.case)

    @cached_property
    def volumes(self) -> dict[str, float]:
        """Volumes of the cavity at end-diastole and end-systole, and of the wall at end-diastole, uL."""
        cavity = self.read.read("mechanics/volume", self.case) / UL
        wall = float(np.sum(cell_volumes(self.mesh.positions(0), self.mesh.cells))) / UL
        return {"edv": float(cavity[0]), "esv": float(cavity[self.es]), "wall": wall}

    @cached_property
    def ejection_fraction(self) -> float:
        """Fraction of the end-diastolic volume."""
        return 1 - self.volumes["esv"] / self.volumes["edv"]

    def strain(self, component: str) -> tuple[float, float]:
        """Mean and standard deviation over the wall of a strain since end-diastole, at end-systole."""
        found = self.group("kinematics").isel(frame=self.es).sel(strain_component=component)
        return float(found.strain_mean), float(found.strain_sd)

    def layer_strain(self, component: str) -> np.ndarray:
        """Means of a strain over the layers, the endocardium first, (layer,)."""
        return self.group("kinematics").layer_strain.isel(frame=self.es).sel(strain_component=component).values

    @cached_property
    def twist(self) -> float:
        """Twist at end-systole, deg, counter-clockwise seen from the apex."""
        return self.measured("twist_es")

    def measured(self, name: str) -> float:
        """A measure that is an angle, deg."""
        return float(np.degrees(self.read.read(f"physiology/{name}", self.case)))

    def scores(self, view: str, tracker: str, size: int) -> xr.Dataset:
        """Scores of one clip that are compared with those of the paper."""
        found = estimates.tracked(self.read, self.case, view, tracker, size, *SCORES)
        arrays = {name: (schema.SCORES[name].dims, values) for name, values in found.items()}
        return xr.Dataset(arrays, {name: list(schema.LABELS[name]) for name in ("component", "polar")})

    def circumferential(
        self, view: str, size: int, tracker: str | None = None, centred: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Circumferential displacement at end-systole at the points of a view, m, and their layers.

        Parameters
        ----------
        view : str
        size : int
            Image size, px.
        tracker : str, optional
            Default: the finite elements.
        centred : bool
            Subtract the mean displacement of the slice.
        """
        vector, position, layer = self._displacement(view, size, tracker)
        vector = vector - vector.mean(0) if centred else vector
        centre = cavity_centroid(self.mesh, self.read.plane(self.case, view))
        return resolve(vector, position, centre, "short_axis")[:, 1], layer

    def mean_motion(self, view: str) -> float:
        """Length of the mean displacement of a slice in its plane, m."""
        return float(np.linalg.norm(self._displacement(view, self.sizes[0], None)[0].mean(0)))

    def largest_displacement(self, view: str) -> float:
        """Largest displacement in the plane at end-systole, px of the largest images."""
        vector = self._displacement(view, self.sizes[0], None)[0]
        return float(np.linalg.norm(vector, axis=1).max()) / self.field_of_view * self.sizes[0]

    def tracked_anew(self, view: str, size: int, method: str, options: Mapping[str, object]) -> float:
        """Error of circumferential displacement over its RMS, %, of a tracker that is not in the repository."""
        clip = self.read.clip(self.case, view, size)
        found = et.evaluate(et.track(clip, method, **options), self.mesh)
        return float(found["tangential_nrmse_percent"])

    def _displacement(self, view: str, size: int, tracker: str | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement at end-systole and position (point, 2), m, and layer of the points of a view."""
        read = self.read.tracks(self.case, view, size, [tracker or self.trackers[0]])
        found = read.isel(frame=self.es, tracker=0)
        true = found.true_displacement.sel(vector=list(found["plane"].values)).transpose("axial", "lateral", "vector")
        vector = (true if tracker is None else found.displacement.transpose("axial", "lateral", "plane")).values
        lateral, axial = np.meshgrid(found.lateral.values, found.axial.values)
        layer = found.layer.values
        inside = np.isfinite(vector).all(-1) & (layer > 0)
        return vector[inside], np.column_stack([lateral[inside], axial[inside]]), layer[inside]

    def fall(self, views: tuple[str, ...], tracker: str | None = None, centred: bool = False) -> float:
        """Fall of the spread of circumferential displacement from the innermost to the outermost layer, %.

        The spread is the standard deviation over the points of a layer in some views together, in the largest images.
        """
        pairs = [self.circumferential(view, self.sizes[0], tracker, centred) for view in views]
        value, layer = (np.concatenate(arrays) for arrays in zip(*pairs, strict=True))
        endo, epi = (np.std(value[layer == k]) for k in (1, layer.max()))
        return float(transmural_gradient(endo, epi))

    def normalised(self, view: str, tracker: str, size: int) -> dict[str, float]:
        """RMS error of circumferential displacement, um, and in % by four normalisers, and the error of the vector.

        The normalisers, of the finite elements in the same view: RMS circumferential displacement, the same without the
        mean motion of the slice, the largest, and the RMS of the whole displacement in the plane.
        """
        scores = self.scores(view, tracker, size).isel(region=0)
        error = float(scores.rms_error.sel(component="tangential"))
        true, centred = (self.circumferential(view, size, None, each)[0] for each in (False, True))
        vector = float(scores.rms_error.sel(component="total") / scores.nrmse.sel(component="total"))
        return {
            "um": error / UM,
            "circumferential": 100 * float(scores.nrmse.sel(component="tangential")),
            "centred": 100 * error / float(np.sqrt(np.mean(centred**2))),
            "largest": 100 * error / float(np.abs(true).max()),
            "vector": 100 * error / vector,
            "whole": 100 * float(scores.nrmse.sel(component="total")),
        }

    def layer_errors(self, view: str, tracker: str, size: int) -> np.ndarray:
        """RMS error of circumferential displacement by layer, m, the endocardium first, (layer,)."""
        return self.scores(view, tracker, size).rms_error.sel(component="tangential").values[1:]

    def segments(self, tracker: str) -> tuple[np.ndarray, np.ndarray]:
        """True and tracked circumferential displacement of the AHA segments in the largest images, m, (17,) each."""
        # A segment at a boundary may be visible in two planes; their mean is shown.
        names = ["true_segment_displacement", "tracked_segment_displacement"]
        scores = [self.scores(view, tracker, self.sizes[0])[names] for view in SLICES]
        mean = xr.concat(scores, "view").mean("view").sel(polar="tangential")
        return mean[names[0]].values, mean[names[1]].values
