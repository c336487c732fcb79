"""What a check says: rows of numbers, beside what was expected and where that comes from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One number.

    Attributes
    ----------
    quantity : str
        What it is, with its unit.
    found : float
    expected : float or None
        None where the number itself is the error, or is shown and not judged.
    tolerance : float or None
        Largest difference allowed; None for a number that is shown and not judged.
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
        nothing = "" if self.tolerance is None else "0"
        expected = nothing if self.expected is None else format(self.expected, self.form)
        allowed = "" if self.tolerance is None else f"{self.tolerance:.2g}"
        mark = "" if self.met else " **missed**"
        return f"| {self.quantity} | {self.found:{self.form}}{mark} | {expected} | {allowed} | {self.source} |"


@dataclass(frozen=True)
class Report:
    """A part of the page.

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

    def page(self, picture: str | None) -> str:
        """The part in Markdown, with the path of its picture."""
        head = "| quantity | found | expected | allowed | source |\n|---|---|---|---|---|"
        shown = f"\n![{self.caption}]({picture})\n\n{self.caption}\n" if picture else ""
        return "\n".join([f"## {self.title}\n", self.text, "", head, *(row.line() for row in self.rows), shown])
