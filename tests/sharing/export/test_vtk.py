"""The beating mesh, read by VTK."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista
from known_repository import FRAMES, SHIFT

from echotruth.heart import SHORT_AXIS
from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export
from echotruth.sharing.export.vtk import fibres


@pytest.fixture(scope="module")
def series(known, tmp_path_factory):
    work = Export(Repository(known.folder), "vtk", output=tmp_path_factory.mktemp("vtk"))
    (folder,) = work.write(work.clips()[0])
    return pyvista.PVDReader(str(folder / "heart.pvd"))


def meshes(series):
    for time in series.time_values:
        series.set_active_time_value(time)
        yield series.read()[0]


def test_frames_have_their_times(series):
    np.testing.assert_allclose(series.time_values, 0.12 / FRAMES * np.arange(FRAMES), rtol=1e-6)
    stated = [float(mesh.field_data["time_s"][0]) for mesh in meshes(series)]
    np.testing.assert_allclose(stated, series.time_values, rtol=1e-6)


def test_nodes_move_by_the_shift_in_the_frame_of_the_heart(series, known):
    first, *_, last = meshes(series)
    assert set(first.celltypes) == {pyvista.CellType.QUADRATIC_TETRA}
    np.testing.assert_array_equal(first.cell_connectivity.reshape(-1, 10), known.heart.cells)
    np.testing.assert_allclose(
        last.points - first.points, np.broadcast_to(SHIFT @ SHORT_AXIS, first.points.shape), atol=1e-9
    )
    np.testing.assert_allclose(last["displacement"], np.broadcast_to(SHIFT @ SHORT_AXIS, first.points.shape), atol=1e-9)


def test_elements_are_positive_and_as_large_as_the_wall(series, half_sphere):
    """VTK takes its order of the nodes, or volumes would be wrong."""
    mesh = next(meshes(series)).compute_cell_sizes(length=False, area=False)
    assert mesh["Volume"].min() > 0
    surface = mesh.extract_surface(algorithm="dataset_surface").triangulate()
    assert mesh["Volume"].sum() == pytest.approx(surface.volume, rel=0.02)


def test_fields_are_those_of_the_cells(series, known):
    arrays = known.heart.arrays
    *_, last = meshes(series)
    np.testing.assert_array_equal(last["segment"], arrays["fibres"]["segment"])
    np.testing.assert_array_equal(last["layer"], arrays["fibres"]["layer"])
    np.testing.assert_array_equal(last["region"], arrays["pathology"]["region"])
    np.testing.assert_allclose(last["wall_depth"], arrays["fibres"]["wall_depth"])
    np.testing.assert_allclose(last["strain"], 0, atol=1e-6)  # rigid
    np.testing.assert_allclose(last["fibre"], arrays["fibres"]["fibre"], atol=1e-5)


def test_fibres_turn_and_stretch_with_the_tissue(twisting_heart, affine):
    """By an affine map, a fibre f points along F f everywhere."""
    random = np.random.default_rng(3).standard_normal((len(twisting_heart.cells), 3))
    start = random / np.linalg.norm(random, axis=1, keepdims=True)
    heart = replace(twisting_heart, arrays={"fibres": {"fibre": start}})
    np.testing.assert_allclose(fibres(heart, 0), start, atol=1e-12)
    mapped = start @ affine[0].T
    np.testing.assert_allclose(fibres(heart, 1), mapped / np.linalg.norm(mapped, axis=1, keepdims=True), atol=1e-9)
