"""Report of a check: rows of numbers with the expected values and their sources."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One number.

    Attributes
    ----------
    quantity : str
        Name of the quantity, with its unit.
    found : float
    expected : float or None
        None where the number itself is the error, or is only shown.
    tolerance : float or None
        Largest difference allowed; None for a number that is only shown.
    source : str
        Of the expectation.
    form : str
        How the numbers are written.
    """

    quantity: str
    found: float
    expected: float | None
    tolerance: float | None
    source: str
    form: str = ".4g"

    @property
    def met(self) -> bool:
        """Whether the number is within its tolerance."""
        return self.tolerance is None or abs(self.found - (self.expected or 0.0)) <= self.tolerance

    def line(self) -> str:
        """Row of the table."""
        zero = "" if self.tolerance is None else "0"
        expected = zero if self.expected is None else format(self.expected, self.form)
        allowed = "" if self.tolerance is None else f"{self.tolerance:.2g}"
        mark = "" if self.met else " **missed**"
        return f"| {self.quantity} | {self.found:{self.form}}{mark} | {expected} | {allowed} | {self.source} |"


@dataclass(frozen=True)
class Report:
    """A section of the page.

    Attributes
    ----------
    title : str
    text : str
        What was done.
    rows : tuple of Row
    caption : str
        Of the figure.
    """

    title: str
    text: str
    rows: tuple[Row, ...]
    caption: str = ""

    def section(self, picture: str | None) -> str:
        """The section in Markdown, with the path of its picture."""
        head = "| quantity | found | expected | allowed | source |\n|---|---|---|---|---|"
        shown = f"\n![{self.caption}]({picture})\n\n{self.caption}\n" if picture else ""
        return "\n".join([f"## {self.title}\n", self.text, "", head, *(row.line() for row in self.rows), shown])
