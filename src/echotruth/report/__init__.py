"""Figures of a repository: each module draws one from arrays in SI units to a file."""
