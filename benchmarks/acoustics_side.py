"""The process in which echotruth and its peers take turns; everything that touches any of them starts here."""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from statistics import median
from typing import Any

import acoustics_agreement
import acoustics_exact
import acoustics_floor
import acoustics_frame
from acoustics_arrays import ARRAYS, Array, Floats, delays
from acoustics_peers import PATCHES, Esdiva, FastSimus, Pymust, Zea
from worker import Clock, serve

from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.units import MHz, mm

Run = Callable[[Floats, Floats], Any]

ELEMENTS = 64
PAIRED, TURNS = (20000, 60000), 5
"""Scatterers of the turns whose difference gives the cost of a pair."""


def matrix(array: Array, elements: int, **options: Any) -> Run:
    """Ours: all elements to all elements."""
    return FullMatrix(array.probe(elements=elements), array.far, **options)


def transmit(array: Array, elements: int, peer: Callable[..., Any], **options: Any) -> Run:
    """One focused transmit of a peer."""
    side, delay = peer(array.probe(elements=elements), **options), _focused(array, elements)
    return lambda position, amplitude: side(position, amplitude, delay)


def esdiva(array: Array, elements: int, patches: int = 1) -> Run:
    """One focused transmit of eSDIva."""
    side, delay = _esdiva(array, elements, patches), _focused(array, elements)
    return lambda position, amplitude: side(position, amplitude, delay)


def esdiva_matrix(array: Array, elements: int) -> Run:
    """All elements to all elements, one transmit after the other."""
    return _esdiva(array, elements, 1).matrix


def _esdiva(array: Array, elements: int, patches: int) -> Esdiva:
    probe = array.probe(elements=elements)
    return Esdiva(probe, probe.sampling_MHz * MHz, patches)


def _focused(array: Array, elements: int) -> Floats:
    probe = array.probe(elements=elements)
    return delays(probe, (0.0, probe.elevation_focus_mm * mm))


PYMUST = {"peer": Pymust}

PARTIES: dict[str, tuple[Callable[..., Run], dict[str, Any]]] = {
    "ours, few scatterers": (matrix, {"elevation": False}),
    "ours": (matrix, {"elevation": False}),
    "ours, elevation": (matrix, {"elevation": True}),
    "PyMUST": (transmit, PYMUST | acoustics_agreement.FINE),
    "PyMUST, elevation": (transmit, PYMUST | acoustics_agreement.FINE | {"elevation": True}),
    "PyMUST as it comes": (transmit, PYMUST),
    "PyMUST as it comes, elevation": (transmit, PYMUST | {"elevation": True}),
    "eSDIva": (esdiva, {}),
    "eSDIva, elevation": (esdiva, {"patches": PATCHES}),
    "eSDIva, matrix": (esdiva_matrix, {}),
    "zea": (transmit, {"peer": Zea}),
    "zea in time": (transmit, {"peer": Zea, "in_time": True}),
    "FastSIMUS": (transmit, {"peer": FastSimus, "fine": True}),
    "FastSIMUS as it comes": (transmit, {"peer": FastSimus}),
}
"""Party to what makes it, and its options."""


@cache
def ready(party: str, array: str, scatterers: int, elements: int, thick: bool) -> Run:
    """A party that has taken a turn with these scatterers, as JAX compiles for every number of them."""
    make, options = PARTIES[party]
    run = make(ARRAYS[array], elements, **options)
    run(*ARRAYS[array].scatterers(scatterers, thick=thick))
    return run


def turn(party: str, array: str, scatterers: int, elements: int = ELEMENTS, thick: bool = False) -> dict[str, float]:
    """Wall and CPU seconds of a turn."""
    run, clock = ready(party, array, scatterers, elements, thick), Clock()
    phantom = ARRAYS[array].scatterers(scatterers, thick=thick)
    with clock("turn"):
        run(*phantom)
    return clock.seconds["turn"]


def pair(party: str, array: str) -> dict[str, Any]:
    """Nanoseconds of CPU of a pair of elements and a scatterer (what more scatterers add), its least work, and bins."""
    spent = [[turn(party, array, number)["cpu"] for number in PAIRED] for _ in range(TURNS)]
    few, many = (median(turns) for turns in zip(*spent, strict=True))
    taken = 1e9 * (many - few) / (PAIRED[1] - PAIRED[0]) / (ELEMENTS * (ELEMENTS + 1) / 2)
    bins = len(FullMatrix(ARRAYS[array].probe(elements=ELEMENTS), ARRAYS[array].far).frequency)
    return {"ns": taken, "bytes": acoustics_floor.traffic(acoustics_floor.SCHEMES[party]), "bins": bins}


def peak() -> float:
    """Greatest resident memory of this process so far, MiB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


def versions() -> dict[str, str]:
    """Versions of all packages that are compared."""
    packages = ("echotruth", "PyMUST", "esdiva", "zea", "FastSIMUS", "jax", "numba", "numpy", "scipy")
    return {name: version(name) for name in packages}


if __name__ == "__main__":
    serve(
        {
            "turn": turn,
            "pair": pair,
            "peak": peak,
            "versions": versions,
            "agreement": acoustics_agreement.agreement,
            "exactness": acoustics_exact.exactness,
            "errors": acoustics_exact.errors,
            "frame": acoustics_frame.frame,
            "lines": acoustics_frame.lines,
            "transmits": acoustics_frame.transmits,
            "floor": acoustics_floor.rates,
        }
    )
