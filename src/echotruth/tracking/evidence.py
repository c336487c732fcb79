"""Weight of the bending energy of a step that the images give most evidence for.

The step d from one frame to the next is fitted by least squares with the bending energy as prior, v / beta per unknown
of the energy: the images determine gamma of the unknowns (the effective number of parameters), the prior the rest. The
evidence is greatest where the energy of the fitted step is what the prior expects of these gamma,
beta = v gamma / (d^T K d) (MacKay 1992, Neural Comput 4:415, doi 10.1162/neco.1992.4.3.415, his alpha =
gamma / 2 E_W). A step that is uneven beyond the noise so gets a small weight, and an even one a large weight.

Where gamma is small, that rule runs away: a smoother step has less energy, which asks for more smoothness. So the
weight has a gamma distribution as its own prior, worth `PRIOR_UNKNOWNS` more unknowns, whose energy is `UNEVENNESS`
times the squared displacement of the step.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

NOISE_AREA = 0.11
"""Area over which residuals count once, over the correlation area of the speckle. Residuals of neighbouring pixels are
correlated; what is left of them after a fit is more so than the noise is, thus less than 1."""
PRIOR_UNKNOWNS = 60.0
"""Unknowns that the prior of the weight counts for."""
UNEVENNESS = 1e-4
"""Energy per unknown that this prior expects, over the mean square of the displacement less its mean."""
AFFINE_UNKNOWNS = 6
"""Unknowns without energy: the affine fields."""
PROBES = 6
"""Random vectors by which a trace is estimated."""


@dataclass(frozen=True)
class Match:
    """Pixels of an image warped onto a template.

    Attributes
    ----------
    template : ndarray of shape (pixel,)
        Grey values T.
    residual : ndarray of shape (pixel,)
        Grey values of the image less T.
    gradient : ndarray of shape (pixel, 2)
        Lateral and axial derivative of the image, per px.
    weight : ndarray of shape (pixel,)
        Robust weights of the pixels.
    """

    template: np.ndarray
    residual: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray

    @property
    def noise(self) -> float:
        """Weighted mean square of the residuals."""
        return float(np.sum(self.weight * self.residual**2) / np.sum(self.weight))

    def relative_noise(self, knot_spacing: float) -> float:
        """(noise power / speckle power) (speckle length / knot spacing), a number.

        Speckle power is the variance of the template, speckle length its standard deviation over the RMS of the
        gradient; the knot spacing is in px.
        """
        power, slope = np.var(self.template), np.sqrt(np.mean(self.gradient**2))
        return float(self.noise / (np.sqrt(power) * slope * knot_spacing or 1.0))

    def variance(self, pixel_density: float) -> float:
        """Variance v of a pixel as if all were independent: the noise times the pixels whose residual counts once.

        The correlation area of the speckle is 2 pi var(T) / mean(g^2) px^2, with the derivative g along either axis:
        a Gaussian correlation function exp(-x^2 / 2 l^2) has the mean square derivative var(T) / l^2 and the area
        2 pi l^2. The pixels per px^2 are `pixel_density`.
        """
        slope = float(np.mean(self.gradient**2))
        area = 2 * np.pi * float(np.var(self.template)) / slope if slope > 0 else 1.0
        return NOISE_AREA * self.noise * area * pixel_density


def energy_weight(variance: float, parameters: float, energy: float, mean_square: float) -> float:
    """Weight beta = v (gamma + a) / (E + a E_0) of the bending energy; infinite without motion and energy.

    The variance v is that of :meth:`Match.variance`, gamma the `parameters` of :func:`effective_parameters`, and E the
    bending energy of the step. The prior counts for a = `PRIOR_UNKNOWNS` unknowns, of which each has the energy E_0 =
    `UNEVENNESS` times `mean_square`, the mean square of the displacement of the step less its mean, px^2.
    """
    total = energy + PRIOR_UNKNOWNS * UNEVENNESS * mean_square
    return variance * (max(parameters, 0.0) + PRIOR_UNKNOWNS) / total if total > 0 else np.inf


def effective_parameters(
    beta: float, solve: Callable[[np.ndarray], np.ndarray], probes: np.ndarray, products: np.ndarray
) -> float:
    """Effective number gamma = n - 6 - beta trace((N + beta K)^-1 K) of parameters, which the images determine.

    The trace is the mean of z^T (N + beta K)^-1 K z over vectors z of random signs (Hutchinson 1990, Commun Stat Simul
    Comput 19:433, doi 10.1080/03610919008812866): `probes`, with the `products` K z, both (probe, unknowns). `solve`
    multiplies (unknowns, probe) by (N + beta K)^-1.
    """
    trace = np.vdot(solve(probes.T).T, products) / len(probes)
    return float(probes.shape[1] - AFFINE_UNKNOWNS - beta * trace)
