"""Send, listen and focus on one point: the length of its echo is that of the pulse."""

import numpy as np

import echotruth as et

probe, depth = et.Probe(), 8e-3  # m
scanner = et.Scanner(probe, et.Rf(lines=33, focal_zones=1), depth)
lines = scanner.lines(position=np.array([[0.0, 6.5e-3, 0.0]]), amplitude=np.ones(1))

line = np.abs(lines[np.abs(lines).max(axis=1).argmax()])
fine = np.linspace(scanner.range[0], scanner.range[-1], 200_000)
above = fine[np.interp(fine, scanner.range, line) > line.max() / 2]
length = above[-1] - above[0]  # m, -6 dB
frequency = 1e6 * probe.frequency_MHz
# A Gaussian spectrum of this -6 dB bandwidth has an envelope of that -6 dB length.
due = probe.sound_speed_m_per_s / 2 * 4 * np.log(2) / (np.pi * probe.bandwidth * frequency)
print(f"-6 dB length of the echo {1e6 * length:.1f} um, of the pulse {1e6 * due:.1f} um")
