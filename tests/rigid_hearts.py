"""The configuration of a run that takes seconds: two hearts that move as rigid bodies."""

CONFIG = """
name: tiny
geometry: {circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}
loop: {frames: 4}
motion: {kind: rigid}
views: {mid: {position: 0.5}}
phantom: {density_per_mm3: 50}
probe: {elements: 16}
rf: {lines: 32, focal_zones: 1}
bmode: {size_px: 128, downsampling: [1]}
tracking: {trackers: {dis: {method: dis}}}
cases: {seed: [1, 2]}
"""
