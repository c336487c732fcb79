"""Volumes for ParaView: a .vti of every frame in the frame of the heart, and a .pvd with their times."""

from pathlib import Path

import numpy as np

from echotruth.notebook.volume import voxel_truth
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.vtk import collection, content


def write(clip: ExportedClip, path: Path) -> None:
    """Write the volume of every frame, where it lies in the frame of the heart, m, with what is true at its voxels.

    At voxels: image (grey levels), and of the wall displacement since end-diastole (m, in the frame of the heart; NaN
    outside), layer, AHA segment and region, 0 outside.

    Parameters
    ----------
    clip : ExportedClip
        Of volumes.
    path : Path
        Folder.
    """
    import pyvista

    path.mkdir()
    volumes, order = clip.truth(), ("elevation", "axial", "lateral")
    names = [f"{clip.case.id}_{clip.view}_{frame:03d}.vti" for frame in range(len(clip.time))]
    for frame, name in enumerate(names):
        grid = pyvista.ImageData(
            dimensions=[volumes.sizes[along] for along in reversed(order)],
            spacing=clip.sides,
            origin=clip.plane.to_heart(clip.corner),
            direction_matrix=clip.plane.axes.T,
        )
        truth = voxel_truth(volumes, clip.heart, frame)
        grid["image"] = volumes["image"].isel(frame=frame).transpose(*order).values.ravel()
        moved = truth["displacement"].transpose(*order, "vector").values.reshape(-1, 3)
        grid["displacement"] = (moved @ clip.plane.axes).astype(np.float32)
        for label in ("layer", "segment", "region"):
            grid[label] = truth[label].transpose(*order).values.ravel()
        grid.field_data["time_s"] = np.array([clip.time[frame]])
        (path / name).write_text(content(grid))
    (path / f"{clip.case.id}_{clip.view}.pvd").write_text(collection(names, clip.time))
