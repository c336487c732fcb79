"""The beating mesh for ParaView: a .vtu of every frame and a .pvd with their times."""

from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import MaterialPoints, gradient
from echotruth.heart import Heart
from echotruth.mechanics.fibres import CENTROID, unit
from echotruth.sharing.export.clip import ExportedClip

QUADRATIC_TETRA = 24
"""Type of cell in VTK."""


def write(clip: ExportedClip, path: Path) -> None:
    """Write the mesh of every frame in the frame of the heart, m, with its fields.

    At nodes: displacement since end-diastole (m) and wall depth. In cells, at their centroids: strain since
    end-diastole (RR, CC, LL, RC, RL, CL), direction of the fibres in that frame, layer, AHA segment and region.

    Parameters
    ----------
    clip : ExportedClip
        The heart.
    path : Path
        Folder.
    """
    import pyvista

    path.mkdir()
    heart, strain = clip.heart, clip.repository.arrays("kinematics", clip.case.id, None, "strain")["strain"]
    arrays = heart.arrays
    names = [f"{clip.case.id}_{frame:03d}.vtu" for frame in range(len(clip.time))]
    for frame, name in enumerate(names):
        grid = pyvista.UnstructuredGrid({QUADRATIC_TETRA: heart.cells.astype(np.int64)}, heart.positions(frame))
        grid.point_data["displacement"] = heart.displacement[frame] - heart.displacement[0]
        grid.point_data["wall_depth"] = heart.wall_depth
        grid.cell_data["strain"] = strain[frame].astype(np.float32)
        grid.cell_data["fibre"] = fibres(heart, frame).astype(np.float32)
        for group, label in (("fibres", "layer"), ("fibres", "segment"), ("pathology", "region")):
            grid.cell_data[label] = arrays[group][label]
        grid.field_data["time_s"] = np.array([clip.time[frame]])
        (path / name).write_text(content(grid))
    (path / f"{clip.case.id}.pvd").write_text(collection(names, clip.time))


def content(grid: Any) -> str:
    """The file of a mesh or of voxels; made in memory, since VTK does not tell of a disk that is full."""
    from vtkmodules import vtkIOXML

    kind = "ImageData" if grid.IsA("vtkImageData") else "UnstructuredGrid"
    writer = getattr(vtkIOXML, f"vtkXML{kind}Writer")()
    writer.SetInputData(grid)
    writer.WriteToOutputStringOn()
    writer.Write()
    return writer.GetOutputString()


def fibres(heart: Heart, frame: int) -> Floats:
    """Unit vectors along the fibres at the centroids in a frame, (n_cells, 3): F f, with F from the unloaded state."""
    cells = np.arange(len(heart.cells), dtype=np.int32)
    centroids = MaterialPoints(cells, np.broadcast_to(CENTROID, (len(cells), 3)))
    deformation = gradient(heart.positions(frame), heart.nodes, heart.cells, centroids)
    return unit(np.einsum("cij,cj->ci", deformation, heart.arrays["fibres"]["fibre"]))


def collection(names: list[str], time: Floats) -> str:
    """ParaView's list of files and times (s)."""
    sets = "\n".join(
        f'    <DataSet timestep="{at:.9g}" part="0" file={quoteattr(name)}/>'
        for name, at in zip(names, time, strict=True)
    )
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{sets}\n  </Collection>\n</VTKFile>\n"
    )
