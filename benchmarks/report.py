"""Table and chart of the benchmark of the mechanics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

Result = dict[str, Any]

PARTS = ("tangent", "residual", "factor", "solve", "step")


def write(results: Result, folder: Path) -> None:
    """Write `mechanics.md` and `scaling.png` for the parts that were run."""
    sections = {"steps": steps, "secant": cycles, "brentq": cycles, "scaling": scaling, "land": land}
    text = page("Mechanics against fenicsx-pulse", "Seconds are medians, CPU (wall).", sections, results)
    (folder / "mechanics.md").write_text(text)
    if "scaling" in results:
        chart(results["scaling"]["rows"], folder / "scaling.png")


def page(title: str, remark: str, sections: dict[str, Any], results: Result) -> str:
    """Markdown of the parts that were run, each by the function of its name."""
    machine = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    text = [f"# {title}", "", f"{machine}. {remark}", ""]
    for name, section in sections.items():
        if name in results:
            text += [*section(results[name]), ""]
    return "\n".join(text)


def table(head: list[str], rows: list[list[Any]]) -> list[str]:
    """Lines of a markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(str(cell) for cell in line) + " |" for line in lines]


def seconds(spent: Result) -> str:
    """CPU and wall seconds."""
    return f"{spent['cpu']:.3f} ({spent['wall']:.3f})"


def steps(found: Result) -> list[str]:
    """Parts of a Newton step."""
    ours = found["ours"]["seconds"]["step"]
    rows = [
        [
            name,
            side["unknowns"],
            *(seconds(side["seconds"][part]) for part in PARTS),
            _times(side["seconds"]["step"], ours),
        ]
        for name, side in found.items()
    ]
    title = f"## A Newton step, {found['ours']['cells']} quadratic tetrahedra"
    return [title, "", *table(["", "unknowns", *PARTS, "step / ours"], rows)]


def _times(spent: Result, ours: Result) -> str:
    return f"{spent['cpu'] / ours['cpu']:.2f} ({spent['wall'] / ours['wall']:.2f})"


def cycles(found: Result) -> list[str]:
    """The whole loop."""
    ours = found["ours"]
    rows = [["ours", f"{ours['cpu']:.0f} ({ours['wall']:.0f})", ours["newton_steps"], "", "", "", "", ""]]
    for run in found["runs"]:
        away = run.get("difference", {})
        percent = [
            f"{100 * value:.2f} %" if value is not None else ""
            for value in (away.get("tension"), away.get("pressure"), away.get("volume"), run.get("displacement"))
        ]
        ratio = f"{run['ratio']['cpu']:.2f} ({run['ratio']['wall']:.2f})"
        if "failed" in run:
            ratio = f"failed in frame {run['failed']['frame']}"
        rows.append(
            [
                f"{run['peer']}, {run['method']}",
                f"{run['cpu']:.0f} ({run['wall']:.0f})",
                run["newton_steps"],
                ratio,
                *percent,
            ]
        )
    head = ["", "seconds", "factorizations", "times ours", "tension differs", "pressure", "volume", "displacement"]
    title = f"## {found['frames']} frames with pressure and volume given, {found['runs'][0]['method']}"
    return [title, "", *table(head, rows)]


def scaling(found: Result) -> list[str]:
    """Against the size."""
    rows = []
    for row in found["rows"]:
        ours, pulse = row["seconds"]["ours"], row["seconds"]["pulse"]
        share = f"{ours['step']['cpu'] / ours['factor']['cpu']:.2f}"
        rows.append(
            [
                row["cells"],
                row["unknowns"],
                seconds(ours["step"]),
                seconds(ours["factor"]),
                share,
                seconds(pulse["step"]),
                _times(pulse["step"], ours["step"]),
            ]
        )
    head = ["cells", "unknowns", "our step", "our factor", "step / factor", "pulse's step", "pulse / ours"]
    return ["## A Newton step against the size", "", *table(head, rows), "", "![seconds against unknowns](scaling.png)"]


def land(found: Result) -> list[str]:
    """Problems of Land et al."""
    rows = [
        [number, side, f"{one[side]['endo']:.3f}", f"{one[side]['epi']:.3f}"]
        for number, one in found["problems"].items()
        for side in ("pulse", "ours")
    ]
    title = f"## Land et al. 2015, {found['cells']} quadratic tetrahedra"
    return [title, "", *table(["problem", "", "apex z endo, mm", "apex z epi, mm"], rows)]


def chart(rows: list[Result], file: Path) -> None:
    """Log-log chart of the seconds of a step."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.2, 4.0), layout="constrained")
    unknowns = [row["unknowns"] for row in rows]
    for name, side, part, style in (
        ("fenicsx-pulse, step", "pulse", "step", "s-"),
        ("ours, step", "ours", "step", "o-"),
        ("ours, factorization", "ours", "factor", "o--"),
        ("ours, tangent", "ours", "tangent", "^:"),
    ):
        axes.loglog(unknowns, [row["seconds"][side][part]["cpu"] for row in rows], style, label=name)
    axes.set(xlabel="unknowns (displacements)", ylabel="CPU seconds, one thread")
    axes.grid(True, which="both", alpha=0.25)
    axes.legend()
    figure.savefig(file, dpi=150)
    plt.close(figure)
