"""A sector of a clip in which there is noise in place of the image, as behind bone or where a probe has no contact."""

import numpy as np
from scipy import ndimage

WIDTH_DEG, LOSS_DB, NOISE_DB, DYNAMIC_RANGE_DB = 10.0, 40.0, -35.0, 55.0
CENTRE_DEG = {"short_axis": -12.0, "long_axis": 8.0}
GRAIN = 1.2 / 512, 3.0 / 512
"""Standard deviation of the blur of the noise, axial and lateral, over the side of the image."""


def shadowed(frames: np.ndarray, centre_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Clip (frame, axial, lateral) with noise in a sector, and how far each pixel is in it, (axial, lateral)."""
    size = frames.shape[-1]
    row, column = np.indices((size, size))
    angle = np.degrees(np.arctan2(column - (size - 1) / 2, row + 0.5))
    inside = 1 / (1 + np.exp((np.abs(angle - centre_deg) - WIDTH_DEG / 2) / 0.15))
    random = np.random.default_rng(0)
    blur = (0, *(max(0.5, share * size) for share in GRAIN))
    noise = np.array([np.hypot(*ndimage.gaussian_filter(random.normal(size=(2, size, size)), blur)) for _ in frames])
    noise *= 10 ** (NOISE_DB / 20) / np.sqrt(np.mean(noise**2))
    amplitude = np.where(frames > 0, 10 ** ((frames / 255 - 1) * DYNAMIC_RANGE_DB / 20), 0)
    seen = amplitude * 10 ** (-LOSS_DB / 20 * inside) + noise * inside
    grey = 255 * (1 + 20 * np.log10(np.maximum(seen, 1e-9)) / DYNAMIC_RANGE_DB)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8), inside
