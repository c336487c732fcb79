"""Figures as SVG within a page, in its colours, which are light or dark."""

import re
from html import escape
from pathlib import Path

from echotruth.report import style

VARIABLES = {
    style.INK: "ink",
    style.MUTED: "muted",
    style.GRID: "grid",
    style.SHADE: "shade",
    style.PAPER: "paper",
    style.TARGET: "target",
    style.RADIAL: "radial",
    style.CIRCUMFERENTIAL: "circumferential",
    style.LONGITUDINAL: "longitudinal",
    style.QUANTITIES["base"].colour: "base",
    style.QUANTITIES["apex"].colour: "apex",
    **{colour: f"series-{k}" for k, colour in enumerate(style.SERIES)},
    **{colour: f"size-{k}" for k, (colour, _) in enumerate(style.SIZES)},
}
"""Colour of a figure -> variable of the page's style sheet that replaces it."""


def inline(path: Path, title: str) -> str:
    """A figure to be set into a page.

    Parameters
    ----------
    path : Path
        SVG that :func:`echotruth.report.style.save` wrote.
    title : str
        What it shows, for those who hear the page.

    Returns
    -------
    str
        An element `svg` as wide as what it stands in, whose names begin with that of the file.
    """
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    for left_out in (r"<metadata>.*?</metadata>", r"<defs>\s*<style.*?</style>\s*</defs>", r"<!--.*?-->"):
        text = re.sub(left_out, "", text, flags=re.DOTALL)
    text = re.sub(r"(\d\.\d{3})\d+", r"\1", text)  # thousandths of a point
    text = _renamed(text, path.stem)
    for colour, name in VARIABLES.items():
        text = text.replace(colour, f"var(--{name})")
    opening, rest = text.split(">", 1)
    width, height = re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', opening)[0]
    return f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(title)}">{rest.strip()}'


def _renamed(text: str, prefix: str) -> str:
    """Names that are referred to, told from those of other figures on the same page; all other names are left out."""
    used = {one or other for one, other in re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text)}
    text = re.sub(r' id="([^"]+)"', lambda name: f' id="{prefix}-{name[1]}"' if name[1] in used else "", text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', text)
    return re.sub(r"url\(#([^)]+)\)", rf"url(#{prefix}-\1)", text)
