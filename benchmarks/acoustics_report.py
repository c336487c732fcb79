"""Tables and charts of the benchmark of the acoustics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import acoustics_chart
from report import page, table

Result = dict[str, Any]
Lines = list[str]

MATRIX = ("ours, few scatterers", "ours", "ours, elevation", "eSDIva, matrix")
"""Parties that give all elements to all elements, of which any transmit is made; the others give one transmit."""
ELEMENTS = 64

DIRECT = 4
"""Multiply-adds of real numbers in one of complex numbers, to which the direct sum comes at every frequency."""


def write(results: Result, folder: Path) -> None:
    """Write `acoustics.md` and the charts for the parts that were run."""
    sections = {
        "scans": scans,
        "speed": speed,
        "transmits": transmits,
        "frame": frame,
        "arrays": arrays,
        "growth": growth,
        "memory": memory,
        "floor": floor,
        "agreement": agreement,
        "exactness": exactness,
    }
    remark = "Seconds are of CPU, medians, on one thread, without what is compiled or set up once."
    (folder / "acoustics.md").write_text(page("RF against other simulators", remark, sections, results))
    if "growth" in results:
        acoustics_chart.growth(results["growth"], folder / "acoustics.png")


def scans(found: Result) -> Lines:
    """Whole frames by the scan."""
    names = list(found["transmits"])
    text = [f"## A B-mode frame of {found['scatterers']} scatterers, seconds", ""]
    for array, sides in ((name, found[name]) for name in found if name not in ("scatterers", "transmits")):
        cells = [
            [party, *(_beside(row[name], sides[_ours(party)][name], party) for name in names)]
            for party, row in sides.items()
        ]
        text += [*table([array, *names], cells), ""]
    return [
        *text,
        "Ours are whole: RF, beamforming, 512 px image. The peers' are RF alone, of fewer scatterers, taken as often",
        "as there are transmits and scatterers.",
    ]


def _ours(party: str) -> str:
    return "ours, elevation" if party.endswith("elevation") else "ours"


def _beside(cost: float, ours: float, party: str) -> str:
    spent = f"{float(f'{cost:.3g}'):g}"
    return spent if party.startswith("ours") else f"{spent} ({float(f'{cost / ours:.2g}'):g} x)"


def arrays(found: Result) -> Lines:
    """Frames by the number of elements."""
    cells = [
        [elements, f"{matrix:.2f}", f"{beamformed:.2f}", f"{peak:.0f}", f"{peak - idle:.0f}"]
        for elements, matrix, beamformed, idle, peak in found["rows"]
    ]
    head = ["elements", "matrix, s", "beamforming, s", "peak resident MiB", "over that of the imported packages"]
    title = f"## Elements of the mouse's array: {found['scatterers']} scatterers, {found['lines']} focused lines"
    return [title, "", *table(head, cells)]


def speed(found: Result) -> Lines:
    """Microseconds a scatterer, and errors."""
    text = [f"## A scatterer, {ELEMENTS} elements: CPU time, us, and the error against the exact sum", ""]
    for array, sides in found.items():
        cost = {name: 1e6 * row["cpu"] / row["scatterers"] for name, row in sides["turns"].items()}
        cells = []
        for name, row in sides["turns"].items():
            many = cost[name] * (1 if name in MATRIX else ELEMENTS)
            spent = [_beside(taken, cost[_ours(name)], name) for taken in (cost[name], many)]
            wrong = ["" if error is None else f"{error:.1e}" for error in sides["errors"].get(name, (None, None))]
            cells.append([name, row["scatterers"], *spent, *wrong])
        head = [array, "scatterers", "1 transmit", f"{ELEMENTS} transmits", "error, plane", "error, lens and slab"]
        text += [*table(head, cells), ""]
    return [
        *text,
        "Ours and the matrix of eSDIva give every transmit at once, and the making of one of them is not counted; the",
        "others give one at a time. In brackets: over ours, which take the less for a scatterer the more there are.",
        "",
        "Errors are relative L2 of the RF, after the best common factor for the peers: in the plane of elements that",
        "are points in elevation, and under the lens. PyMUST without elevation, and FastSIMUS, are in two dimensions,",
        "where the loss over distance is another. The baffle of zea is rigid, and its pulse has zeros, at frequencies",
        "that are left out. Each peer has a lens of its own, or none.",
    ]


def transmits(found: Result) -> Lines:
    """Frames of several transmits."""
    text = [f"## A frame of {found['scatterers']} scatterers against its transmits", ""]
    for array, sides in ((name, found[name]) for name in found if name != "scatterers"):
        peers = {name: row["cpu"] for name, row in sides["peers"].items()}
        cells = []
        for number, parts in sides["ours"].items():
            ours = sum(part["cpu"] for part in parts.values())
            theirs = {name: int(number) * cost for name, cost in peers.items()}
            # eSDIva too can make any transmit of its matrix, which is 64 of them; its making is not counted.
            theirs["eSDIva"] = min(theirs["eSDIva"], 64 * peers["eSDIva"])
            ratios = [f"{cost:.3g} ({cost / ours:.0f} x)" for cost in theirs.values()]
            split = f"{ours:.3f} ({parts['matrix']['cpu']:.3f} + {parts['channels']['cpu']:.3f})"
            cells.append([number, split, *ratios])
        text += [*table([f"{array}: transmits", "ours (matrix + channels), s", *peers], cells), ""]
    return [*text, "One transmit of the peers was timed, and taken as often as there are transmits."]


def frame(found: Result) -> Lines:
    """Whole frames of ours."""
    one, cells = found["rows"][0], []
    for row in found["rows"]:
        spent = row["seconds"]
        both, made = (spent[part] for part in ("channels and receive focus", "channels"))
        spent = spent | {"receive focus": {kind: both[kind] - made[kind] for kind in both}}
        parts = [spent[part] for part in ("matrix", "channels", "receive focus", "image")]
        total = {kind: sum(part[kind] for part in parts) for kind in both}
        cells.append([row["array"], row["threads"], *(f"{p['cpu']:.2f} ({p['wall']:.2f})" for p in (*parts, total))])
    head = ["array", "threads", "matrix", "channels", "receive focus", "image", "frame"]
    size = f"{one['size_px']} x {one['size_px']} px"
    title = f"## {one['scatterers']} scatterers to an image: {one['lines']} focused lines, {size}, CPU (wall) seconds"
    return [title, "", *table(head, cells)]


def growth(found: Result) -> Lines:
    """Against scatterers and elements."""
    numbers = sorted({number for rows in found["scatterers"].values() for number, _ in rows})
    by_number = [[party, *_row(rows, numbers, 1)] for party, rows in found["scatterers"].items()]
    elements = [number for number, _ in next(iter(found["elements"].values()))]
    by_element = [[party, *_row(rows, elements, 1e6)] for party, rows in found["elements"].items()]
    return [
        "## Growth, mouse's array",
        "",
        *table(["seconds, scatterers:", *numbers], by_number),
        "",
        *table(["us a scatterer, elements:", *elements], by_element),
        "",
        "![seconds against scatterers and elements](acoustics.png)",
    ]


def _row(pairs: list[list[float]], numbers: list[int], scale: float) -> Lines:
    known = {number: f"{scale * value:.3g}" for number, value in pairs}
    return [known.get(number, "") for number in numbers]


def memory(found: Result) -> Lines:
    """Peaks."""
    cells = [
        [row["party"], row["scatterers"], f"{row['peak']:.0f}", f"{row['peak'] - row['idle']:.0f}"]
        for row in found["rows"]
    ]
    head = ["", "scatterers", "peak resident MiB", "over that of the imported packages"]
    return ["## Memory, a process each", "", *table(head, cells)]


def floor(found: Result) -> Lines:
    """What the machine allows."""
    rates, cells = found["rates"], []
    for party, pair in found["pairs"].items():
        bounds = {kind: size / 32 * rates[kind] for kind, size in pair["bytes"].items()}
        binding = max(bounds, key=bounds.get)
        direct = DIRECT * pair["bins"] * 4 / 32 * rates["multiply"]
        tally = ", ".join(f"{kind} {size} B" for kind, size in pair["bytes"].items())
        cells.append([party, tally, f"{bounds[binding]:.2f} ({binding})", f"{pair['ns']:.2f}", f"{direct:.2f}"])
    measured = ", ".join(f"{kind} {rate:.3f}" for kind, rate in rates.items())
    return [
        "## What the machine allows",
        "",
        f"Measured in the nearest cache, ns for 32 bytes: {measured}. The direct sum is {DIRECT} multiply-adds",
        "for every frequency at that rate, were there nothing else to do.",
        "",
        *table(["", "of a pair and scatterer", "least, ns", "taken, ns", "direct sum, ns"], cells),
    ]


def agreement(found: Result) -> Lines:
    """Likeness to the peers."""
    text = ["## Likeness to the peers", ""]
    for array, rows in found.items():
        cells = [
            [name, f"{1 - row['correlation']:.1e}", f"{row['error']:.1e}", f"{row['factor']:.4g}"]
            for name, row in rows.items()
        ]
        text += [*table([array, "1 - correlation", "relative L2", "ours / theirs"], cells), ""]
    return text[:-1]


def exactness(found: Result) -> Lines:
    """Errors against the exact sum."""
    text = ["## Against the exact sum", ""]
    for array, rows in found.items():
        cells = [[*row[:-1], f"{row[-1]:.1e}"] for row in rows]
        text += [*table([array, "scatterers", "attenuation, dB/cm/MHz", "relative L2"], cells), ""]
    return text[:-1]
