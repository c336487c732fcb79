"""Time series in an XDMF file, as meshio, DOLFIN and DOLFINx write them.

XDMF 3 (https://www.xdmf.org/index.php/XDMF_Model_and_Format): a temporal collection of grids, each with a time, and
with topology and geometry of its own or, by reference, of the mesh at the beginning. Numbers stand in the file, in a
binary file or, read with h5py, in an HDF5 file.
"""

from math import prod
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from echotruth.extras import installation
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.prescribed import MotionError

Element = ElementTree.Element

_NODES = {"tetrahedron": 4, "tetrahedron_10": 10, "tet_10": 10}
_KINDS = {"float": "f", "int": "i", "uint": "u", "char": "i", "uchar": "u"}


def read_xdmf(path: Path, displacement: str | None) -> tuple[list[ImportedMesh], list[float]]:
    """Meshes and times of the temporal collection in a file.

    Parameters
    ----------
    path : Path
    displacement : str, optional
        Name of an array over the points; of several collections, as DOLFINx writes one for each function, the one that
        has it is read.

    Raises
    ------
    MotionError
        If there is no such collection of tetrahedra.
    """
    root = ElementTree.parse(path).getroot()
    grids = _temporal_grids(path, root, displacement)
    reader = _Reader(path, root)
    frames = [reader.mesh(grid, f"{path}, frame {number}") for number, grid in enumerate(grids)]
    times = [float(time.get("Value", "nan")) for grid in grids if (time := grid.find("Time")) is not None]
    return frames, times if len(times) == len(frames) else []


def _temporal_grids(path: Path, root: Element, displacement: str | None) -> list[Element]:
    collections = [
        grid.findall("Grid") for grid in root.iter("Grid") if grid.get("CollectionType", "").lower() == "temporal"
    ]
    if displacement is not None:
        named = [grids for grids in collections if any(_has_attribute(grid, displacement) for grid in grids)]
        collections = named or collections
    if not collections or not collections[0]:
        raise MotionError(f"{path}: holds no temporal collection of grids: write the mesh of every time.")
    return collections[0]


def _has_attribute(grid: Element, name: str) -> bool:
    return any(attribute.get("Name") == name for attribute in grid.findall("Attribute"))


class _Reader:
    """Reader of the grids of a file, which reads what they share once."""

    def __init__(self, path: Path, root: Element) -> None:
        self._path, self._root = path, root
        self._read: dict[int, NDArray] = {}

    def mesh(self, grid: Element, source: str) -> ImportedMesh:
        """Mesh of a grid, with its arrays over the points."""
        topology, geometry = self._own_or_shared(grid, "Topology"), self._own_or_shared(grid, "Geometry")
        kind = (topology.get("TopologyType") or topology.get("Type") or "").lower()
        if kind not in _NODES:
            raise MotionError(f"{source}: its topology is {kind or 'missing'}: write tetrahedra, linear or quadratic.")
        nodes = self._values(geometry).astype(float)
        if nodes.ndim != 2 or nodes.shape[1] != 3:
            raise MotionError(f"{source}: its geometry has the shape {nodes.shape}: write points as XYZ.")
        cells = self._values(topology)
        if cells.ndim > 1 and cells.shape[1:] != (_NODES[kind],):
            raise MotionError(
                f"{source}: its topology has the shape {cells.shape}: write {_NODES[kind]} points a cell."
            )
        cells = cells.reshape(-1, _NODES[kind])
        outside = cells[~((cells >= 0) & (cells < len(nodes)))]
        if len(outside):
            named = f"its topology names the point {outside[0]:g}, and its points are 0 to {len(nodes) - 1}"
            raise MotionError(f"{source}: {named}: write the file again.")
        arrays = {
            str(attribute.get("Name")): self._values(attribute)
            for attribute in grid.findall("Attribute")
            if attribute.get("Center", "Node").lower() == "node"
        }
        return ImportedMesh(source, nodes, cells.astype(np.int32), np.empty((0, 3), np.int32), node_arrays=arrays)

    def _own_or_shared(self, grid: Element, tag: str) -> Element:
        element = grid.find(tag)
        # What a grid takes by reference is that of the mesh at the beginning of the file.
        element = next(self._root.iter(tag), None) if element is None else element
        if element is None:
            raise MotionError(f"{self._path}: holds no {tag}: write the mesh into the file.")
        return element

    def _values(self, parent: Element) -> NDArray:
        item = parent.find("DataItem")
        if item is None or item.get("ItemType", "Uniform") != "Uniform" or item.get("Reference"):
            raise MotionError(f"{self._path}: a {parent.tag} has no plain DataItem: write the file again.")
        if id(item) not in self._read:
            self._read[id(item)] = self._item(item)
        return self._read[id(item)]

    def _item(self, item: Element) -> NDArray:
        shape = tuple(int(length) for length in item.get("Dimensions", "").split())
        if any(length < 0 for length in shape):
            raise MotionError(f"{self._path}: a DataItem has the Dimensions {shape}: write the file again.")
        kind, text = item.get("Format", "XML").lower(), (item.text or "").strip()
        if kind == "xml":
            return np.array(text.split(), dtype=float).reshape(shape)
        if kind == "hdf":
            return self._from_hdf(text).reshape(shape)
        if kind == "binary":
            number = item.get("NumberType") or item.get("DataType") or "Float"
            order = {"little": "<", "big": ">"}.get(item.get("Endian", "Native").lower(), "=")
            dtype = f"{order}{_KINDS[number.lower()]}{item.get('Precision', '4')}"
            offset, count = int(item.get("Seek", "0")), prod(shape)
            return np.fromfile(self._beside(text), dtype, count, offset=offset).reshape(shape)
        raise MotionError(f"{self._path}: a DataItem has the format {kind}: write XML, HDF or Binary.")

    def _from_hdf(self, text: str) -> NDArray:
        try:
            import h5py
        except ImportError:
            said = f"its numbers are in HDF5, which needs h5py: install it, with {installation('export')}"
            raise MotionError(f"{self._path}: {said}.") from None
        name, _, dataset = text.partition(":")
        with h5py.File(self._beside(name), "r") as file:
            return np.asarray(file[dataset])

    def _beside(self, name: str) -> Path:
        """Path of a file of numbers; a pipe or a device could be read for ever."""
        path = self._path.parent / name
        if not path.is_file():
            raise ValueError(f"{path} is not a file")
        return path
