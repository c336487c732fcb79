"""What a tracker saw, read from a repository, and the same seen of a heart."""

from dataclasses import replace

import numpy as np
import pytest

import echotruth as et
from echotruth.config.imaging import ViewMotion
from echotruth.evaluation.segment_strain import COMPONENTS
from echotruth.inference import observation, tracker_errors
from echotruth.inference.imaged_wall import ImagedWall
from echotruth.inference.observation import ObservationError, observe
from echotruth.repository.reader import Repository

ES_ROUNDING = 1e-4
"""Of the strain of points and of the mean of segments in the store."""


def tracked_and_true(random):
    """Of a tracker that shows 0.8 of how segments differ."""
    true = random.normal(-0.15, 0.05, 6)
    return 0.01 + np.mean(true) + 0.8 * (true - np.mean(true)) + 0.005 * random.normal(size=6), true


@pytest.fixture(scope="module")
def errors(tmp_path_factory):
    """Table of errors of `dis` at 256 px."""
    random = np.random.default_rng(1)
    rows = [
        ("dis", 256, "ideal", quantity, f"heart{number}", "case", "view", *tracked_and_true(random))
        for quantity in ("circumferential", "longitudinal", "rotation")
        for number in range(4)
    ]
    path = tmp_path_factory.mktemp("errors") / "errors.csv"
    tracker_errors.table_of(rows).to_csv(path, index=False)
    return path


@pytest.mark.parametrize("case", ["healthy", "infarct"])
@pytest.mark.parametrize("view", ["mid", "long_axis"])
def test_a_modelled_heart_shows_the_true_strain_and_rotation_of_the_repository(case, view):
    hearts = et.sample()
    heart, config = hearts.heart(case), hearts.case(case).config
    wall = ImagedWall.of(heart, config, view)
    seen = wall.seen(heart, heart.positions(0), heart.positions(heart.es))
    true = hearts.curves(case, view, "dis").isel(frame=heart.es)
    strain = true["true_segment_strain"].sel(measure="engineering", wall_component="TT").values
    np.testing.assert_allclose(seen[1:], strain, atol=ES_ROUNDING)
    np.testing.assert_allclose(seen[0], float(true["true_rotation"]), atol=ES_ROUNDING)


def test_observation_is_what_was_tracked_without_bias_and_lost_contrast_with_its_errors(errors):
    hearts = et.sample()
    seen = observe(hearts, "dis", "healthy", errors=errors)
    strain = hearts.curves("healthy", "mid", "dis")["tracked_segment_strain"]
    es = int(hearts.heart("healthy").arrays["mechanics"]["es_frame"])
    tracked = strain.isel(frame=es).sel(measure="engineering", wall_component="TT")
    mid = seen["value"][(seen["quantity"] == "circumferential").values]
    due = tracked.sel(aha=mid["aha"].values).values
    error = tracker_errors.error_of(
        tracker_errors.read(errors), "dis", 256, "ideal", COMPONENTS["short_axis"][1], "another"
    )
    assert error.gain == pytest.approx(0.8, abs=0.05)
    assert float(mid.mean()) == pytest.approx(due.mean() - error.bias, rel=1e-9)
    np.testing.assert_allclose(error.gain * (mid - mid.mean()), due - due.mean(), rtol=1e-9)
    assert mid["aha"].values.tolist() == [7, 8, 9, 10, 11, 12]
    assert 17 not in seen["aha"] and np.all(np.linalg.eigvalsh(seen["covariance"]) > 0)
    least = error.segment_variance * 5 / 6 / error.gain**2 + observation.MODEL_SD["circumferential"] ** 2
    assert seen["covariance"].values[0, 0] >= least


def test_segment_that_the_tracker_lost_is_left_out(errors, monkeypatch):
    tracks = Repository.tracks

    def lost(self, *arguments):
        points = tracks(self, *arguments)
        return points.assign(displacement=points["displacement"].where(points["segment"] != 8))

    monkeypatch.setattr(Repository, "tracks", lost)
    seen = observe(et.sample(), "dis", "healthy", errors=errors)
    assert 8 not in seen["aha"] and {7, 9} <= set(seen["aha"].values.tolist())

    def nothing(self, *arguments):
        points = tracks(self, *arguments)
        return points.assign(displacement=np.nan * points["displacement"])

    monkeypatch.setattr(Repository, "tracks", nothing)
    with pytest.raises(ObservationError, match="saw no segment"):
        observe(et.sample(), "dis", "healthy", errors=errors)


@pytest.mark.parametrize(("view", "is_refused"), [("mid", True), ("long_axis", False)])
def test_rotation_of_the_probe_is_not_taken_for_that_of_the_heart(errors, monkeypatch, view, is_refused):
    """A long axis observes no rotation, and its strain has none of that motion."""
    found = et.sample().case("healthy")
    rocking = found.config.views[view].model_copy(update={"motion": ViewMotion(rocking_deg=3.0)})
    config = found.config.model_copy(update={"views": found.config.views | {view: rocking}})
    monkeypatch.setattr(Repository, "case", lambda self, case=None: replace(found, config=config))
    if is_refused:
        with pytest.raises(ObservationError, match=r"healthy: views\.mid\.motion\.rocking_deg = 3 adds to the rot"):
            observe(et.sample(), "dis", "healthy", errors=errors)
    else:
        assert "rotation" in observe(et.sample(), "dis", "healthy", errors=errors)["quantity"]


def test_what_is_not_in_the_repository_is_refused(errors):
    with pytest.raises(TypeError, match=r"echotruth\.Repository opens one"):
        observe("sample", "dis")
    with pytest.raises(ValueError, match="healty"):
        observe(et.sample(), "dis", "healty", errors=errors)
    with pytest.raises(ValueError, match="tracker"):
        observe(et.sample(), "dos", "healthy", errors=errors)
    with pytest.raises(tracker_errors.NoErrors, match="bspline_dic at 256 px"):
        observe(et.sample(), "bspline_dic", "healthy", errors=errors)
