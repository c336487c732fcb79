"""What is read from files, and what is refused."""

from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista

from echotruth.config import Geometry
from echotruth.mechanics.geometry.imported_mesh import fingerprint, read
from echotruth.mechanics.geometry.mesh_quality import GeometryError


@pytest.mark.parametrize("corners", [4, 10])
def test_tetrahedra_come_in_the_order_of_vtk_with_their_arrays(file_heart, write_mesh, corners):
    cells = file_heart.mesh.cells[:, :corners]
    imported = read(Geometry(file=write_mesh(file_heart.nodes, cells, part=np.arange(len(cells)))))
    np.testing.assert_allclose(imported.nodes[imported.cells], 1e-3 * file_heart.nodes[cells], atol=1e-7)
    np.testing.assert_array_equal(imported.cell_arrays["part"], np.arange(len(cells)))


@pytest.mark.parametrize(("unit", "factor"), [("cm", 1e-2), ("um", 1e-6)])
def test_unit_and_scale(file_heart, write_mesh, unit, factor):
    file = write_mesh(file_heart.nodes, file_heart.mesh.cells)
    imported = read(Geometry(file=file, unit=unit, scale=2.0))
    assert np.ptp(imported.nodes, axis=0) == pytest.approx(2 * factor * np.ptp(file_heart.nodes, axis=0), rel=1e-6)


def test_groups_of_gmsh_have_names(file_heart, tmp_path):
    mesh, facets = file_heart.mesh, file_heart.mesh.endo[:, [0, 1, 2, 3, 4, 5]]
    groups = [np.full(len(mesh.cells), 9), np.full(len(facets), 2)]
    meshio.Mesh(
        file_heart.nodes,
        [("tetra10", mesh.cells), ("triangle6", facets)],
        cell_data={"gmsh:physical": groups, "gmsh:geometrical": groups},
        field_data={"muscle": np.array([9, 3]), "inner": np.array([2, 2])},
    ).write(tmp_path / "heart.msh", file_format="gmsh22", binary=False)
    imported = read(Geometry(file=str(tmp_path / "heart.msh")))
    assert imported.physical_groups == {"muscle": 9, "inner": 2}
    assert imported.cells.shape == mesh.cells.shape and imported.triangles.shape == (len(facets), 3)
    np.testing.assert_allclose(imported.nodes[imported.cells], 1e-3 * file_heart.nodes[mesh.cells], atol=1e-9)
    assert set(imported.cell_arrays["gmsh:physical"]) == {9} and set(imported.triangle_arrays["gmsh:physical"]) == {2}


def test_unused_and_duplicate_points_are_left_out(file_heart, write_mesh):
    cells = file_heart.mesh.cells[:, :4]
    apart = np.arange(cells.size).reshape(cells.shape)
    nodes = np.vstack([file_heart.nodes[cells].reshape(-1, 3), [[900.0, 0, 0]]])
    imported = read(Geometry(file=write_mesh(nodes, apart)))
    assert len(imported.nodes) == len(np.unique(cells))


def test_surface_is_welded_together(file_heart, write_surface):
    mesh = file_heart.mesh
    imported = read(
        Geometry(file=write_surface(file_heart.nodes, np.vstack([mesh.endo, mesh.epi, mesh.base])), remesh=True)
    )
    assert len(imported.cells) == 0 and len(imported.triangles) == len(mesh.endo) + len(mesh.epi) + len(mesh.base)
    assert len(imported.nodes) == 2 + len(imported.triangles) // 2


@pytest.mark.parametrize(
    ("suffix", "content"), [("vtu", "hello"), ("vtk", ""), ("msh", "hello"), ("stl", "hello"), ("ply", "hello")]
)
def test_file_that_cannot_be_read(tmp_path, capfd, suffix, content):
    file = tmp_path / f"bad.{suffix}"
    file.write_text(content)
    with pytest.raises(
        GeometryError, match=rf"bad\.{suffix}: .*(cannot be read as|is empty).*: write the file again"
    ) as caught:
        read(Geometry(file=str(file)))
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_file_cut_short(file_heart, write_mesh, monkeypatch):
    file = write_mesh(file_heart.nodes, file_heart.mesh.cells)
    monkeypatch.undo()  # VTK reads in a process of its own
    whole = Path(file).read_bytes()
    Path(file).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(GeometryError, match=r"heart\.vtu: .*write the file again"):
        read(Geometry(file=file))


