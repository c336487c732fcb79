"""Muscle that is known, inferred from the motion of a heart of another mesh; and what cannot be inferred."""

import json

import numpy as np
import pytest
from scipy.stats import norm

import echotruth as et
from echotruth.config.loading import ConfigError
from echotruth.inference import observation
from echotruth.inference.estimate import COARSE_SD, infer, shortest_interval, with_error_of_mesh
from echotruth.inference.heart_model import MESH_KEYS, HeartModel, model_config
from echotruth.inference.imaged_wall import ImagedWall, quantity
from echotruth.inference.observation import ObservationError, Seen
from echotruth.inference.parameters import PriorError, parameters, prior_of
from echotruth.inference.segment_means import SegmentMeans
from echotruth.inference.tracker_errors import TrackerError
from echotruth.loop.cycle import read_loop

TRUE = {"7": 0.9, "8": 0.4, "9": 0.5, "10": 0.9, "11": 1.4, "12": 1.2}
ERROR = 0.002
"""Standard deviation that the exact strain is said to have."""
KNOWN = dict.fromkeys(
    (
        *("mechanics.regional.stiffness", "mechanics.active.sheet_share", "mechanics.active.normal_share"),
        *("fibres.endo_deg", "fibres.epi_deg"),
    )
)


@pytest.fixture(scope="module")
def heart():
    mesh = {"circumferential_elements": 18, "longitudinal_elements": 6, "transmural_elements": 1}
    config = et.configure(
        geometry=mesh,
        loop={"frames": 6},
        mechanics={"regional": {"preset": "even", "contractility": TRUE}},
        tracking={"grid": 0.016},
    )
    return et.beat(config, frames=et.systole(config))


@pytest.fixture(scope="module")
def observed(heart):
    """Its exact motion."""
    rows = []
    for view, segments in (("mid", range(7, 13)), ("long_axis", (3, 6, 9, 12, 14, 16))):
        wall = ImagedWall.of(heart, heart.config, view)
        exact = wall.seen(heart, heart.positions(0), heart.positions(-1))[list(segments)]
        rows.append(
            (
                Seen(quantity(wall.kind), view, list(segments), exact, exact),
                TrackerError(0.0, ERROR, 1.0, 0.0, ERROR**2, 0.0, 6),
            )
        )
    cycle = read_loop(heart.config.loop)
    loop = {"pressure": cycle.pressure, "volume": cycle.volume}
    return observation.dataset(rows, heart.config.model_dump_json(), loop, {"case": "known"})


def chosen(observed, kept):
    return observed.isel(observation=kept, other=kept)


@pytest.fixture(scope="module")
def found(observed):
    return infer(observed, KNOWN, mesh=(12, 6, 1))


@pytest.mark.slow
def test_contractility_of_segments_is_found_from_the_motion_of_a_heart_of_another_mesh(heart, found):
    factors = np.array([float(TRUE.get(str(number), 1.0)) for number in range(1, 18)])
    means = SegmentMeans.of(heart.config)
    of_segments = means.means(factors[None])[0]
    true = dict(zip(means.number.tolist(), of_segments / (means.share @ of_segments), strict=True))
    seen = [f"contractility.{number}" for number in range(7, 13)]
    rows = found.sel(parameter=seen)
    due = np.array([true[number] for number in range(7, 13)])
    assert np.sqrt(np.mean((rows["mean"].values - due) ** 2)) < 0.04
    assert np.all((rows["lower"] <= due) & (due <= rows["upper"]))
    assert rows["identifiable"].all()
    assert not found.attrs["misfit"] and found.attrs["converged"]


@pytest.mark.slow
def test_derivatives_are_those_of_what_the_model_shows(observed, tmp_path):
    config, edv = model_config(observed, (6, 4, 1), tmp_path), "loop.edv_uL"
    free = [
        one for one in parameters(config, {}) if one.key in (edv, "mechanics.regional.stiffness.9", "fibres.epi_deg")
    ]
    views, segments = ["mid"] * 7 + ["long_axis"] * 3, [0, *range(7, 13), 3, 14, 16]
    model, mean = HeartModel(config, free, views, segments), prior_of(free).mean
    along, first = prior_of(free).sd, model(mean)
    due = first.jacobian @ along
    found = []
    for step in (0.03, 0.05, 0.15):
        above, below = (model(mean + sign * step * along).observed for sign in (1, -1))
        found.append((above - below) / (2 * step))
    # The median: where one of two hearts is solved with a halved step of the load, their difference has a jump.
    np.testing.assert_allclose(np.median(found, axis=0), due, rtol=0.02, atol=0.01 * np.abs(due).max())


