"""Labels of the tissue at every pixel, against the scatterers that make the image, which are carried forwards."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import random, scene

from echotruth.config import Config, Rf
from echotruth.imaging.labels import TissueLabel, unpack
from echotruth.imaging.medium.anatomy import FOLLOWING_BASE
from echotruth.imaging.medium.mitral_valve import Leaflets, Part
from echotruth.imaging.medium.papillary_muscles import PapillaryMuscles
from echotruth.imaging.medium.surroundings import Surroundings
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.units import mm

CONFIG = Config.model_validate(
    {
        "phantom": {"density_per_mm3": 2000.0},
        "realism": {"preset": "mouse", "surroundings": {"density": 1.0}},
        "views": {"preset": "echo"},
    }
)
AXIAL = (np.arange(160) + 0.5) * 12e-3 / 160
LATERAL = AXIAL - 6e-3
EJECTED = np.array([0.0, 0.0, 0.5, 1.0, 1.0, 0.6, 0.2, 0.1])
"""Course of a cycle: isovolumic, ejection, isovolumic, filling."""
ES = 3


@pytest.fixture(scope="module")
def heart(twisting_heart, coarse_mesh):
    """A ventricle that narrows by a fifth, turns by 3 degrees, and whose base descends by 0.5 mm, as it empties."""
    x, y, _ = coarse_mesh.nodes.T
    moves = np.column_stack([-0.2 * x - 0.05 * y, -0.2 * y + 0.05 * x, np.full_like(x, -0.5e-3)])
    arrays = {"geometry": {"endo": coarse_mesh.endo, "epi": coarse_mesh.epi}}
    return replace(twisting_heart, displacement=EJECTED[:, None, None] * moves, es=ES, arrays=arrays)


@pytest.fixture(scope="module", params=["mid", "four_chamber"])
def at(request, heart):
    return scene(CONFIG, heart, request.param)


@pytest.fixture(scope="module")
def plane(at):
    return at.plane


@pytest.fixture(scope="module")
def truth(heart, plane):
    return pixel_truth(heart, plane, AXIAL, LATERAL, TissueImages(CONFIG, heart, plane, AXIAL, LATERAL))


def labels_at(label, position, axial=AXIAL, lateral=LATERAL):
    """Labels at positions in the image (n, 3), m, of those near the plane and away from borders between labels."""
    spacing = axial[1] - axial[0]
    column, row = (np.rint((position[:, k] - at[0]) / spacing).astype(int) for k, at in ((0, lateral), (1, axial)))
    inside = (np.minimum(row, column) > 0) & (np.maximum(row, column) < len(axial) - 1)
    inside &= np.abs(position[:, 2]) < 80e-6
    row, column = row[inside], column[inside]
    around = np.stack([label[row + i, column + j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    even = (around == around[4]).all(axis=0)
    return np.flatnonzero(inside)[even], around[4][even]


def test_the_wall_of_the_tissues_is_that_of_the_other_labels(truth):
    mask = unpack(truth["labels"])["mask"]
    assert ((truth["tissue"] == TissueLabel.WALL) == mask).all() and mask.any((1, 2)).all()


def test_scatterers_around_the_heart_are_in_pixels_of_their_label(at, truth):
    around = Surroundings.seed(at)
    seen = set()
    # Others come out of the wall as it draws back, and their label is that of what is beside them.
    visible = around.present(0, around.positions(0))
    for frame in (0, 2, ES):
        position = around.positions(frame)
        present = visible & around.present(frame, position)
        index, label = labels_at(truth["tissue"][frame], position[present])
        own = around.tissue[present][index]
        # The atria, which follow the base, and the chest wall, which is at rest, lie over what moves otherwise.
        over = np.isin(label, (*FOLLOWING_BASE, TissueLabel.CHEST_WALL)) & (own == TissueLabel.OTHER)
        for tissue in np.unique(own[~over]):
            number = (own == tissue).sum()
            # Thin walls have few pixels that do not touch another label.
            if number > 30:
                seen.add(int(tissue))
                alike = label[~over & (own == tissue)] == tissue
                labels = np.bincount(label[~over & (own == tissue)])
                assert alike.mean() > 0.97, (frame, TissueLabel(tissue).name, labels)
        assert over.mean() < 0.1
    assert {TissueLabel.OTHER, TissueLabel.RIGHT_VENTRICLE, TissueLabel.LUNG, TissueLabel.CHEST_WALL} <= seen
    beyond = np.hypot(LATERAL, AXIAL[:, None]) > 12e-3
    assert beyond.sum() > 100 and not truth["tissue"][:, beyond].any()


def test_bodies_in_the_cavity_are_where_their_scatterers_are(at, heart, plane):
    dense = CONFIG.model_copy(update={"phantom": CONFIG.phantom.model_copy(update={"density_per_mm3": 2e4})})
    drawn = [Leaflets.seed(replace(at, random=lambda _, k=k: random(f"leaflets {k}"))) for k in range(10)]
    joined = (np.concatenate([getattr(each, name) for each in drawn]) for name in ("part", "place", "amplitude"))
    valve = Leaflets(at, *joined)
    muscles = PapillaryMuscles.seed(replace(at, config=dense))
    is_long_axis = plane.axes[1, 2] != 0
    body, tissue = (valve, TissueLabel.MITRAL_LEAFLET) if is_long_axis else (muscles, TissueLabel.PAPILLARY_MUSCLE)
    middle = body.positions(0).mean(axis=0)
    axial, lateral = (middle[k] + np.arange(-80, 80) * 25e-6 for k in (1, 0))
    images = TissueImages(CONFIG, heart, plane, axial, lateral)
    # At end-systole the muscles are below the mid plane.
    for frame in (0, 2, 6):
        image = images(frame)
        position = body.positions(frame)
        if is_long_axis:
            position = position[valve.part != Part.CHORDA]
        _, label = labels_at(image, position, axial, lateral)
        assert len(label) > 100
        assert (label == tissue).mean() > 0.9, (frame, tissue.name, np.bincount(label))


def test_cavity_and_right_ventricle_narrow_as_the_heart_does_and_the_docs_say(heart):
    """The right ventricle loses 40 % of its width; the cavity narrows by a fifth both ways, and descends by 0.5 mm."""
    at = imaging_plane(CONFIG.views["mid"], CONFIG.rf, heart.endo_at_ed)
    # A sector in which all of the right ventricle is seen.
    images = TissueImages(CONFIG.model_copy(update={"rf": Rf(sector_deg=110)}), heart, at, AXIAL, LATERAL)
    ed, es = (images(frame) for frame in (0, ES))
    blood = (TissueLabel.CAVITY, TissueLabel.PAPILLARY_MUSCLE)
    areas = [np.isin(image, blood).sum() for image in (ed, es)]
    level, length = at.origin[2], heart.endo_at_ed[:, 2].min()
    before, now = (1 - (height / length) ** 2 for height in (level, level + 0.5e-3))
    assert areas[1] / areas[0] == pytest.approx((0.8**2 + 0.05**2) * now / before, rel=0.02)
    middle = np.abs(AXIAL - CONFIG.rf.focus_mm * mm).argmin()
    row = np.s_[middle - 3 : middle + 4]
    # Of the right ventricle at end-diastole, the pixels inside the septum are those of the wall.
    septum = [pixel_truth(heart, at, AXIAL, LATERAL, images)["tissue"][frame][row] for frame in (0, ES)]
    widths = [(each == TissueLabel.RIGHT_VENTRICLE).sum(axis=1).mean() for each in septum]
    assert widths[1] / widths[0] == pytest.approx(0.6, abs=0.04)


def test_there_is_no_gap_between_an_atrium_and_the_lung_beside_it(heart):
    at = imaging_plane(CONFIG.views["four_chamber"], CONFIG.rf, heart.endo_at_ed)
    images = TissueImages(CONFIG, heart, at, AXIAL, LATERAL)
    for frame in (0, 2, ES):
        gaps = []
        for row in images(frame):
            # At the base the mitral annulus lies on the wall.
            wall = np.flatnonzero(np.isin(row, (TissueLabel.ATRIAL_WALL, TissueLabel.MITRAL_LEAFLET)))
            lung = np.flatnonzero(row == TissueLabel.LUNG)
            blood = np.flatnonzero(row == TissueLabel.LEFT_ATRIUM)
            # Of the rows that cut the lateral wall of the left atrium, which has the lung on its other side.
            if len(blood) and len(wall) and len(lung) and blood[-1] < wall[-1]:
                gaps.append(lung[lung > wall[-1]].min() - wall[-1] - 1)
        assert len(gaps) > 15 and max(gaps) <= 1, (frame, gaps)


def test_a_label_says_what_is_there_however_faint_its_echo(heart):
    at = imaging_plane(CONFIG.views["four_chamber"], CONFIG.rf, heart.endo_at_ed)
    faint = {"preset": "mouse", "neighbours": {"lung_dB": -60, "chambers_dB": -60}, "blood": {"level_dB": -70}}
    config = Config.model_validate({"realism": faint, "views": {"preset": "echo"}})
    bright, dark = (TissueImages(each, heart, at, AXIAL, LATERAL)(ES) for each in (CONFIG, config))
    assert (bright == dark).all() and (dark == TissueLabel.LUNG).any()


def test_what_is_off_has_no_label(heart):
    at = imaging_plane(CONFIG.views["four_chamber"], CONFIG.rf, heart.endo_at_ed)
    off = {"leaflets_dB": None, "papillary_muscles_dB": None, "lung_dB": None, "chambers_dB": None}
    config = Config.model_validate({"realism": {"preset": "mouse", "neighbours": off}})
    found = set(np.unique(TissueImages(config, heart, at, AXIAL, LATERAL)(0)).tolist())
    assert found == {TissueLabel.OTHER, TissueLabel.CAVITY, TissueLabel.CHEST_WALL}
    assert "tissue" not in pixel_truth(heart, at, AXIAL[::8], LATERAL[::8])
