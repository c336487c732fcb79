"""Hostile meshes and motions in files: bad indices, sizes and numbers, cut files, XML bombs, pickles, no files.

What is accepted must hold finite points and tetrahedra of positive volume, as meshio reads it.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import pyvista
from hostile_child import ACCEPTED, EXECUTED, SILENT, Child, Trial
from hostile_pickles import pickled
from meshio.xdmf import TimeSeriesWriter

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle

PART = "meshes and motions"
FRAMES = 4
FLIPS = 6
"""Bits flipped, one at a time, of every kind of file in which that is tried."""

Write = Callable[[Path], None]


def tried(folder: Path, child: Child, random: np.random.Generator, marker: Path) -> Iterator[Trial]:
    """Give every file to `echotruth check`, in a configuration that names it."""
    heart = _Heart()
    for kind, name, suffix, write in _cases(heart, random, marker):
        place = folder / f"{len(list(folder.iterdir()))}"
        place.mkdir()
        file = place / f"wall{suffix}"
        write(file)
        configuration = place / "hostile.yaml"
        configuration.write_text(_configuration(file, heart.mesh(place)))
        answer = child("echotruth", arguments=["check", str(configuration)])
        outcome, said = answer.refusal(str(file.parent)), " ".join(answer.sentences)[:300].replace(f"{place}/", "")
        if not answer.fault and ": valid; cases: " in answer.text:
            wrong = _wrongly_accepted(file)
            outcome, said = (
                (SILENT, wrong) if wrong else (ACCEPTED, "another heart, which is whole: its file has no checksum")
            )
        if marker.exists():
            marker.unlink()
            outcome = EXECUTED
        yield Trial(PART, kind, f"{suffix}: {name}", outcome, said or answer.text[-600:])


MOTIONS = (".npz", ".npy", ".xdmf", ".pvd", ".pvtu")


def _configuration(file: Path, mesh: Path) -> str:
    elements = "circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1"
    if file.suffix not in MOTIONS:
        remesh = f", remesh: true, {elements}" if file.suffix in (".stl", ".ply", ".vtp") else ""
        return f"name: hostile\ngeometry: {{file: '{file}', unit: mm{remesh}}}\n"
    named = f", file: '{mesh}'" if file.suffix in (".npz", ".npy") else ""
    displacement = ", displacement: u" if file.suffix in (".xdmf", ".pvd") else ""
    return (
        f"name: hostile\ngeometry: {{unit: mm{named}}}\nloop: {{heart_rate_per_min: 500, frames: {FRAMES}}}\n"
        f"motion: {{kind: file, file: {{path: '{file}'{displacement}}}}}\n"
    )


def _wrongly_accepted(file: Path) -> str:
    """Why a file that was accepted should not have been; empty if it holds a heart."""
    if file.suffix not in (".vtk", ".vtu", ".msh"):
        return "a file that is damaged was taken for whole"
    mesh = meshio.read(file)
    cells = np.concatenate([block.data for block in mesh.cells if block.type == "tetra"])
    corner = mesh.points[cells]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1])
    return "" if np.isfinite(mesh.points).all() and volume.min() > 0 else "holds no heart"


class _Heart:
    """A sound heart of linear tetrahedra, mm, its surface, and a motion of it."""

    def __init__(self) -> None:
        mesh = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))
        used, number = np.unique(mesh.cells[:, :4], return_inverse=True)
        self.points, self.cells = 1e3 * mesh.nodes[used], number.reshape(-1, 4)
        self.grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: self.cells}, self.points)
        self.surface = self.grid.extract_surface(algorithm=None).triangulate()
        shrunk = 1 - 0.1 * np.sin(np.pi * np.arange(FRAMES) / FRAMES) ** 2
        self.positions = self.points * shrunk[:, None, None]

    def mesh(self, folder: Path) -> Path:
        """The mesh of a motion that has none of its own."""
        path = folder / "mesh.vtu"
        self.grid.save(path)
        return path

    def save(self, path: Path, binary: bool = False) -> None:
        """The sound file."""
        if path.suffix == ".msh":
            meshio.write(path, meshio.Mesh(self.points, [("tetra", self.cells)]), file_format="gmsh22", binary=binary)
        elif path.suffix in (".stl", ".ply", ".vtp"):
            self.surface.save(path, binary=binary)
        elif path.suffix == ".xdmf":
            self._save_xdmf(path, "Binary" if binary else "XML")
        else:
            self.grid.save(path, binary=binary)

    def _save_xdmf(self, path: Path, numbers: str) -> None:
        # meshio writes the numbers into the working folder.
        with contextlib.chdir(path.parent), TimeSeriesWriter(path, numbers) as writer:
            writer.write_points_cells(self.points, [("tetra", self.cells)])
            for frame, positions in enumerate(self.positions):
                writer.write_data(0.01 * frame, point_data={"u": positions - self.points})


def _cases(heart: _Heart, random: np.random.Generator, marker: Path) -> Iterator[tuple[str, str, str, Write]]:
    """Kind, name and suffix of every file, and what writes it."""
    for suffix, edits in TEXTS.items():
        for (kind, name), (was, becomes) in edits.items():
            yield kind, name, suffix, partial(_edited, heart, was, becomes)
    for suffix in (".vtu", ".vtk", ".msh", ".stl", ".ply", ".xdmf"):
        yield "empty", "", suffix, Path.touch
        for is_binary in (True, False):
            share = random.uniform(0.05, 0.95)
            yield "truncated", f"after {share:.0%}", suffix, partial(_truncated, heart, share, is_binary)
    for suffix in (".vtu", ".vtk", ".ply", ".stl"):
        for _ in range(FLIPS if suffix in (".vtu", ".vtk") else 0):
            place, bit = random.random(), int(random.integers(8))
            yield "flipped bit", f"at {place:.1%}", suffix, partial(_flipped, heart, place, bit)
        yield "no file", "a folder", suffix, Path.mkdir
        yield "no file", "a link to a device that never ends", suffix, partial(_linked, "/dev/zero")
    yield "no file", "a pipe", ".vtu", os.mkfifo
    yield "no file", "a link to itself", ".vtk", lambda file: file.symlink_to(file)
    for suffix in (".vtu", ".xdmf", ".pvd", ".pvtu"):
        yield "XML bomb", "a billion laughs", suffix, partial(_text, LAUGHS)
        yield "XML bomb", "a file of the machine", suffix, partial(_text, ENTITY)
    yield from _motions(heart, marker)


LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "ha">'
    + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 11))
    + '<!-- -->]><VTKFile type="UnstructuredGrid"><UnstructuredGrid>&a10;</UnstructuredGrid></VTKFile>'
).replace("<!-- -->", "")
ENTITY = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
    '<VTKFile type="Collection"><Collection><DataSet timestep="0" file="&f;"/>&f;</Collection></VTKFile>'
)

INDEX, SIZE, NUMBER, TYPE = "bad index", "bad size", "not a number", "bad kind"
TEXTS: dict[str, dict[tuple[str, str], tuple[str, str]]] = {
    ".vtk": {
        (SIZE, "of points, negative"): (r"POINTS \d+", "POINTS -5"),
        (SIZE, "of points, none"): (r"POINTS \d+", "POINTS 0"),
        (SIZE, "of points, huge"): (r"POINTS \d+", "POINTS 9999999999999"),
        (SIZE, "of cells, huge"): (r"CELLS (\d+) (\d+)", r"CELLS 99999999999 \2"),
        (SIZE, "of cells, negative"): (r"CELLS (\d+) (\d+)", r"CELLS -1 -1"),
        (SIZE, "of the list of cells"): (r"CELLS (\d+) (\d+)", r"CELLS \1 7"),
        (TYPE, "of cells"): (r"(CELL_TYPES \d+\s+)10", r"\g<1>24"),
        (TYPE, "of cells, none of VTK's"): (r"(CELL_TYPES \d+\s+)10", r"\g<1>9999"),
        (TYPE, "of numbers"): (r"(POINTS \d+) \w+", r"\1 bit"),
        (TYPE, "of file"): ("ASCII", "BINARY"),
        (TYPE, "of mesh"): ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS"),
        (NUMBER, "nan"): (r"(POINTS \d+ \w+\s+)\S+", r"\1nan"),
        (NUMBER, "inf"): (r"(POINTS \d+ \w+\s+)\S+", r"\1inf"),
        (NUMBER, "huge"): (r"(POINTS \d+ \w+\s+)\S+", r"\g<1>1e300"),
        (NUMBER, "text"): (r"(POINTS \d+ \w+\s+)\S+", r"\1heart"),
    },
    ".vtu": {
        (SIZE, "of points, negative"): (r'NumberOfPoints="\d+"', 'NumberOfPoints="-5"'),
        (SIZE, "of points, huge"): (r'NumberOfPoints="\d+"', 'NumberOfPoints="999999999999"'),
        (SIZE, "of cells, huge"): (r'NumberOfCells="\d+"', 'NumberOfCells="999999999999"'),
        (SIZE, "of components"): (r'Name="Points" NumberOfComponents="3"', 'Name="Points" NumberOfComponents="1"'),
        (INDEX, "of a cell, outside"): (r'(Name="connectivity"[^>]*>\s*)\d+', r"\g<1>2147483647"),
        (INDEX, "of a cell, negative"): (r'(Name="connectivity"[^>]*>\s*)\d+', r"\g<1>-1"),
        (INDEX, "of a cell, of 64 bits"): (r'(Name="connectivity"[^>]*>\s*)\d+', r"\g<1>9223372036854775807"),
        (INDEX, "of the first cell's end, outside"): (r'(Name="offsets"[^>]*>\s*)\d+', r"\g<1>999999999"),
        (INDEX, "of the first cell's end, negative"): (r'(Name="offsets"[^>]*>\s*)\d+', r"\g<1>-4"),
        (TYPE, "of cells"): (r'(Name="types"[^>]*>\s*)10', r"\g<1>42"),
        (TYPE, "of numbers"): ('type="Int64"', 'type="String"'),
        (NUMBER, "nan"): (r'(Name="Points"[^>]*>\s*)\S+', r"\1nan"),
        (NUMBER, "huge"): (r'(Name="Points"[^>]*>\s*)\S+', r"\g<1>1e38"),
    },
    ".msh": {
        (INDEX, "of a cell, outside"): (r"(\$Elements\s+\d+\s+\d+ 4 (?:\d+ ){3})\d+", r"\g<1>999999"),
        (INDEX, "of a cell, negative"): (r"(\$Elements\s+\d+\s+\d+ 4 (?:\d+ ){3})\d+", r"\g<1>-7"),
        (SIZE, "of points, huge"): (r"(\$Nodes\s+)\d+", r"\g<1>99999999999"),
        (SIZE, "of cells, negative"): (r"(\$Elements\s+)\d+", r"\g<1>-3"),
        (TYPE, "of file"): (r"2\.2 0 8", "9.9 0 8"),
        (NUMBER, "nan"): (r"(\$Nodes\s+\d+\s+\d+ )\S+", r"\1nan"),
    },
    ".ply": {
        (INDEX, "of a triangle, outside"): (r"\n3 \d+", "\n3 99999999"),
        (INDEX, "of a triangle, negative"): (r"\n3 \d+", "\n3 -8"),
        (SIZE, "of points, huge"): (r"element vertex \d+", "element vertex 2147483647"),
        (SIZE, "of triangles, huge"): (r"element face \d+", "element face 2147483647"),
        (SIZE, "of a triangle"): (r"\n3 (?=\d+ \d+ \d+)", "\n255 "),
        (TYPE, "of file"): ("format ascii", "format binary_little_endian"),
        (NUMBER, "nan"): (r"(end_header\n)\S+", r"\1nan"),
    },
    ".stl": {
        (NUMBER, "nan"): (r"vertex\s+\S+", "vertex nan"),
        (NUMBER, "huge"): (r"vertex\s+\S+", "vertex 1e38"),
        (SIZE, "a triangle too few"): (r"facet(?:.|\n)*?endfacet", ""),
        (SIZE, "of a triangle"): (r"\s+vertex [^\n]*", ""),
    },
    ".xdmf": {
        (INDEX, "of a cell, outside"): (r"(<Topology(?:.|\n)*?<DataItem[^>]*>\s*)\d+", r"\g<1>999999"),
        (INDEX, "of a cell, negative"): (r"(<Topology(?:.|\n)*?<DataItem[^>]*>\s*)\d+", r"\g<1>-1"),
        (SIZE, "of points, negative"): (r'Dimensions="\d+ 3"', 'Dimensions="-1 3"'),
        (SIZE, "of points, huge"): (r'Dimensions="\d+ 3"', 'Dimensions="99999999999 3"'),
        (TYPE, "of cells"): ("Tetrahedron", "Hexahedron"),
        (TYPE, "of numbers, a device"): (r'Format="XML"([^>]*)>[^<]*', r'Format="Binary"\1>/dev/zero'),
        (TYPE, "of numbers, a file of the machine"): (r'Format="XML"([^>]*)>[^<]*', r'Format="HDF"\1>/etc/passwd:/x'),
        (NUMBER, "in a time"): (r'<Time Value="[^"]*"', '<Time Value="soon"'),
        (NUMBER, "of a time"): (r'<Time Value="[^"]*"', '<Time Value="nan"'),
    },
}
"""Suffix -> kind and name of an edit -> what is sought in the sound text, and what takes its place."""


def _edited(heart: _Heart, was: str, becomes: str, file: Path) -> None:
    heart.save(file)
    text, count = re.subn(was, becomes, file.read_text(), count=1)
    assert count, (file.suffix, was)
    file.write_text(text)


def _text(text: str, file: Path) -> None:
    file.write_text(text)


def _linked(target: str, file: Path) -> None:
    file.symlink_to(target)


def _truncated(heart: _Heart, share: float, binary: bool, file: Path) -> None:
    heart.save(file, binary)
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])


def _flipped(heart: _Heart, place: float, bit: int, file: Path) -> None:
    heart.save(file)
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 1 << bit
    file.write_bytes(content)


def _motions(heart: _Heart, marker: Path) -> Iterator[tuple[str, str, str, Write]]:
    """Hostile motions of a sound mesh."""
    positions = heart.positions
    spoiled = positions.copy()
    spoiled[1, 3, 0] = np.nan
    arrays: dict[tuple[str, str], np.ndarray] = {
        (NUMBER, "nan"): spoiled,
        (NUMBER, "inf"): np.where(np.isnan(spoiled), np.inf, spoiled),
        (NUMBER, "complex"): positions + 1j,
        (NUMBER, "text"): positions.astype(str),
        (NUMBER, "times"): positions.astype("datetime64[s]"),
        (SIZE, "of no frames"): positions[:0],
        (SIZE, "of one frame"): positions[:1],
        (SIZE, "of no points"): positions[:, :0],
        (SIZE, "of two coordinates"): positions[..., :2],
        (SIZE, "of no dimension"): np.array(1.0),
    }
    for (kind, name), values in arrays.items():
        yield kind, name, ".npz", lambda file, values=values: np.savez(file, positions=values)
    for suffix in (".npy", ".npz"):
        yield "pickle", "in place of the file", suffix, lambda file: file.write_bytes(pickled(marker))
        yield "pickle", "in an array of objects", suffix, partial(_objects, marker)
        yield SIZE, "that the header makes up", suffix, _made_up
        yield "empty", "", suffix, Path.touch
        yield "truncated", "half", suffix, partial(_half, positions)
        yield "no file", "a link to a device that never ends", suffix, partial(_linked, "/dev/zero")
    yield SIZE, "of an archive that is a bomb", ".npz", _archive_bomb
    yield "no file", "a folder", ".npz", Path.mkdir
    names = {
        "a collection of itself": '<DataSet timestep="0" file="wall.pvd"/><DataSet timestep="1" file="wall.pvd"/>',
        "a collection of no file": '<DataSet timestep="0"/><DataSet timestep="1"/>',
        "a collection of a device": '<DataSet timestep="0" file="/dev/zero"/><DataSet timestep="1" file="/dev/null"/>',
        "a collection of the machine": '<DataSet timestep="0" file="/etc/passwd"/>',
        "a collection of nothing": "",
        "times that are text": '<DataSet timestep="soon" file="mesh.vtu"/>',
    }
    for name, entries in names.items():
        text = f'<VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>'
        yield "path to nowhere in a key", name, ".pvd", partial(_text, text)
    itself = (
        '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="wall.pvtu"/></PUnstructuredGrid></VTKFile>'
    )
    yield "path to nowhere in a key", "pieces of itself", ".pvtu", partial(_text, itself)


def _objects(marker: Path, file: Path) -> None:
    """An array of objects, which NumPy pickles."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|O", "fortran_order": False, "shape": (FRAMES, 1, 3)})
    _array(file, header.getvalue() + pickled(marker))


def _made_up(file: Path) -> None:
    """An array of which the header says that it has more numbers than any machine."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6, 3)})
    _array(file, header.getvalue() + bytes(800))


def _array(file: Path, content: bytes) -> None:
    if file.suffix == ".npy":
        file.write_bytes(content)
        return
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("positions.npy", content)


def _archive_bomb(file: Path) -> None:
    """An array of zeros, of 24 GB when it is unpacked, in a short archive: an entry of many that say the same."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1000, 10**6, 3)})
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("positions.npy", "w") as entry:
        entry.write(header.getvalue())
        for _ in range(64):
            entry.write(bytes(2**20))


def _half(positions: np.ndarray, file: Path) -> None:
    np.save(file, positions) if file.suffix == ".npy" else np.savez(file, positions=positions)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
