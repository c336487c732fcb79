"""Reading a repository: what it says of itself, what it refuses, and that it gives what the store holds."""

import os
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace

import finished_repository
import numpy as np
import pytest
import xarray as xr
import zarr
from known_repository import FRAMES, SETTINGS, SIZES, make

import echotruth as et
from echotruth.imaging.truth import wall_mask
from echotruth.repository import estimates, remote
from echotruth.repository.datasets import imaged_heart
from echotruth.repository.group import NotWritten


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    return make(tmp_path_factory.mktemp("reader") / "known", SETTINGS)


@pytest.fixture
def repository(known):
    return et.Repository(known.folder)


@pytest.fixture
def several(tmp_path):
    """Three cases that are not made yet."""
    finished_repository.begin(tmp_path / "small", finished_repository.configured(seeds=(1, 2, 3)))
    return et.Repository(tmp_path / "small")


def stored(known, path):
    """The array of the only heart in the view mid, read by Zarr alone."""
    return np.asarray(zarr.open_array(known.folder / "known.zarr", path=f"clips/heart/mid/{path}", mode="r")[...])


def test_it_says_what_is_in_it(repository, known):
    assert repr(repository).splitlines() == [
        "Repository known",
        "  hearts    1 complete",
        "  views     mid (short axis), long (long axis)",
        f"  sizes     {SIZES[0]}, {SIZES[1]} px",
        "  trackers  one, two",
        f"  frames    {FRAMES}",
        f"  path      {known.folder}",
    ]


@pytest.mark.parametrize("form", ["folder", "text", "store"])
def test_folder_or_store_may_be_given(known, form):
    place = {"folder": known.folder, "text": f"{known.folder}/", "store": known.folder / "known.zarr"}[form]
    assert et.Repository(place).folder == known.folder


def test_values_are_those_of_the_store(repository, known):
    clip = repository.clip("heart", "mid", SIZES[1])
    np.testing.assert_array_equal(clip["image"], stored(known, f"bmode/{SIZES[1]}/image"))
    np.testing.assert_array_equal(clip["displacement"], stored(known, f"truth/{SIZES[1]}/displacement"))
    np.testing.assert_array_equal(repository.heart().displacement, known.heart.displacement)
    assert list(repository.cases["status"]) == ["complete"] and list(repository.cases["reason"]) == [""]
    assert repository.tree["clips/heart/mid/bmode/64/image"].shape == (FRAMES, SIZES[1], SIZES[1])


@pytest.mark.parametrize("view", ["mid", "long"])
def test_clip_is_read_without_its_heart_and_tells_its_plane_and_wall(known, tmp_path, view):
    folder = shutil.copytree(known.folder, tmp_path / "known")
    shutil.rmtree(folder / "known.zarr/hearts")
    clip, plane = et.Repository(folder).clip("heart", view, SIZES[1]), known.plane(view)
    np.testing.assert_array_equal(clip.attrs["plane_origin"], plane.origin)
    np.testing.assert_array_equal(clip.attrs["plane_axes"], plane.axes.ravel())
    wall = wall_mask(known.heart, plane, clip["grid_axial"].values, clip["grid_lateral"].values)
    np.testing.assert_array_equal(clip["grid_mask"], wall)
    assert wall.any() and not wall.all()
    assert imaged_heart(clip, known.heart)[0].displacement.shape == known.heart.displacement.shape
    with pytest.raises(ValueError, match="made of another heart"):
        imaged_heart(clip, replace(known.heart, displacement=2 * known.heart.displacement))


def test_curves_have_the_names_of_segments(repository):
    names = repository.curves()["aha_name"]
    assert names.sel(aha=[1, 7, 14, 17]).values.tolist() == ["basal anterior", "mid anterior", "apical septal", "apex"]


def test_tracked_arrays_are_those_of_their_size_and_tracker(repository):
    tracks = repository.tracks("heart", "mid", SIZES[1])
    assert list(tracks["tracker"]) == ["one", "two"] and tracks["true_displacement"].dims[-1] == "vector"
    for tracker, value in (("one", 1e-4), ("two", 2e-4)):
        found = tracks["displacement"].sel(tracker=tracker).values
        np.testing.assert_allclose(found, value, atol=known_step(tracks))
        alone = estimates.tracked(repository, "heart", "mid", tracker, SIZES[1], "displacement")["displacement"]
        np.testing.assert_array_equal(alone, found)
    together = estimates.each(repository, "heart", "mid", SIZES, ["two", "one"], "displacement", "tracked_rotation")
    for (size, tracker, arrays), expected in zip(together, 2 * [(0.23, 2e-4), (0.13, 1e-4)], strict=True):
        assert size in SIZES and tracker in ("one", "two")
        np.testing.assert_allclose(arrays["tracked_rotation"], expected[0], rtol=1e-6)
        np.testing.assert_allclose(arrays["displacement"], expected[1], atol=known_step(tracks))


def known_step(tracks):
    """Step to which displacements are rounded, m."""
    return tracks["displacement"].attrs["quantum"]


def test_what_may_be_left_out_is_the_only_heart_the_main_view_the_largest_size_and_the_last_tracker(repository):
    assert repository.clip().attrs["view"] == "mid" and repository.clip().sizes["axial"] == SIZES[0]
    curves = repository.curves()
    assert (curves.attrs["case"], curves.attrs["view"], curves.attrs["tracker"]) == ("heart", "mid", "two")


