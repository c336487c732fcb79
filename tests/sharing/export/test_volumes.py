"""Volumes in files and in pairs to learn from: their places, and the motion, which is a shift."""

import re
from contextlib import chdir
from itertools import product

import numpy as np
import pytest
import yaml
from finished_repository import finish, solved
from volume_repository import CONFIG, SHIFT

import echotruth as et
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.learning import Clips, VolumePairs
from echotruth.sharing.export import Export, ExportError
from echotruth.sharing.release import release
from echotruth.sharing.release.attribution import Attribution

STEP = 0.3e-3 / 256


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    config = et.configure(yaml.safe_load(CONFIG))
    return et.Repository(finish(tmp_path_factory.mktemp("made") / "tiny", config, solved))


@pytest.fixture(scope="module")
def exported(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("exported")

    def of(name):
        (path,) = (work := Export(made, name, output=folder)).write(work.clips()[0])
        return path

    return of


def places(repository, voxels):
    """Voxels (n, 3; axial, elevation, lateral) in the frame of the heart, m."""
    axial, elevation, lateral = (
        along[of] for along, of in zip(voxel_centres(repository.config), voxels.T, strict=True)
    )
    return repository.plane("heart", "whole").to_heart(np.column_stack([lateral, axial, elevation]))


CORNERS = np.array(list(product((0, 23), (0, 23), (0, 17))))


def test_nifti_has_the_volumes_where_they_are_in_the_heart(made, exported):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.load(exported("nifti"))
    np.testing.assert_array_equal(np.asarray(image.dataobj).transpose(3, 1, 2, 0), made.clip()["image"])
    np.testing.assert_allclose(image.header.get_zooms()[:3], [6.9 / 18, 6.9 / 24, 8.6 / 24], rtol=1e-6)
    found = nibabel.affines.apply_affine(image.affine, CORNERS[:, [2, 0, 1]])
    np.testing.assert_allclose(found, 1e3 * places(made, CORNERS), atol=1e-5)


def test_vti_has_the_volumes_where_they_are_and_the_shift_of_the_wall(made, exported):
    import pyvista

    folder, clip = exported("vti"), made.clip()
    assert len(list(folder.glob("*.vti"))) == 3 and "heart_whole_001.vti" in (folder / "heart_whole.pvd").read_text()
    grid = pyvista.read(folder / "heart_whole_001.vti")
    images = grid["image"].reshape(grid.dimensions[::-1]).transpose(1, 0, 2)
    np.testing.assert_array_equal(images, clip["image"][1])
    number = np.ravel_multi_index(CORNERS[:, [1, 0, 2]].T, grid.dimensions[::-1])
    np.testing.assert_allclose(np.array(grid.points)[number], places(made, CORNERS), atol=1e-8)
    wall = np.isfinite(grid["displacement"]).all(1)
    np.testing.assert_array_equal(wall, grid["layer"] > 0)
    axes = made.plane("heart", "whole").axes
    np.testing.assert_allclose(grid["displacement"][wall] @ axes.T, np.broadcast_to(SHIFT, (wall.sum(), 3)), atol=STEP)


def test_paths_of_points_begin_in_the_wall_and_are_shifted(made, exported):
    found, clip = np.load(exported("tap")), made.clip()
    np.testing.assert_array_equal(found["video"], clip["image"])
    shape = np.array([18, 24, 24])
    voxel = np.rint(found["points"][:, 0] * shape - 0.5).astype(int)
    assert clip["mask"].values[tuple(voxel.T[::-1])].all() and len(voxel) > 20
    moved = (found["points"][:, 1] - found["points"][:, 0]) * shape * found["spacing_m"]
    np.testing.assert_allclose(moved, np.broadcast_to(SHIFT[[0, 2, 1]], moved.shape), atol=STEP)
    np.testing.assert_array_equal(found["occluded"], ((found["points"] < 0) | (found["points"] > 1)).any(-1))


def test_pairs_have_the_shift_from_one_volume_to_the_next(made):
    pairs = VolumePairs(made.folder)
    assert len(pairs) == 2
    np.testing.assert_allclose(pairs.spacing, [6.9e-3 / 18, 6.9e-3 / 24, 8.6e-3 / 24])
    for pair, share in zip(pairs, (1, -0.5), strict=True):
        wall = pair["wall"]
        labels = made.read("truth/volume/labels", "heart", "whole", pair["frame"], 0)
        np.testing.assert_array_equal(wall, labels > 0)
        flow = np.moveaxis(pair["flow_m"], 0, -1)
        np.testing.assert_allclose(flow[wall], np.broadcast_to(share * SHIFT, (wall.sum(), 3)), atol=STEP)
        assert (flow[~wall] == 0).all()
        np.testing.assert_allclose(pair["flow"] * pair["spacing"][:, None, None, None], pair["flow_m"], atol=1e-9)
        grey = made.clip()["image"].values[pair["frame"] : pair["frame"] + 2]
        np.testing.assert_allclose(pair["image"], grey / 255, atol=1e-6)


def test_card_of_a_release_has_code_that_reads_volumes(made, tmp_path):
    release(made, tmp_path / "files", Attribution())
    text = (tmp_path / "files/README.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names = {}
    with chdir(tmp_path / "files"):
        exec(code.replace('["heart"])', '["heart"], to="../here")'), names)
    np.testing.assert_allclose(names["truth"]["displacement"].max(("axial", "elevation", "lateral")), SHIFT, atol=STEP)
    assert "every voxel" in text and "plane of a view" not in text


def test_what_holds_no_volumes_or_no_slices_is_refused(made, known):
    for name in ("mp4", "dicom", "csv", "uff"):
        with pytest.raises(
            ExportError, match=f"--format {name}: tiny has volumes, for which there are nifti, vtk, vti"
        ):
            Export(made, name)
    with pytest.raises(ExportError, match="has slices"):
        Export(et.Repository(known.folder), "vti")
    with pytest.raises(ValueError, match="Clips: needs slices, and tiny has volumes: take VolumePairs"):
        Clips(made.folder)
    with pytest.raises(ValueError, match=r"VolumePairs: needs volumes, and .* has slices"):
        VolumePairs(known.folder)
