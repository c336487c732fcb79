"""The examples that learn: what they compute is right, and each runs on a small repository."""

import importlib.util
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from echotruth import learning
from echotruth.tracking.ray_network import read
from echotruth.tracking.trackers.bspline_cnn import seen_twice

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name):
    pytest.importorskip("torch")
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


@pytest.fixture(scope="module")
def hearts(repository):
    """The healthy heart, and the one with an infarct."""
    return [learning.cases(repository, f"diagnosis == '{name}'") for name in ("healthy", "infarct")]


@pytest.mark.slow
def test_network_beats_no_motion_on_a_heart_that_it_has_not_seen(repository, hearts):
    found = example("motion")["compare"](repository, *hearts, epochs=10)
    assert set(found) == {"no motion", "one", "network"}
    assert found["network"] < 0.8 * found["no motion"]


@pytest.mark.slow
def test_wall_on_a_black_ground_is_found_by_a_network_and_better_than_by_its_mean_place(repository, hearts):
    found = example("segmentation")["compare"](repository, *hearts, epochs=10)
    assert found["network"] > 0.9 > found["mean wall"]


@pytest.mark.slow
def test_every_method_scores_every_heart_once(repository):
    table = learning.cases(repository)
    parts = {f"fold {seed}": table[table["seed"] == seed] for seed in (1, 2)}
    names = example("diagnosis")
    found = names["compare"](repository, table, parts, steps=2)
    assert set(found) == {"ejection fraction", "network", "strain by one", "true strain"}
    assert all(0 <= found[name] <= 1 for name in ("network", "strain by one", "true strain"))


@pytest.mark.slow
def test_area_under_the_curve_is_the_share_of_pairs_in_order():
    auc = example("diagnosis")["auc"]
    score, infarct = np.array([0.1, 0.4, 0.35, 0.8]), np.array([False, False, True, True])
    assert auc(score, infarct) == 0.75
    assert auc(np.ones(4), infarct) == 0.5


@pytest.mark.slow
def test_sector_that_does_not_shorten_is_found_among_others_that_do():
    names, random = example("diagnosis"), np.random.default_rng(0)
    angle, radius = random.uniform(-np.pi, np.pi, 4000), random.uniform(1, 2, 4000)
    before = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    before -= before.mean(0)
    assert names["least_shortening"](before, 0.8 * before) == pytest.approx((0.8**2 - 1) / 2, abs=1e-9)
    dead = np.abs(angle) < 0.7
    after = np.where(dead[:, None], before, 0.8 * before)
    assert names["least_shortening"](before, after) == pytest.approx(0, abs=1e-9)


@pytest.fixture(scope="module")
def rays(repository, hearts):
    """The example of the ray network, and samples of a heart."""
    names = example("ray_network")
    return names, names["samples"](str(repository), hearts[0].index[0])


@pytest.mark.slow
def test_ray_network_learns_and_its_weights_give_the_tracker_what_pytorch_computed(rays, tmp_path):
    names, found = rays
    one = found[1:2]  # small, so that not all its points are right
    network = names["train"](one, epochs=40)
    names["calibrate"](network, one)
    scores = names["scores"](network, one)
    assert scores["name"].tolist() == [one[0].name] and scores["ratio"].mean() < 0.9
    assert scores["stated"].mean() == pytest.approx(scores["right"].mean(), abs=15)
    names["write"](network, found, tmp_path / "weights.npz")
    again = names["RayNetwork"](len(names["CHANNELS"]))
    again.read(tmp_path / "weights.npz")
    for each, own in zip(again.parameters(), network.parameters(), strict=True):
        np.testing.assert_allclose(each.detach(), own.detach(), atol=1e-2)
    read_again = read(tmp_path / "weights.npz", len(names["CHANNELS"]))
    correction, deviation = seen_twice(read_again, found[0].channels)
    expected, log_deviation = names["seen_twice"](network, names["batch"](found[:1]))
    np.testing.assert_allclose(correction.transpose(3, 1, 0, 2), expected[0], atol=0.02)  # weights of half precision
    np.testing.assert_allclose(np.log(deviation).transpose(1, 0, 2), log_deviation[0], atol=0.02)


