"""Charts of the benchmark of the acoustics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

Result = dict[str, Any]

STYLES = {
    "ours": ("o-", "tab:blue", "ours, 64 transmits"),
    "ours, elevation": ("o:", "tab:blue", "ours with elevation, 64 transmits"),
    "PyMUST": ("s-", "tab:orange", "PyMUST, 1 transmit"),
    "PyMUST, elevation": ("s--", "tab:orange", "PyMUST with elevation, 1 transmit"),
    "PyMUST as it comes": ("s:", "tab:orange", "PyMUST as it comes, 1 transmit"),
    "eSDIva": ("^-", "tab:green", "eSDIva, 1 transmit"),
    "eSDIva, matrix": ("^--", "tab:green", "eSDIva, 64 transmits"),
}
"""Party to marker and line, colour and label."""


def growth(found: Result, file: Path) -> None:
    """Log-log charts of seconds against scatterers, and of microseconds a scatterer against elements."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.6), layout="constrained")
    for axes, rows, scale in ((left, found["scatterers"], 1.0), (right, found["elements"], 1e6)):
        for party, pairs in rows.items():
            style, colour, label = STYLES[party]
            axes.loglog([x for x, _ in pairs], [scale * y for _, y in pairs], style, color=colour, label=label)
        axes.grid(True, which="both", alpha=0.25)
    left.set(xlabel="scatterers", ylabel="CPU seconds, one thread", title="64 elements")
    right.set(xlabel="elements = channels", ylabel="CPU us a scatterer, one thread", title="per scatterer")
    elements = [x for x, _ in next(iter(found["elements"].values()))]
    right.set_xticks(elements, elements)
    right.minorticks_off()
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small")
    figure.savefig(file, dpi=150)
    plt.close(figure)
