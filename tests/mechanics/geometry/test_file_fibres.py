"""Directions that came with a file."""

import numpy as np
import pytest

from echotruth.config import Fibres, Geometry
from echotruth.mechanics.fibres import CENTROID, fibre_frames, wall_depth
from echotruth.mechanics.geometry import GeometryError, left_ventricle


@pytest.fixture(scope="module")
def frames(file_heart):
    """Fibre, sheet and normal of the rule, one a cell, in the heart frame."""
    return fibre_frames(file_heart.mesh, wall_depth(file_heart.mesh), Fibres(), CENTROID)[:, 0]


@pytest.fixture
def file(file_heart, frames, write_mesh):
    fibre, sheet = (frames[:, k] @ file_heart.turn for k in (0, 1))
    arrays = {"f": 2 * fibre, "s": sheet + 0.3 * fibre, "one": np.tile([0, 0, 1.0], (len(fibre), 1))}
    zero = fibre.copy()
    zero[:4] = 0
    return write_mesh(file_heart.nodes, file_heart.mesh.cells, **arrays, zero=zero, number=np.ones(len(fibre)))


@pytest.fixture
def septum(file_heart):
    return (file_heart.shift + 9 * file_heart.turn[0]).tolist()


def test_directions_are_turned_with_the_heart(frames, file, septum):
    mesh = left_ventricle(Geometry(file=file, septum_point=septum, fibre="f", sheet="s"))
    np.testing.assert_allclose(mesh.fibre, frames[:, 0], atol=1e-6)
    np.testing.assert_allclose(mesh.sheet, frames[:, 1], atol=1e-6)


def test_new_elements_take_the_directions_of_the_nearest(frames, file, septum, file_heart):
    mesh = left_ventricle(Geometry(file=file, septum_point=septum, fibre="f", sheet="s", remesh=True))
    np.testing.assert_allclose(np.linalg.norm(mesh.fibre, axis=1), 1)
    np.testing.assert_allclose(np.einsum("ci,ci->c", mesh.fibre, mesh.sheet), 0, atol=1e-12)
    rule = fibre_frames(mesh, wall_depth(mesh), Fibres(), CENTROID)[:, 0, 0]
    assert np.median(np.abs(np.einsum("ci,ci->c", mesh.fibre, rule))) > 0.9


def test_no_directions_without_the_key(file):
    mesh = left_ventricle(Geometry(file=file))
    assert mesh.fibre is None and mesh.sheet is None


REFUSED = {
    ("g", None): r"geometry\.fibre = 'g' is no array of the file: its arrays over cells are f, number, one, s, zero",
    (
        "one",
        None,
    ): r"has one direction in all of the wall, a placeholder: leave it out to use the rule of the section fibres",
    ("zero", None): r"geometry\.fibre = 'zero' is zero in 4 cells",
    ("number", None): r"geometry\.fibre = 'number' is not an array of three components",
    ("f", "f"): r"geometry\.sheet = 'f' lies along the fibres in \d+ cells",
}


@pytest.mark.slow
@pytest.mark.parametrize(("fibre", "sheet"), REFUSED)
def test_refused(file, fibre, sheet):
    with pytest.raises(GeometryError, match=REFUSED[fibre, sheet]):
        left_ventricle(Geometry(file=file, fibre=fibre, sheet=sheet))
