"""From a beating heart to a clip: phantom, probe, RF, beamforming, B-mode, and the truth in every pixel."""
