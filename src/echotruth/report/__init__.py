"""Figures of a repository: each module draws one, from plain arrays in SI units to a file."""
