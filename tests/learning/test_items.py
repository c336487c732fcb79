"""Items hold what the images and the motion of the heart are, and every process reads the same."""

import multiprocessing
import pickle
import shutil
from hashlib import sha256

import numpy as np
import pytest
import yaml
from learning_repository import GRADIENT

import echotruth as et
from echotruth import learning
from echotruth.config import Config
from echotruth.imaging.beamforming.scan import scan_width
from echotruth.imaging.flow import slice_thickness
from echotruth.mechanics.prescribed import motion_amplitude
from echotruth.units import mm

FRAMES, SIZE = 3, 64
KINDS = {
    "Clips": {"truth": ["displacement", "labels", "flow"], "heart": learning.clips.HEART},
    "FlowPairs": {},
    "PointTracks": {"start": None, "points": 20},
    "Segmentation": {"target": "segment"},
}


def sequence(repository, kind, **options):
    return getattr(learning, kind)(repository, **KINDS[kind] | options)


def digest(item):
    """Hash of all that an item holds."""
    parts = [f"{name} {np.asarray(value).dtype} {np.shape(value)}".encode() for name, value in item.items()]
    return sha256(b"".join(parts + [np.asarray(value).tobytes() for value in item.values()])).hexdigest()


def digests(items):
    return [digest(item) for item in items]


def moved(position, start, end):
    """Where the affine motion takes tissue from one frame to another; image axes about the fixed point, (n, 3), m."""
    amplitude = motion_amplitude("cosine", FRAMES)
    first, second = (np.eye(3) + amplitude[frame] * (np.array(GRADIENT) - np.eye(3)) for frame in (start, end))
    return position @ np.linalg.inv(first).T @ second.T


def coordinate(items, name):
    return items.repository.read(f"truth/{items.size}/{name}", *items.places[0])


def centres(items):
    """Pixel centres about the fixed point of the motion, which is at the transmit focus, (axial, lateral, 3), m."""
    index = (np.arange(items.size) - (items.size - 1) / 2) * items.spacing
    axial = coordinate(items, "axial") - items.repository.config.rf.focus_mm * mm
    return np.stack(np.broadcast_arrays(index, axial[:, None], 0.0), axis=-1)


@pytest.fixture(scope="module")
def linear(repository, tmp_path_factory):
    """A copy of the repository whose configuration has a linear scan."""
    folder = tmp_path_factory.mktemp("linear") / repository.name
    shutil.copytree(repository, folder)
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config["rf"]["scan"] = "linear"
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return folder


def quantum(items):
    """Step of the stored flow, m."""
    return items.repository.array(f"truth/{items.size}/flow", *items.places[0]).attrs["quantum"]


@pytest.mark.parametrize("size", [64, 32])
def test_flow_is_the_affine_motion_from_frame_to_frame(repository, size):
    pairs = learning.FlowPairs(repository, views=["mid"], size=size)
    for item in pairs[: FRAMES - 1]:
        expected = moved(centres(pairs), item["frame"], item["frame"] + 1) - centres(pairs)
        wall = item["wall"]
        assert wall.mean() > 0.05
        rounding = 0.501 * quantum(pairs)
        np.testing.assert_allclose(item["flow_m"][:, wall], expected[wall].T, rtol=0, atol=rounding)
        in_px = expected[wall, :2].T / pairs.spacing
        np.testing.assert_allclose(item["flow"][:, wall], in_px, rtol=0, atol=rounding / pairs.spacing)
        assert not item["flow"][:, ~wall].any()


def test_tissue_leaves_and_enters_where_the_motion_takes_it_beyond_half_the_slice(repository):
    pairs = learning.FlowPairs(repository, views=["mid"])
    axial, lateral = (coordinate(pairs, name) for name in ("axial", "lateral"))
    assert_leaves_and_enters(pairs, slice_thickness(Config(), np.hypot(axial[:, None], lateral)) / 2)


