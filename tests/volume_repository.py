"""Configuration of a repository of small volumes, in which a heart is shifted."""

import numpy as np

CONFIG = """
name: tiny
geometry: {circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}
loop: {frames: 3}
motion: {kind: rigid, rigid: {lateral_um: 200, axial_um: -300, elevation_um: 250}}
views: {whole: {plane: volume}}
phantom: {density_per_mm3: 20}
probe: {preset: mouse_row_column_15MHz, elements: 24, pitch_um: 360}
volume: {size: [24, 24, 18], field_mm: [6.9, 8.6, 6.9]}
"""
SHIFT = np.array([0.2e-3, -0.3e-3, 0.25e-3])
"""Of its heart to the middle of the cycle, m: lateral, axial, elevation."""
