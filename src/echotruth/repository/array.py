"""Description of one array of the repository."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Array:
    """Description of one array of the repository."""

    name: str
    """In its group."""
    dims: tuple[str, ...]
    """Names of the dimensions, in order."""
    dtype: str
    units: str
    """SI, as UDUNITS writes them; "1" for dimensionless numbers, "mixed" where a coordinate has the unit of each."""
    long_name: str
    """Content, for readers and plots."""
    quantum: float | str | None = None
    """Stored values are multiples of it, a power of two in the unit of the array, or the power of two that
    :func:`echotruth.repository.rounding.length_quantum` gives; None if they are stored as they are computed."""
    values: str = ""
    """What its values may be, one of :data:`echotruth.repository.values.RANGES`; "" for any that are numbers."""

    @property
    def leading(self) -> int:
        """Number of leading dimensions that identify the job which writes a shard: case, or case and view."""
        return sum(dim in ("case", "view") for dim in self.dims)

    def shard(self, row: tuple[int, ...]) -> str:
        """Path below the group of the file that one job writes, given the row of its case (and index of its view)."""
        return "/".join((self.name, "c", *map(str, row), *["0"] * (len(self.dims) - len(row))))

    @property
    def fill(self) -> float | int | str:
        """Value of elements that were not written."""
        fills: dict[str, float | int | str] = {"f": float("nan"), "s": ""}
        return fills.get(self.dtype[0], 0)
