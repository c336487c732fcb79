"""Speckle and points of every transmit: are the images what theory says?

    python benchmarks/speckle.py --phantoms 20

Phantoms are boxes of scatterers of random sign about the focus, of the default array. Envelopes are compared with
Rayleigh's distribution at places two beams and two pulses apart; points are measured in the image plane. The results
are results/speckle.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.stats import kstest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scanner import Scanner

RESULTS = Path(__file__).parent / "results"
LOW, HIGH = np.array([-2.2e-3, 5.4e-3, -0.4e-3]), np.array([2.2e-3, 7.6e-3, 0.4e-3])
"""Corners of the phantom (lateral, axial, elevation), m."""
DENSITY = 15000e9
"""Scatterers per cubic metre: some hundred a resolution cell."""
REGION = (5.8e-3, 7.2e-3)
"""Ranges at which speckle is looked at, m."""
DEPTHS = (4e-3, 6.5e-3, 8.5e-3)
"""Ranges of the points, m."""
TRANSMITS = {
    "focused, five zones": {},
    "focused, one zone": {"focal_zones": 1},
    "focused, one zone, f-number 3": {"focal_zones": 1, "f_number": 3.0},
    "11 plane waves": {"transmit": "plane"},
    "11 diverging waves": {"transmit": "diverging"},
    "synthetic aperture": {"transmit": "synthetic_aperture"},
}


def phantom(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3), m, and amplitudes (n,) of scatterers of either sign, evenly spread."""
    random = np.random.default_rng(seed)
    number = int(DENSITY * np.prod(HIGH - LOW))
    return random.uniform(LOW, HIGH, (number, 3)), random.choice([-1.0, 1.0], number)


def full_width(place: np.ndarray, profile: np.ndarray) -> float:
    """Full width at half of the maximum, by linear interpolation."""
    peak, half = profile.argmax(), profile.max() / 2
    left = np.interp(half, profile[: peak + 1], place[: peak + 1])
    return float(np.interp(-half, -profile[peak:], place[peak:]) - left)


def widths(scanner: Scanner, depth: float) -> tuple[float, float]:
    """Lateral and axial width (-6 dB) of a point on the axis, m."""
    image = np.abs(scanner.lines(np.array([[0.0, depth, 0.0]]), np.ones(1)))
    line, sample = np.unravel_index(image.argmax(), image.shape)
    near = slice(max(sample - 60, 0), sample + 61)
    lateral = full_width(scanner.range[sample] * np.sin(scanner.angle), image[:, sample])
    return lateral, full_width(scanner.range[near], image[line, near])


def statistics(scanner: Scanner, phantoms: int, cell: tuple[float, float]) -> tuple[float, float, int]:
    """Mean over deviation of the envelope, p of its being Rayleigh, and the number of independent places."""
    samples = np.flatnonzero((scanner.range > REGION[0]) & (scanner.range < REGION[1]))
    speckle = np.stack([np.abs(scanner.lines(*phantom(seed)))[:, samples] for seed in range(phantoms)])
    power = (speckle**2).mean(axis=0)
    speckle /= np.sqrt(np.outer(power.mean(axis=1), power.mean(axis=0)) / power.mean())
    step = 6.5e-3 * (scanner.angle[1] - scanner.angle[0]), scanner.range[1] - scanner.range[0]
    across, along = (int(np.ceil(2 * size / each)) for size, each in zip(cell, step, strict=True))
    sample = speckle[:, ::across, ::along].ravel()
    found = kstest(sample, "rayleigh", args=(0, 1 / np.sqrt(2)))
    return float(sample.mean() / sample.std()), float(found.pvalue), len(sample)


def row(name: str, keys: dict, phantoms: int) -> str:
    """A line of the table."""
    fine = Scanner(Probe(), Rf(lines=121, sector_deg=24, **keys), 9e-3)
    sizes = [widths(fine, depth) for depth in DEPTHS]
    coarse = Scanner(Probe(), Rf(lines=31, sector_deg=24, **keys), 8e-3)
    snr, p, places = statistics(coarse, phantoms, sizes[1])
    points = " | ".join(f"{1e6 * lateral:.0f} x {1e6 * axial:.0f}" for lateral, axial in sizes)
    print(name, snr, p, places, points, flush=True)
    return f"| {name} | {snr:.3f} | {p:.2f} | {places} | {points} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--phantoms", type=int, default=20)
    phantoms = parser.parse_args().phantoms
    rows = [row(name, keys, phantoms) for name, keys in TRANSMITS.items()]
    heads = " | ".join(f"{1e3 * depth:g} mm (um)" for depth in DEPTHS)
    lines = [
        "# Speckle and points",
        "",
        f"{phantoms} phantoms of {DENSITY * 1e-9:.0f} scatterers/mm3, default array, Hann weights. Fully developed",
        "speckle has a mean of 1.913 standard deviations; p is that of the Kolmogorov-Smirnov test against Rayleigh's",
        "distribution over independent places. Points: lateral x axial width at -6 dB, at three depths.",
        "",
        f"| transmit | mean / deviation | p | places | {heads} |",
        "|---|---|---|---|---|---|---|",
        *rows,
        "",
    ]
    (RESULTS / "speckle.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
