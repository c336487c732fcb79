"""The least error with which the motion between two images of speckle can be estimated, from the images themselves.

Two random images of which one is the other moved have, at every spatial frequency k, a coherence gamma(k): 1 where they
are the same, 0 where nothing is left of the pattern, because scatterers have left the slice, because speckle does not
move as its tissue does, or because of noise or coarse pixels. If both are Gaussian and stationary, no unbiased
estimator of a displacement that is the same over an area A has a covariance below the inverse of its Fisher information

    J = A integral (2 pi k) (2 pi k)^T gamma^2 / (1 - gamma^2) dk

(Knapp and Carter 1976, doi 10.1109/TASSP.1976.1162830, in two dimensions). For a coherence that is the same, rho, over
the whole band it is proportional to 1 / rho^2 - 1, the bound of Walker and Trahey (1995, doi 10.1109/58.365243) for
echoes that are partially correlated.

A displacement that varies over the wall is taken for a field that is linear in p parameters for each component. With a
density of information that is the same everywhere, the mean of its variance over the wall is then that of a
displacement that is the same over a p-th part of the wall: for basis functions B with a normal matrix N, the mean of
B^T N^-1 B is tr(N^-1 integral B B^T) / area = p / area. A smooth field and windows of the same area per parameter have
the same bound.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft, ndimage

from echotruth.arrays import Floats

LAGS = (1, 2, 4)
"""Visits between images that are compared; a tracker may keep an older image as its template."""
_TAPER = 1 / 60
"""Distance from the edge of the wall over which images fade in, in sides of the image, so that the sharp edge itself is
not taken for speckle: 0.2 mm in a mouse."""
_LAG_SD = 1 / 50
"""Standard deviation of the Gaussian by which correlations are weighted over their lag, in sides of the image: 0.24 mm
in a mouse, several speckles. It smooths spectra, which makes the bound up to a tenth too low: on simulated patterns
with speckle as wide as that of the default mouse, laterally by 7 to 11 % and axially by 2 to 6 %."""
_LAG_RANGE = 4.5
"""Largest lag, in its standard deviations."""
_MAX_COHERENCE = 1 - 1e-6
"""Squared coherence of images that are the same but for rounding."""


@dataclass(frozen=True)
class AlignedImages:
    """Images of the wall in which the tissue stands still, because its motion was undone.

    Attributes
    ----------
    values : ndarray of shape (image, axial, lateral)
        Grey values or amplitudes at the place of each pixel of end-diastole; NaN where unknown.
    spacing : float, m
        Distance of pixel centres.
    side : float, m
        Side of the field of view, by which lengths are scaled.
    """

    values: Floats
    spacing: float
    side: float

    @cached_property
    def inside(self) -> np.ndarray:
        """Pixels with a value in all images, (axial, lateral), bool."""
        return np.asarray(np.isfinite(self.values).all(axis=0))

    @property
    def area(self) -> float:
        """Area of these pixels, m^2."""
        return float(self.inside.sum()) * self.spacing**2

    def correlation(self, first: int, second: int) -> float:
        """Pearson correlation of two images over the pixels that both know; NaN where either is even."""
        pair = self.values[[first, second]]
        pair = pair[:, np.asarray(np.isfinite(pair).all(axis=0))]
        if pair.shape[1] < 2 or not (np.ptp(pair, axis=1) > 0).all():
            return np.nan
        return float(np.asarray(np.corrcoef(pair))[0, 1])

    def information(self, first: int, second: int) -> Floats:
        """Fisher information on a displacement from one image to another, for each unit of area.

        Parameters
        ----------
        first, second : int
            Indices of the images.

        Returns
        -------
        ndarray of shape (2, 2), m^-4
            Of the lateral and the axial displacement.
        """
        cross = self._spectrum(first, second)
        power = self._power[first] * self._power[second]
        coherence = np.divide(cross**2, power, out=np.zeros_like(power), where=power > 0)
        # A real part of pure noise has the mean square 1 / (2 n); values below 0 stay, so that their mean is right.
        bias = 1 / (2 * self._averages)
        coherence = np.minimum((coherence - bias) / (1 - bias), _MAX_COHERENCE)
        wavenumber = self._wavenumber.reshape(2, -1)
        information: Floats = (wavenumber * (coherence / (1 - coherence)).ravel()) @ wavenumber.T
        return information / (coherence.size * self.spacing**2)

    def variance(self, first: int, second: int, parameters: int) -> Floats:
        """Least covariance of a displacement from one image to another, mean over the wall.

        Parameters
        ----------
        first, second : int
            Indices of the images.
        parameters : int
            Parameters for each component of the field that is estimated.

        Returns
        -------
        ndarray of shape (2, 2), m^2
            Lateral, axial; infinite where the images hold no information.
        """
        information = self.information(first, second) * self.area
        # Without information, as in images without speckle, it is not definite.
        if not np.linalg.eigvalsh(information)[0] > 0:
            return np.full((2, 2), np.inf)
        variance: Floats = parameters * np.linalg.inv(information).astype(float)
        return variance

    def path_variance(self, parameters: int) -> Floats:
        """Least covariance of the displacement since the first image, along the best chain of comparisons.

        The errors of comparisons are taken for independent. A chain has steps of :data:`LAGS` images; speckle that
        fades is best followed from image to image, and noise is best met by a template that is kept.

        Parameters
        ----------
        parameters : int
            Parameters for each component of the field that is estimated.

        Returns
        -------
        ndarray of shape (image, 2, 2), m^2
            0 in the first image.
        """
        found = [np.zeros((2, 2))]
        for image in range(1, len(self.values)):
            before = [image - lag for lag in LAGS if lag <= image]
            chains = [found[start] + self.variance(start, image, parameters) for start in before]
            found.append(min(chains, key=np.trace))
        return np.stack(found)

    @cached_property
    def _weight(self) -> Floats:
        """Weight of the pixels, (axial, lateral): 0 where a value is unknown, 1 some way from there."""
        distance = ndimage.distance_transform_edt(np.pad(self.inside, 1))[1:-1, 1:-1] * self.spacing
        weight: Floats = np.sin(np.pi / 2 * np.minimum(distance / (_TAPER * self.side), 1)) ** 2
        return weight

    @property
    def _largest_lag(self) -> int:
        """Largest lag at which correlations are used, px."""
        return max(2, int(np.ceil(_LAG_RANGE * _LAG_SD * self.side / self.spacing)))

    @cached_property
    def _shape(self) -> tuple[int, int]:
        """Shape of the transforms; the margin is as wide as the largest lag, so that the other side is not reached."""
        lag = self._largest_lag
        rows, columns = (fft.next_fast_len(max(length, lag + 1) + lag, real=True) for length in self._weight.shape)
        return rows, columns

    @cached_property
    def _transforms(self) -> list[np.ndarray]:
        """Fourier transforms of the weighted images, without their weighted mean."""
        weight, known = self._weight, np.where(self.inside, self.values, 0)
        total = weight.sum() or 1.0
        return [fft.rfft2((values - (values * weight).sum() / total) * weight, self._shape) for values in known]

    @cached_property
    def _averages(self) -> float:
        """Number of independent values of which one of a smoothed spectrum is the mean.

        It is the area of the wall times the bandwidth of the Gaussian, 1 / integral g^2 of its transform g.
        """
        fourth = (self._weight**4).sum() or 1.0
        area = (self._weight**2).sum() ** 2 / fourth * self.spacing**2
        return float(max(area / (np.pi * (_LAG_SD * self.side) ** 2), 1.0))

    @cached_property
    def _lag_weight(self) -> Floats:
        """Gaussian weight of the correlations over their lag, px, from minus to plus the largest."""
        lag = np.arange(-self._largest_lag, self._largest_lag + 1) * self.spacing
        weight = np.exp(-(lag**2) / (2 * (_LAG_SD * self.side) ** 2))
        return np.multiply.outer(weight, weight)

    @cached_property
    def _wavenumber(self) -> Floats:
        """2 pi k of the smoothed spectra: lateral, axial, (2, axial, lateral), rad/m."""
        k = 2 * np.pi * fft.fftfreq(len(self._lag_weight), self.spacing)
        return np.stack(np.meshgrid(k, k))

    @cached_property
    def _power(self) -> list[Floats]:
        """Smoothed power spectrum of every image."""
        return [self._spectrum(image, image) for image in range(len(self.values))]

    def _spectrum(self, first: int, second: int) -> Floats:
        """Real part of the smoothed cross spectrum of two images, (axial, lateral).

        It is the Fourier transform of the even part of their correlation, weighted over the lag (Blackman and Tukey
        1958, doi 10.1002/j.1538-7305.1958.tb03874.x). The motion is undone, so that what they share is in phase.
        """
        correlation = fft.irfft2(self._transforms[first] * self._transforms[second].conj(), self._shape)
        lag = np.arange(-self._largest_lag, self._largest_lag + 1)
        near = correlation[np.ix_(lag % self._shape[0], lag % self._shape[1])] * self._lag_weight
        spectrum: Floats = fft.fft2(fft.ifftshift(near)).real
        return spectrum
