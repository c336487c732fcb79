"""A small convolutional network that corrects a tracked wall on rays and over the cycle, and says how far it is off.

Its input is a periodic image: rows are phases of the cycle, columns are the rays of :mod:`.wall_rays`, and the points
of a ray through the wall are channels. So both planes are alike to it, and what a part of the wall does in one frame is
seen beside what its neighbours do, before and after. It has residual layers of 3 x 3 weights (He et al. 2016,
doi:10.1109/CVPR.2016.90), dilated so that an output sees the whole wall and cycle (Yu and Koltun 2016,
arXiv:1511.07122). PyTorch trains it (examples/ray_network.py), and NumPy computes it here.
"""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from echotruth.tracking.wall_rays import DEPTHS, RAYS

PHASES = 24
"""Phases of the cycle."""
DILATIONS = ((1, 1), (2, 2), (4, 4), (4, 8), (2, 16), (1, 2))
"""Distance of the weights of each layer: phases, rays."""
OUTPUTS = 3 * DEPTHS
"""Of each phase and ray: the correction of every point along and across the ray, and the log deviation of each."""
LEAST_DEVIATION, LARGEST_DEVIATION = 1e-3, 10.0
"""Bounds of the deviation, over the scale of the motion."""


@dataclass(frozen=True)
class RayNetwork:
    """Weights of the network.

    Attributes
    ----------
    first, first_bias : ndarray of shapes (width, channel), (width,)
        From the channels.
    layers, biases : ndarray of shapes (layer, width, width, 3, 3), (layer, width)
        Residual layers: to, from, phase, ray.
    last, last_bias : ndarray of shapes (OUTPUTS, width), (OUTPUTS,)
    least, largest : ndarray of shape (channel,)
        Range of each channel in what it has learned from, to which it is clamped; infinite where that is not known.
    """

    first: np.ndarray
    first_bias: np.ndarray
    layers: np.ndarray
    biases: np.ndarray
    last: np.ndarray
    last_bias: np.ndarray
    least: np.ndarray
    largest: np.ndarray

    def __call__(self, channels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Correction of the displacement, and deviation of what is left.

        Parameters
        ----------
        channels : ndarray of shape (channel, PHASES, RAYS)

        Returns
        -------
        correction : ndarray of shape (PHASES, DEPTHS, RAYS, 2)
            Along and across the ray, over the scale of the motion; 0 at the first phase.
        deviation : ndarray of shape (PHASES, DEPTHS, RAYS)
            Standard deviation of the error along each axis, over the scale of the motion.
        """
        channels = np.clip(channels, self.least[:, None, None], self.largest[:, None, None])
        values = _mixed(self.first, channels) + self.first_bias[:, None, None]
        for weights, bias, dilation in zip(self.layers, self.biases, DILATIONS, strict=True):
            values = values + np.maximum(_convolved(values, weights, dilation) + bias[:, None, None], 0)
        output = _mixed(self.last, values) + self.last_bias[:, None, None]
        correction = output[: 2 * DEPTHS].reshape(DEPTHS, 2, PHASES, RAYS)
        correction = correction - correction[:, :, :1]
        deviation = np.clip(np.exp(output[2 * DEPTHS :]), LEAST_DEVIATION, LARGEST_DEVIATION)
        return correction.transpose(2, 0, 3, 1), deviation.transpose(1, 0, 2)


def read(file: str | Path, channels: int) -> RayNetwork:
    """Weights for a number of channels from a file of NumPy (.npz), as examples/ray_network.py writes it.

    Raises
    ------
    ValueError
        If there is no such file, or it holds no such weights.
    """
    try:
        with np.load(file) as arrays:
            if "first" in arrays and "least" not in arrays:
                raise ValueError("they lack the range of each channel: train them again")
            network = RayNetwork(**{name: arrays[name].astype(np.float32) for name in RayNetwork.__annotations__})
        _check(network, channels)
    except (OSError, ValueError, KeyError, TypeError, BadZipFile) as error:
        raise ValueError(
            f"{file}: holds no weights of this network ({error}): give a file that examples/ray_network.py wrote"
        ) from None
    return network


def _check(network: RayNetwork, channels: int) -> None:
    width, layers = len(network.first_bias), len(DILATIONS)
    expected = {
        "first": (width, channels),
        "layers": (layers, width, width, 3, 3),
        "biases": (layers, width),
        "last": (OUTPUTS, width),
        "last_bias": (OUTPUTS,),
        "least": (channels,),
        "largest": (channels,),
    }
    for name, shape in expected.items():
        if (found := getattr(network, name).shape) != shape:
            raise ValueError(f"{name} is of shape {found}, not {shape}")


def _mixed(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Weights (to, from) times values (from, phase, ray)."""
    return (weights @ values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])


def _convolved(values: np.ndarray, weights: np.ndarray, dilation: tuple[int, int]) -> np.ndarray:
    """Values (from, phase, ray) convolved with weights (to, from, 3, 3); both axes are periodic."""
    total = np.zeros((len(weights), *values.shape[1:]), values.dtype)
    for i in range(3):
        for j in range(3):
            shift = (1 - i) * dilation[0], (1 - j) * dilation[1]
            total += _mixed(weights[:, :, i, j], np.roll(values, shift, (1, 2)))
    return total