def test_slice_of_a_linear_scan_is_as_thick_as_at_its_depth(linear):
    pairs = learning.FlowPairs(linear, views=["mid"])
    axial = coordinate(pairs, "axial")
    assert_leaves_and_enters(pairs, slice_thickness(Config(), np.tile(axial[:, None], SIZE)) / 2)
    position, seen = (learning.PointTracks(linear, views=["mid"], points=200)[0][name] for name in NAMES)
    half = slice_thickness(Config(), position[..., 1]) / 2
    in_scan = np.abs(position[..., 0]) <= scan_width(pairs.repository.config.probe, pairs.repository.config.rf) / 2
    np.testing.assert_array_equal(seen, in_scan & (np.abs(position[..., 2]) <= half))


NAMES = ("position_m", "visible")


def assert_leaves_and_enters(pairs, half):
    """Assert that tissue leaves and enters a slice of half the thickness `half` (axial, lateral), m."""
    for item in pairs[: FRAMES - 1]:
        first, second = item["frame"], item["frame"] + 1
        forth, back = (moved(centres(pairs), *way)[..., 2] for way in ((first, second), (second, first)))
        after = learning.Segmentation(pairs.repository.folder, views=["mid"])[second]["label"].astype(bool)
        for name, wall, elevation in (("leaves", item["wall"], forth), ("enters", after, back)):
            beyond = np.abs(elevation) - half
            sure = np.abs(beyond) > quantum(pairs)
            np.testing.assert_array_equal(item[name][sure], (wall & (beyond > 0))[sure])
        assert item["leaves"].any() and item["enters"].any() and not item["leaves"][item["wall"]].all()


@pytest.mark.parametrize("start", [0, 1])
def test_points_move_with_the_tissue_and_are_seen_within_the_slice(repository, start):
    tracks = learning.PointTracks(repository, views=["mid"], points=50, start=start)
    item, focus = tracks[0], tracks.repository.config.rf.focus_mm * mm
    about = item["position_m"] - np.array([0, focus, 0], np.float32)
    expected = np.stack([moved(about[start].astype(float), start, frame) for frame in range(FRAMES)])
    np.testing.assert_allclose(about, expected, atol=1e-8)
    np.testing.assert_array_equal(item["position"][start], np.round(item["position"][start]))
    lateral, axial = item["position"][start].astype(int).T
    assert learning.FlowPairs(repository, views=["mid"])[start]["wall"][axial, lateral].all()
    half = slice_thickness(Config(), np.hypot(*np.moveaxis(item["position_m"][..., :2], -1, 0))) / 2
    np.testing.assert_array_equal(item["visible"], np.abs(item["position_m"][..., 2]) <= half)
    assert item["visible"][start].all() and not item["visible"].all()


def test_clip_is_that_of_the_notebook_with_channels_first(repository):
    clips = learning.Clips(repository, views=["long_axis"], size=32, truth=["displacement", "strain", "flow"])
    item = clips[0]
    clip = et.Repository(repository).clip(item["case"], "long_axis", 32)
    np.testing.assert_array_equal(np.round(item["image"] * 255), clip["image"])
    np.testing.assert_allclose(item["time"], clip["time"], rtol=1e-6)
    for name, last in (("displacement", "vector"), ("strain", "strain_component"), ("flow", "vector")):
        np.testing.assert_array_equal(item[name], clip[name].transpose(..., last, "axial", "lateral"))


@pytest.mark.parametrize("target", ["wall", "layer", "segment", "region"])
def test_labels_are_those_of_the_notebook(repository, target):
    items = learning.Segmentation(repository, target=target)
    number = len(items) - 2  # of the last heart, which has an infarct
    clip = et.Repository(repository).clip(items[number]["case"], items[number]["view"])
    expected = clip["mask" if target == "wall" else target].values[items[number]["frame"]]
    np.testing.assert_array_equal(items[number]["label"], expected)
    assert items[number]["image"].shape == (1, SIZE, SIZE)


