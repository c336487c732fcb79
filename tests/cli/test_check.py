"""`echotruth check` of a configuration reads what it names."""

import numpy as np
import pytest
import pyvista
import yaml

from echotruth.config import Geometry
from echotruth.loop.cycle import SHIPPED
from echotruth.mechanics.geometry import left_ventricle

FEW = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}


@pytest.fixture(scope="module")
def heart():
    mesh = left_ventricle(Geometry(**FEW))
    used, number = np.unique(mesh.cells[:, :4], return_inverse=True)
    return 1e3 * mesh.nodes[used], number.reshape(-1, 4)


@pytest.fixture
def check(call, tmp_path, monkeypatch):
    """Status and output of the check of a configuration."""
    monkeypatch.chdir(tmp_path)

    def of(**sections):
        (tmp_path / "mine.yaml").write_text(yaml.safe_dump({"name": "mine"} | sections))
        status, output, errors = call("check", "mine.yaml")
        return status, output + errors

    return of


def save(nodes, cells, name):
    pyvista.UnstructuredGrid({10: cells.astype(np.int64)}, nodes).save(name)


def test_mesh_that_is_no_heart(check, heart):
    nodes, cells = heart
    save(nodes, cells, "heart.vtu")
    assert "valid" in check(geometry={"file": "heart.vtu", "unit": "mm"} | FEW)[1]
    save(nodes, cells[:4], "heart.vtu")
    status, output = check(geometry={"file": "heart.vtu", "unit": "mm"} | FEW)
    assert status == 1 and "valid" not in output and "echotruth: mine.yaml: heart.vtu: " in output
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("loop", "key"), [({"file": "mL.csv"}, "file = 'mL.csv'"), ({"edv_uL": 5e4}, "edv_uL = 50000")]
)
def test_volumes_of_another_unit_than_the_heart_are_told(check, tmp_path, loop, key):
    (tmp_path / "mL.csv").write_text((SHIPPED / "mouse.csv").read_text().replace("volume_uL", "volume_mL"))
    status, output = check(loop=loop)
    told = f"loop: {key}: the heart fills to 50,000 uL, and its cavity in the section geometry holds 32.8 uL: mend"
    assert status == 1 and output.startswith(f"echotruth: mine.yaml: {told}") and output.count("\n") == 1


def test_mesh_of_another_unit_than_the_loop_is_told(check, heart):
    save(*heart, "heart.vtu")
    status, output = check(geometry={"file": "heart.vtu", "unit": "cm", "remesh": True} | FEW)
    assert status == 1 and "fills to 50 uL, and its cavity in heart.vtu with geometry.unit = cm holds 3" in output


@pytest.mark.parametrize(("geometry", "loop"), [
    ({"dilation": 2.0}, {"kind": "circulation"}),
    ({"preset": "human", "dilation": 1.4}, {"edv_uL": 300_000, "esv_uL": 240_000}),
    ({"preset": "human", "scale": 0.3}, {}),
    ({"preset": "rat"}, {"edv_uL": 450, "esv_uL": 300}),
])  # fmt: skip
def test_unusual_hearts_are_valid(check, geometry, loop):
    assert check(geometry=geometry, loop=loop)[0] == 0


def test_surface_with_a_hole(check):
    pyvista.Sphere().extract_cells(range(100)).extract_surface(algorithm=None).save("wall.stl")
    status, output = check(geometry={"file": "wall.stl", "remesh": True})
    assert status == 1 and "mine.yaml: wall.stl: the surface does not close round the wall" in output


def test_motion_whose_frames_are_the_same(check, heart):
    for frame in range(3):
        save(*heart, f"frame_{frame}.vtu")
    motion = {"kind": "file", "file": {"path": "frame_*.vtu"}}
    status, output = check(motion=motion, loop={"heart_rate_per_min": 500})
    assert status == 1 and "frame_*.vtu: its points are the same in all 3 frames" in output


@pytest.mark.parametrize(("frames", "status"), [(3, 1), (20, 0)])
def test_frames_that_a_circulation_needs(check, frames, status):
    found, output = check(loop={"kind": "circulation", "frames": frames})
    told = "with 3 frames the loop has none of filling: raise loop.frames"
    assert found == status and (told in output) == (frames == 3)


def test_what_cannot_be_inferred_from(check):
    """As a run refuses it: a prior beyond the limits of its key, and a tracker of which no errors are known."""
    sections = {"tracking": {"trackers": {"dis": {"method": "dis"}}}, "bmode": {"size_px": 256, "downsampling": [1]}}
    status, output = check(inference={"tracker": "dis", "prior": {"fibres.endo_deg": [95, 8]}}, **sections)
    assert (
        status == 1 and "mine.yaml: inference: prior: fibres.endo_deg = [95.0, 8.0]: give a mean from -90 to" in output
    )
    status, output = check(inference={"tracker": "dis"}, **sections | {"bmode": {"size_px": 512}})
    assert status == 1 and "mine.yaml: inference: tracker: the error of dis at 512 px" in output
