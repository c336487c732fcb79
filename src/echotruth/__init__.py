"""Synthetic echocardiograms of which the true motion is known everywhere."""

__version__ = "0.1.0"