def test_strain_and_diagnosis_are_those_of_the_heart(repository):
    hearts, table = et.Repository(repository), learning.cases(repository)
    for item in learning.Clips(repository, views=["mid"], size=32, heart=learning.clips.HEART):
        heart, mean = hearts.heart(item["case"]), hearts.read("kinematics/strain_mean", item["case"])
        np.testing.assert_allclose(item["strain_mean"], mean, atol=1e-7)
        assert item["es_frame"] == heart.es
        assert item["label"] == (heart.region == 1).any() == (item["scar_size"] > 0)
        assert item["diagnosis"] == ("infarct" if item["label"] else "healthy")
        assert item["gls"] == pytest.approx(table.loc[item["case"], "gls"], nan_ok=True)


@pytest.mark.slow
def test_workers_read_the_same_items(repository):
    sequences = [sequence(repository, kind, views=["mid"], size=32) for kind in KINDS]
    expected = [digest for items in sequences for digest in digests(items)]  # which opens the store in this process
    work = [(items, number) for items in sequences for number in range(len(items))]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map(digest_of, work, chunksize=3) == expected


def digest_of(work):
    items, number = work
    return digest(items[number])


@pytest.mark.parametrize("kind", KINDS)
def test_item_depends_on_nothing_but_its_index(repository, kind):
    items = sequence(repository, kind, size=32)
    backwards = [digest(items[number]) for number in reversed(range(len(items)))]
    assert backwards[::-1] == digests(sequence(repository, kind, size=32))
    assert len(set(backwards)) == len(backwards)
    assert digest(items[-1]) == backwards[0]


def test_copy_for_a_worker_has_no_open_array(repository):
    items = learning.FlowPairs(repository, size=32)
    before = len(pickle.dumps(items))
    assert digests(items)
    copy = pickle.loads(pickle.dumps(items))
    assert not copy.repository._opened and items.repository._opened
    assert len(pickle.dumps(items)) < before + 2e4


def test_sequences_are_as_long_as_their_cases_views_and_frames(repository):
    part = learning.cases(repository, "diagnosis == 'infarct' and seed == 1")
    lengths = {kind: len(sequence(repository, kind, cases=part, views=["mid"])) for kind in KINDS}
    assert lengths == {"Clips": 1, "FlowPairs": 2, "PointTracks": 1, "Segmentation": 3}
    assert len(learning.FlowPairs(repository)) == 4 * 2 * 2
    with pytest.raises(IndexError):
        learning.Clips(repository)[8]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: learning.Clips(folder, ["nobody"]), "case = 'nobody': use one of"),
        (lambda folder: learning.Clips(folder, views=["front"]), "view = 'front': use one of mid, long_axis"),
        (lambda folder: learning.Clips(folder, size=100), "size = 100: use one of 64, 32"),
        (lambda folder: learning.Clips(folder, truth=["speed"]), "truth = 'speed': use one of displacement"),
        (lambda folder: learning.Segmentation(folder, target="cavity"), "target = 'cavity': use one of wall"),
        (lambda folder: learning.PointTracks(folder, points=0), "points = 0"),
        (lambda folder: learning.PointTracks(folder, start=3), "start = 3: give a frame from 0 to 2"),
        (lambda folder: learning.Clips(folder, heart="weight"), "heart = 'weight': use one of diagnosis"),
        (lambda folder: learning.Clips(folder, heart="diagnosis", classes=["healthy"]), "is infarct: add it"),
        (lambda folder: learning.Clips(folder.parent), "is not a repository"),
        (lambda folder: learning.cases(folder, "depth > 3"), "query = 'depth > 3'"),
        (lambda folder: learning.cases(folder, "status =="), "query = 'status =='"),
    ],
)
def test_what_is_not_there_is_refused_in_one_sentence(repository, make, words):
    with pytest.raises((ValueError, FileNotFoundError), match=words) as caught:
        make(repository)
    assert "\n" not in str(caught.value)
