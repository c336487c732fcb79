"""What is said of one array of the repository."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Array:
    """One array of the repository.

    Attributes
    ----------
    name : str
        Its name in its group.
    dims : tuple of str
        Names of its dimensions, in order.
    dtype : str
    units : str
        SI, as UDUNITS writes them; "1" for numbers without one.
    long_name : str
        What it holds, for people and for plots.
    """

    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str

    @property
    def leading(self) -> int:
        """Number of leading dimensions that name the job which owns a shard: case, or case and view."""
        return sum(dim in ("case", "view") for dim in self.dims)

    @property
    def fill(self) -> float | int | str:
        """Value where nothing was written."""
        return {"f": float("nan"), "s": ""}.get(self.dtype[0], 0)


def array(name: str, dims: str, dtype: str, units: str, long_name: str) -> Array:
    """An array whose dimensions are told in one string."""
    return Array(name, tuple(dims.split()), dtype, units, long_name)