def test_heart_has_to_be_named_where_there_are_several(several):
    with pytest.raises(ValueError, match=r"^case: .*small has 3 hearts: give one of heart, seed2_\w+, seed3_\w+\.$"):
        several.heart()
    assert "3 unfinished" in repr(several)


REFUSED = {
    "case": (lambda read: read.clip("hart"), r"^case = 'hart': use one of heart\.$"),
    "view": (lambda read: read.clip(view="front"), r"^view = 'front': use one of mid, long\.$"),
    "size": (lambda read: read.clip(size=100), r"^size = 100: use one of 128, 64"),
    "variable": (lambda read: read.clip(variables="speed"), r"^variables: 'speed': use any of displacement"),
    "tracker": (lambda read: read.curves(tracker="three"), r"^tracker = 'three': use one of one, two\.$"),
    "trackers": (lambda read: read.tracks(trackers=["three"]), r"^tracker = 'three': use one of one, two\.$"),
    "views": (lambda read: read.summary(views="front"), r"^view = 'front': use one of mid, long\.$"),
    "twist": (lambda read: read.twist(), "^Twist needs two short-axis views"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_there_is_not_is_refused_in_one_sentence(repository, what):
    call, expected = REFUSED[what]
    with pytest.raises(ValueError, match=expected) as caught:
        call(repository)
    assert "\n" not in str(caught.value)


def test_heart_that_is_not_made_is_refused_in_one_sentence(several):
    with pytest.raises(NotWritten, match=r"has no group hearts/heart/geometry: run its configuration, which makes it"):
        several.heart("heart")
    with pytest.raises(ValueError, match=r"has no group clips/heart/mid/(bmode|truth)/64: run its configuration"):
        several.clip("heart", "mid")


def test_script_may_go_to_another_folder_before_and_while_it_reads(known, tmp_path):
    """The name of the script is a path of its own folder."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "analyse.py").write_text(
        "import os, sys\nimport echotruth as et\n"
        "os.chdir('elsewhere')\nread = et.Repository(sys.argv[1])\nos.chdir('..')\n"
        "print(read.clip(size=64)['image'].shape, read.curves(tracker='one').attrs['view'], len(read.scores))\n"
    )
    place = os.path.relpath(known.folder, tmp_path / "elsewhere")
    command = [sys.executable, "analyse.py", place]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == (f"({FRAMES}, 64, 64) mid 8\n", "")


def test_array_of_an_earlier_format_is_not_read(known, tmp_path):
    """Its codecs may be any of numcodecs, of which one is the pickle."""
    folder = shutil.copytree(known.folder, tmp_path / "known")
    array = folder / f"known.zarr/clips/heart/mid/bmode/{SIZES[0]}/image"
    shape = et.Repository(folder).array(f"bmode/{SIZES[0]}/image", "heart", "mid").shape
    shutil.rmtree(array)
    zarr.create_array(array, shape=shape, dtype="uint8", zarr_format=2)
    with pytest.raises(NotWritten, match=f"bmode/{SIZES[0]}/image has no data of heart mid"):
        et.Repository(folder).read(f"bmode/{SIZES[0]}/image", "heart", "mid")


def test_lost_file_is_told_where_a_part_is_read(known, tmp_path):
    folder = shutil.copytree(known.folder, tmp_path / "known")
    shutil.rmtree(folder / f"known.zarr/clips/heart/mid/bmode/{SIZES[0]}/image/c")
    with pytest.raises(NotWritten, match="image has lost its data: `echotruth check` of the repository names"):
        et.Repository(folder).read(f"bmode/{SIZES[0]}/image", "heart", "mid", 0)


def test_scores_have_a_row_for_every_clip_and_tracker(repository):
    scores = repository.scores
    assert len(scores) == 2 * 2 * 2 and set(scores["failure"]) == {""}
    assert list(scores["size_px"].unique()) == list(SIZES)


def test_copy_reads_the_same_and_has_nothing_open(repository):
    image = repository.read(f"bmode/{SIZES[0]}/image", "heart", "mid")
    copy = pickle.loads(pickle.dumps(repository))
    assert not copy._opened and repository._opened
    np.testing.assert_array_equal(copy.clip()["image"], image)


def test_bucket_is_read_as_a_folder_is(repository, known, monkeypatch):
    """Here the bucket is a folder, in place of a server."""
    store = pytest.importorskip("obstore").store
    place = known.folder.as_posix()
    monkeypatch.setattr(remote, "_store", lambda url: store.LocalStore(url.replace("s3://bucket", place)))
    for address in ("s3://bucket", "s3://bucket/known.zarr"):
        distant = et.Repository(address)
        assert repr(distant).splitlines()[:-1] == repr(repository).splitlines()[:-1]
        xr.testing.assert_identical(distant.clip(size=SIZES[1]), repository.clip(size=SIZES[1]))
        xr.testing.assert_identical(distant.tracks(), repository.tracks())
        assert distant.scores.equals(repository.scores) and distant.config == repository.config
    with pytest.raises(FileNotFoundError, match=r"known\.zarr: is an address and not a folder: download it"):
        distant.folder  # noqa: B018 - it is asked for
    with pytest.raises(FileNotFoundError, match="s3://bucket/cases: is not a repository"):
        et.Repository("s3://bucket/cases")
