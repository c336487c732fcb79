"""NIfTI, read by nibabel: grey levels, spacing, frame time, and where in the heart a voxel is."""

import numpy as np
import pytest
from known_repository import FRAMES, SIZES

nibabel = pytest.importorskip("nibabel")

BLOCK = (104, 24)
"""Column and row in the bright block."""


def test_grey_levels_are_lateral_by_axial_by_frame(exported, known):
    data = np.asarray(nibabel.load(exported("nifti")).dataobj)
    assert (data.shape, data.dtype) == ((SIZES[0], SIZES[0], 1, FRAMES), np.uint8)
    np.testing.assert_array_equal(data[:, :, 0].transpose(2, 1, 0), known.images(SIZES[0]))
    assert data[BLOCK][0].tolist() == [220] * FRAMES


@pytest.mark.parametrize("size", SIZES)
def test_spacing_is_in_millimetres_and_the_frame_time_in_seconds(exported, size):
    header = nibabel.load(exported("nifti", size=size)).header
    assert header.get_xyzt_units() == ("mm", "sec")
    np.testing.assert_allclose(header.get_zooms(), (12 / size, 12 / size, 12 / size, 0.12 / FRAMES), rtol=1e-6)


@pytest.mark.parametrize("view, codes", [("mid", "LPS"), ("long", None)])
def test_voxels_lie_where_they_are_in_the_heart(exported, known, view, codes):
    """In a short axis, lateral is -x and axial -y (docs/conventions.md); the array is 6 mm above the long axis."""
    image = nibabel.load(exported("nifti", view))
    assert int(image.header["sform_code"]) == int(image.header["qform_code"]) == 2
    np.testing.assert_allclose(image.get_qform(), image.get_sform(), atol=1e-5)
    place = nibabel.affines.apply_affine(image.affine, [*BLOCK, 0])
    lateral, axial = (BLOCK[0] + 0.5) * 12 / SIZES[0] - 6, (BLOCK[1] + 0.5) * 12 / SIZES[0]
    plane = known.plane(view)
    np.testing.assert_allclose(place, 1e3 * plane.origin + lateral * plane.axes[0] + axial * plane.axes[1], atol=1e-5)
    if codes:
        assert "".join(nibabel.aff2axcodes(image.affine)) == codes
        assert place[0] == pytest.approx(-lateral, abs=1e-5)
        assert place[2] == pytest.approx(0.5e3 * known.heart.endo_at_ed[:, 2].min(), rel=1e-6)
    else:
        assert np.argmax(image.affine[:3, 1]) == 2  # away from the array is from apex to base


def test_bytes_are_the_same_twice(exported):
    assert exported("nifti").read_bytes() == exported("nifti").read_bytes()