@pytest.mark.slow
def test_hearts_that_move_otherwise_have_the_errors_that_they_had_and_less_where_they_move_less(rays):
    torch, (names, found) = pytest.importorskip("torch"), rays
    given = names["batch"](found * 4)
    torch.manual_seed(0)
    weaker = names["sector"](len(given["true"]))  # drawn first
    torch.manual_seed(0)
    other = names["varied"](given)
    np.testing.assert_allclose(
        names["largest"](other["tracked"], other), names["largest"](given["tracked"], given), rtol=1e-4
    )
    change = (other["channels"] - given["channels"])[:, names["SCALE"]]  # 0 on rays that cross no wall
    larger = (change.sum((1, 2)) / (change != 0).sum((1, 2))).exp()[:, None, None, None, None]
    errors = [(each["tracked"] - each["true"]) * given["known"][:, None, :, None] for each in (other, given)]
    np.testing.assert_allclose(larger * errors[0], weaker * errors[1], atol=1e-5)
    assert (weaker.amin((1, 2, 3, 4)) < 1).float().mean() == pytest.approx(0.5, abs=0.3)
    moved = [names["whole_motion"](given), names["smooth_fields"](len(given["true"]))]
    assert all((each[..., 0, :] == 0).all() for each in moved)  # nothing moves at end-diastole


@pytest.mark.slow
def test_a_heart_that_only_moves_as_a_whole_has_the_strain_that_it_had(rays):
    names, found = rays
    given = names["batch"](found)
    moved = 0.1 * names["whole_motion"](given)
    np.testing.assert_allclose(
        names["strain"](given["tracked"] + moved, given), names["strain"](given["tracked"], given), atol=0.02
    )


@pytest.mark.slow
def test_ray_network_sees_a_mirrored_heart_as_a_heart_whose_motion_is_mirrored(rays):
    names, found = rays
    given = names["batch"](found[:1])
    other = names["mirrored"](given)
    for measure in ("strain_error", "relative_error"):
        np.testing.assert_allclose(
            names[measure](other["tracked"], other), names[measure](given["tracked"], given), rtol=1e-4
        )
    for name, values in names["mirrored"](other).items():
        np.testing.assert_array_equal(values, given[name])
    cosine = names["CHANNELS"].index("ray_lateral")
    assert (given["channels"][0, cosine] == other["channels"][0, cosine]).float().mean() > 0.5  # the ray at pi - a


@pytest.mark.slow
@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("mirrored", [False, True])
def test_motion_away_from_the_centre_stays_so_when_turned_and_mirrored(turns, mirrored):
    torch = pytest.importorskip("torch")

    names, index = example("motion"), torch.arange(6) - 2.5
    axial, lateral = torch.meshgrid(index, index, indexing="ij")
    batch = {
        "image": torch.stack([lateral, axial])[None],
        "flow": torch.stack([lateral, axial])[None],
        "wall": (lateral > 0)[None],
    }
    image, flow, wall = names["turned"](batch, turns, mirrored)
    np.testing.assert_array_equal(flow, batch["flow"])
    # The first image is the lateral position before: the wall is where it was positive, wherever that is now.
    np.testing.assert_array_equal(wall, image[:, 0] > 0)


def test_blocks_of_the_page_about_learning_run_as_they_stand(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page, names = (EXAMPLES.parent / "docs/learning.md").read_text(), {}
    with_torch = importlib.util.find_spec("torch") is not None
    blocks = [
        block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if with_torch or "torch" not in block
    ]
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 2 + with_torch and len(blocks[0].strip().splitlines()) == 5
    assert names["pairs"][0]["flow"].shape == (2, 256, 256)
    assert not set(names["parts"]["train"].index) & set(names["parts"]["test"].index)
    assert names["sick"].index.tolist() == ["infarct"]
    if with_torch:
        assert names["batch"]["flow"].shape == (8, 2, 256, 256)
