"""Image scatterers without structure: the envelope of such speckle has a mean of 1.91 standard deviations."""

import numpy as np

import echotruth as et

scanner = et.Scanner(et.Probe(), et.Rf(lines=61, sector_deg=40.0), 8e-3)
random = np.random.default_rng(1)
low, high = np.array([-2.8e-3, 5.0e-3, -0.4e-3]), np.array([2.8e-3, 8.0e-3, 0.4e-3])  # lateral, axial, elevation, m
count = int(10_000e9 * np.prod(high - low))
lines = scanner.lines(random.uniform(low, high, (count, 3)), random.standard_normal(count))

inside = (scanner.range > 5.8e-3) & (scanner.range < 7.6e-3)
envelope, depth = np.abs(lines[6:-6][:, inside]), scanner.range[inside]
envelope = envelope / np.polynomial.Polynomial.fit(depth, envelope.mean(axis=0), 2)(depth)  # the beam's own loudness
snr = envelope.mean() / envelope.std()
print(f"signal-to-noise ratio of the speckle {snr:.2f}; of a Rayleigh distribution {np.sqrt(np.pi / (4 - np.pi)):.2f}")
