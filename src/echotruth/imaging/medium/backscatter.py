"""Echo of muscle that depends on its fibres: on their angle to the beam, and on how much they have shortened.

Muscle scatters most across its fibres and least along them: by 14.5 dB in fixed human myocardium at 5 MHz (Hoffmeister
et al., J Acoust Soc Am 97 (1995) 1307). In every beat its echo is strongest at end-diastole and weakest at end-systole,
by 3.5 dB in dogs (Madaras et al., Ultrason Imaging 5 (1983) 229) and 4.6 +- 0.2 dB in mice (Kovacs et al., Ultrasonic
tissue characterization of the mouse myocardium). It changes little where muscle is ischemic (Barzilai et al., Am J
Physiol 247 (1984) H478); isolated muscle changes where it shortens, but not where its length is held (IEEE Trans
Ultrason Ferroelectr Freq Control 33 (1986) 347): here the change follows the strain along the fibres.
"""

from math import log, sqrt

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.realism import Backscatter
from echotruth.fem.tetrahedra import MaterialPoints, jacobian, shape_gradient
from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.units import mm

WAVES = 64
"""Waves of which the random function of :func:`variation` is the sum."""


def variation(backscatter: Backscatter, position: Floats, random: np.random.Generator) -> Floats:
    """Factors (n,) on the amplitudes of scatterers at positions (n, 3), m, in the unloaded wall.

    Some parts of it are brighter and some fainter. Their level in dB is a normally distributed random function of
    position: a sum of cosines whose wave vectors are normally distributed, so that its correlation is Gaussian (Rahimi
    & Recht 2007, Random features for large-scale kernel machines). The mean power is that without it.
    """
    std, level = backscatter.variation_dB, np.zeros(len(position))
    if std == 0:
        return np.ones(len(position))
    wave_vectors = random.standard_normal((WAVES, 3)) / (backscatter.variation_length_mm * mm)
    for wave_vector, phase in zip(wave_vectors, random.uniform(0, 2 * np.pi, WAVES), strict=True):
        level += std * sqrt(2 / WAVES) * np.cos(position @ wave_vector + phase)
    mean_dB = std**2 * log(10) / 20
    return 10 ** ((level - mean_dB) / 20)


class FibreEcho:
    """Factors on the amplitudes of the scatterers in the wall, frame by frame.

    The echo power is changed by A (sin^2 theta - 2/3) + k (lambda - 1) dB, where theta is the angle between the fibres
    and the direction from the centre of the array, and lambda the stretch of the fibres since end-diastole. The mean of
    the first term over all directions is 0. The forms, sin^2 and linear, are assumed.

    Parameters
    ----------
    backscatter : Backscatter
        A = anisotropy_dB and k = fibre_strain_dB.
    heart : Heart
        With the fibres of its cells.
    plane : Plane
    points : MaterialPoints of length n
        The scatterers.
    """

    def __init__(self, backscatter: Backscatter, heart: Heart, plane: Plane, points: MaterialPoints) -> None:
        self._backscatter, self._heart, self._plane, self._cell = backscatter, heart, plane, points.cell
        fibre = heart.arrays["fibres"]["fibre"][points.cell]
        local = np.linalg.solve(jacobian(heart.nodes, heart.cells, points), fibre[..., None])
        self._derivative = (shape_gradient(points.xi) @ local)[..., 0]
        self._length = np.linalg.norm(self._fibres(0), axis=1)

    def __call__(self, frame: int, position: Floats) -> Floats:
        """Factors (n,) on the amplitudes.

        Parameters
        ----------
        frame : int
        position : ndarray of shape (n, 3), m
            Of the scatterers in the image; its origin is the centre of the array.
        """
        fibre = self._fibres(frame)
        length = np.linalg.norm(fibre, axis=1)
        along = np.sum((fibre @ self._plane.axes.T) * position, axis=1)
        cosine_squared = (along / (length * np.linalg.norm(position, axis=1))) ** 2
        power = self._backscatter.anisotropy_dB * (1 / 3 - cosine_squared)
        power += self._backscatter.fibre_strain_dB * (length / self._length - 1)
        return 10 ** (power / 20)

    def _fibres(self, frame: int) -> Floats:
        """F f_0 (n, 3): the fibres, as long as they are stretched since the unloaded state.

        It is the derivative of the position along the unloaded fibre, a sum over the nodes of the cell.
        """
        nodes = self._heart.positions(frame)[self._heart.cells[self._cell]]
        return (self._derivative[:, None] @ nodes)[:, 0]