REFUSED = {
    "heart.dat": r"ends in \.dat: give tetrahedra as \.vtu, \.vtk, \.msh, or a closed surface of the wall as \.stl",
    "gone.vtu": r"gone\.vtu: geometry\.file does not exist: give its path",
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_or_missing_file(name):
    with pytest.raises(GeometryError, match=REFUSED[name]):
        read(Geometry(file=name))


def test_triangles_where_tetrahedra_belong(tmp_path):
    pyvista.Sphere().cast_to_unstructured_grid().save(tmp_path / "flat.vtu")
    with pytest.raises(GeometryError, match=r"holds no tetrahedra: give tetrahedra as .* or a closed surface"):
        read(Geometry(file=str(tmp_path / "flat.vtu")))


def test_hexahedra_are_refused(tmp_path):
    grid = pyvista.StructuredGrid(*np.meshgrid(*[np.arange(3.0)] * 3)).cast_to_unstructured_grid()
    grid.save(tmp_path / "bricks.vtu")
    with pytest.raises(GeometryError, match="holds cells of the kind hexahedron: split them into tetrahedra"):
        read(Geometry(file=str(tmp_path / "bricks.vtu")))


def test_points_that_are_no_numbers(file_heart, write_mesh):
    nodes = file_heart.nodes.copy()
    nodes[3] = np.nan
    with pytest.raises(GeometryError, match="points that are not finite numbers: repair the file"):
        read(Geometry(file=write_mesh(nodes, file_heart.mesh.cells)))


def test_fingerprint_is_that_of_the_content(file_heart, write_mesh):
    file = write_mesh(file_heart.nodes, file_heart.mesh.cells)
    before = fingerprint(Geometry(file=file))
    write_mesh(file_heart.nodes + 1, file_heart.mesh.cells)
    assert len(before) == 16 and fingerprint(Geometry(file=file)) != before
    assert fingerprint(Geometry()) == ""


def ply(points, triangles):
    """Text of a .ply of triangles."""
    about = f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
    about += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, row)) for row in [*points.tolist(), *([3, *row] for row in triangles.tolist())]]
    return "ply\nformat ascii 1.0\n" + about + "\n".join(rows) + "\n"


def vtk(points, cells):
    """Text of a .vtk of tetrahedra."""
    rows = [f"POINTS {len(points)} double", *(" ".join(map(str, row)) for row in points.tolist())]
    rows += [f"CELLS {len(cells)} {5 * len(cells)}", *(" ".join(map(str, [4, *row])) for row in cells.tolist())]
    rows += [f"CELL_TYPES {len(cells)}", *["10"] * len(cells)]
    return "# vtk DataFile Version 3.0\nheart\nASCII\nDATASET UNSTRUCTURED_GRID\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize(("text", "corners", "point"), [(ply, 3, 10**7), (vtk, 4, -1), (vtk, 4, 200)])
def test_cell_of_a_point_that_is_not_there(tmp_path, text, corners, point):
    """Of the largest VTK's reader of .ply goes on to addresses that are not its own, and its process ends."""
    points, cells = np.random.default_rng(0).random((200, 3)), np.arange(198 // corners * corners).reshape(-1, corners)
    file = tmp_path / f"bad.{text.__name__}"
    cells[7, 1] = point
    file.write_text(text(points, cells))
    named = f"cell 7 names the point {point}, and its points are 0 to 199"
    ended = "its sizes or indices are wrong, the reader ends on them"
    with pytest.raises(GeometryError, match=rf"bad\..* \(({named}|{ended})\): write the file again"):
        read(Geometry(file=str(file), remesh=True))


def test_cells_with_too_few_points(file_heart, write_mesh, monkeypatch):
    file = Path(write_mesh(file_heart.nodes, file_heart.mesh.cells[:, :4]))
    monkeypatch.undo()
    pyvista.read(file).save(file, binary=False)
    text = file.read_text()
    assert text.count(" 10 10 10") > 1
    file.write_text(text.replace(" 10 10 10", " 10 24 10", 1))
    with pytest.raises(GeometryError, match=r"cell \d+ has 4 points and must have 10\): write the file again"):
        read(Geometry(file=str(file)))
