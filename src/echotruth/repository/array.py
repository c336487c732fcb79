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