@pytest.mark.parametrize(
    ("own", "mesh", "added"),
    [
        ((18, 10, 2), (12, 6, 1), True),
        ((18, 10, 2), (12, 8, 2), False),
        ((18, 10, 2), None, False),
        ((12, 8, 1), None, False),
        ((18, 6, 1), (12, 6, 1), False),
    ],
)
def test_strain_has_the_error_of_a_mesh_that_is_coarser_than_the_usual_one(observed, own, mesh, added, tmp_path):
    config = et.configure(json.loads(observed.attrs["config"]), **dict(zip(MESH_KEYS, own, strict=True)))
    fine = observed.assign_attrs(config=config.model_dump_json())
    model = model_config(fine, mesh, tmp_path)
    more = (with_error_of_mesh(fine, model)["covariance"] - fine["covariance"]).values
    np.testing.assert_allclose(more, added * COARSE_SD**2 * np.eye(len(more)), atol=1e-12)


def test_interval_is_that_of_highest_density():
    random = np.random.default_rng(1)
    drawn = np.stack([random.normal(3, 2, 20000), np.abs(random.normal(0, 1, 20000))], axis=1)
    lower, upper = shortest_interval(drawn)
    np.testing.assert_allclose([lower[0], upper[0]], norm(3, 2).ppf([0.05, 0.95]), atol=0.3)
    np.testing.assert_allclose([lower[1], upper[1]], [0, norm.ppf(0.95)], atol=0.03)


@pytest.mark.slow
def test_what_no_view_shows_keeps_its_prior(found):
    unseen = found.sel(parameter=["contractility.1", "contractility.4", "loop.edp_mmHg"])
    assert not unseen["identifiable"].any()
    assert (unseen["sd"] / unseen["prior_sd"] > 0.8).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda seen: chosen(seen, []), "holds no observation"),
        (lambda seen: seen.drop_vars("volume"), "lacks a variable"),
        (lambda seen: seen.assign(pressure=seen["pressure"] * np.nan), "pressure or volume is not finite"),
        (lambda seen: seen.assign(volume=seen["volume"] * 0 + 5e-8), "the loop of known: volume"),
        (lambda seen: seen.assign(value=seen["value"].where(seen["aha"] != 8)), "needs finite values"),
        (lambda seen: seen.assign(covariance=seen["covariance"] * 0), "positive definite"),
        (lambda seen: seen.isel(observation=[0, 1]), "leave observations out by isel"),
        (lambda seen: seen.drop_attrs(), "lacks a variable or an attribute"),
        (lambda seen: seen.drop_vars("value"), "lacks a variable"),
    ],
)
def test_observations_that_cannot_be_used_are_refused_in_a_sentence(observed, change, said):
    with pytest.raises(ObservationError, match=said):
        infer(change(observed))


@pytest.mark.parametrize(
    ("prior", "said"),
    [
        ({"fibres.endo": (80, 8)}, "fibres.endo is not inferred: the keys are .*fibres.endo_deg"),
        ({"fibres.endo_deg": (95, 8)}, "give a mean from -90 to 90"),
        ({"mechanics.regional.contractility": (1, 1000)}, "standard deviation of at most"),
        ({"fibres.endo_deg": 80}, "= 80: give a mean from -90 to 90 .*, or None"),
    ],
)
def test_priors_that_cannot_be_used_are_refused_in_a_sentence(observed, prior, said):
    with pytest.raises(PriorError, match=said):
        infer(observed, prior)


def test_what_is_no_observation_or_no_mesh_is_refused(observed):
    with pytest.raises(TypeError, match=r"echotruth\.observe makes one"):
        infer("out/demo")
    with pytest.raises(ConfigError, match="circumferential_elements"):
        infer(observed, mesh=(13, 6, 1))
    with pytest.raises(ObservationError, match="around, along and through"):
        infer(observed, mesh=(12, 6))
