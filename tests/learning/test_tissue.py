"""Labels of all tissues, of a sweep in which one heart has neighbours and the other has none."""

import learning_repository
import numpy as np
import pytest
from finished_repository import configured, finish

import echotruth as et
from echotruth import learning
from echotruth.config import Bmode, Motion
from echotruth.config.motion import Affine
from echotruth.imaging.labels import TissueLabel
from echotruth.repository.check import check
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.overlay import pictures
from echotruth.viewer import clip as viewer
from echotruth.viewer.points import Points
from echotruth.viewer.tint import tint

NONE, MOUSE = 0, 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    motion = Motion(kind="affine", affine=Affine(gradient=learning_repository.GRADIENT))
    config = configured(
        name="tissues",
        views=("mid",),
        cases={"realism.preset": ["none", "mouse"]},
        bmode=Bmode(size_px=64, downsampling=(2,)),
        motion=motion,
    )
    return finish(tmp_path_factory.mktemp("tissues"), config, learning_repository.of_job)


def test_every_heart_has_its_tissues(folder):
    repository = et.Repository(folder)
    found = [repository.clip(case, "mid", variables=["tissue", "mask"]) for case in repository.cases.index]
    for clip in found:
        np.testing.assert_array_equal(clip["tissue"] == TissueLabel.WALL, clip["mask"])
    tissues = [set(np.unique(clip["tissue"]).tolist()) for clip in found]
    assert tissues[NONE] == {TissueLabel.OTHER, TissueLabel.CAVITY, TissueLabel.WALL}
    assert tissues[MOUSE] > tissues[NONE] | {TissueLabel.RIGHT_VENTRICLE, TissueLabel.LUNG, TissueLabel.CHEST_WALL}
    assert not check(folder).faults


def test_segmentation_and_clips_have_them(folder):
    items = learning.Segmentation(folder, views=["mid"], target="tissue")
    clips = learning.Clips(folder, views=["mid"], truth=["tissue"])
    expected = et.Repository(folder).clip(items[-1]["case"], "mid")["tissue"].values
    np.testing.assert_array_equal(items[-1]["label"], expected[-1])
    np.testing.assert_array_equal(clips[MOUSE]["tissue"], expected)


def test_the_viewer_names_and_colours_them(folder):
    repository = et.Repository(folder)
    shown = viewer.Clip(repository, repository.cases.index[MOUSE], "mid", 32)
    colours = tint(shown, Points(shown), "tissue", "", None)
    np.testing.assert_array_equal(colours.index, shown.tissue())
    assert colours.names[TissueLabel.RIGHT_VENTRICLE] == "right ventricle"
    assert len(set(colours.palette)) == len(colours.names) == max(TissueLabel)


def test_they_are_drawn_over_images(folder):
    repository = et.Repository(folder)
    clip = ExportedClip(repository, repository.every[repository.cases.index[MOUSE]], "mid", 32)
    drawn, tissue = pictures(clip, ["tissue"])[0], clip.truth("tissue")["tissue"].values[0]
    grey = np.repeat(clip.image[0][..., None], 3, axis=-1)
    np.testing.assert_array_equal((drawn != grey).any(axis=-1)[tissue == 0], False)
    assert (drawn != grey).any(axis=-1)[tissue > 0].all()
