"""What is inferred, as the store has it, and the stage that makes it."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import echotruth as et
from echotruth.cases import expand
from echotruth.cli import check
from echotruth.config.loading import ConfigError, validate
from echotruth.inference import stored
from echotruth.inference.stored import groups
from echotruth.repository import schema
from echotruth.repository.version import version_of

VIEWS = {"mid": {"position": 0.5}, "long": {"plane": "long_axis", "rotation_deg": 30.0}}
CONFIG = et.configure(views=VIEWS, tracking={"trackers": {"dis": {"method": "dis"}}}, inference={"tracker": "dis"})
NAMES = ["fibres.epi_deg", "contractility.8", "contractility.2"]


def found():
    """What was inferred from rotation, and from strain of two segments, in an order of their own."""
    random = np.random.default_rng(1)
    number = schema.DRAWS
    arrays = {name: ("parameter", np.array([-40.0, 0.3, 0.9])) for name in ("mean", "lower", "upper", "prior_mean")}
    arrays |= {name: ("parameter", np.array([5.0, 0.1, 0.2])) for name in ("sd", "prior_sd")}
    arrays |= {
        "identifiable": ("parameter", [True, True, False]),
        "posterior": (("draw", "parameter"), random.normal(size=(number, 3))),
        "prior": (("draw", "parameter"), random.normal(size=(number, 3))),
        "replicated": (("draw", "observation"), random.normal(size=(number, 3))),
        "scar": (("draw", "aha"), random.random((number, 17)) < 0.3),
        "scar_probability": ("aha", np.linspace(0, 1, 17)),
        "observed": ("observation", np.array([0.1, -0.2, -0.3])),
        "predicted": ("observation", np.array([0.11, -0.21, -0.31])),
    }
    labels = {"view": ("observation", ["mid", "long", "mid"]), "segment": ("observation", [0, 8, 8])}
    about = {"misfit_probability": 0.4, "converged": 1}
    return xr.Dataset(arrays, {"parameter": NAMES, **labels}, about)


def test_values_stand_at_their_labels_and_what_was_not_seen_is_no_number():
    given, covariance = found(), np.diag([1.0, 4.0, 9.0]) + 0.1
    given["covariance"] = ("observation", "other"), covariance
    made = groups(given, {"mid 8": -0.28}, {"contractility.8": 0.0}, SimpleNamespace(config=CONFIG))
    assert set(made) == {kind for kind in schema.KINDS if kind.startswith("inference/")}
    for group, arrays in made.items():
        assert set(arrays) == set(schema.arrays_of(group))
    parameters, seen = list(schema.LABELS["parameter"]), schema.observations(CONFIG)
    posterior = made["inference/posterior"]["value"]
    assert posterior.shape == (1, schema.DRAWS, len(parameters))
    for place, name in enumerate(NAMES):
        np.testing.assert_array_equal(posterior[0, :, parameters.index(name)], given["posterior"].values[:, place])
    assert np.isfinite(posterior).all((0, 1)).sum() == len(NAMES)
    at = [seen.index(label) for label in ("mid rotation", "long 8", "mid 8")]
    assert len(seen) == 16 + 1 + 16
    value = made["inference/observed_data"]["value"]
    np.testing.assert_array_equal(value[at], [0.1, -0.2, -0.3])
    assert np.isfinite(value).sum() == 3
    kept = made["inference/constant_data"]["covariance"]
    np.testing.assert_array_equal(kept[np.ix_(at, at)], covariance)
    assert np.isfinite(kept).sum() == 9
    assert made["inference/constant_data"]["true_value"][at[2]] == -0.28
    fit = made["inference/fit"]
    assert fit["true"][parameters.index("contractility.8")] == 0 and fit["predicted"][at[1]] == -0.21
    assert float(fit["identifiable"][parameters.index("contractility.2")]) == 0


def test_other_errors_of_the_tracker_are_another_version(tmp_path):
    table = tmp_path / "mine.csv"
    config = et.configure(CONFIG, inference={"errors": str(table)})
    versions = [version_of("inference", config)]
    for content in ("one", "two"):
        table.write_text(content)
        versions.append(version_of("inference", config))
    assert len(set(versions)) == 3


@pytest.mark.parametrize(
    ("inference", "said"),
    [
        ({"size_px": 512}, "inference: tracker: the error of dis at 512 px with ideal acoustics"),
        ({"errors": "none.csv"}, "inference: none.csv: there is no such table of errors"),
        (
            {"size_px": 256, "prior": {"fibres.endo_deg": [95, 8]}},
            "inference: prior: fibres.endo_deg = [95.0, 8.0]: give a mean from -90 to 90",
        ),
    ],
)
def test_check_tells_from_what_cannot_be_inferred(inference, said):
    config = et.configure(CONFIG, inference=inference)
    (found,) = check._of_inference(config, expand(config))
    assert found.startswith(said)


def test_prior_of_the_configuration_is_that_of_what_is_inferred(monkeypatch):
    given = {"fibres.endo_deg": [75.0, 3.0], "mechanics.regional.stiffness": None}
    config = et.configure(et.configure(CONFIG, inference={"prior": given}), seed=2)  # null is kept in another one too

    def infer(_, prior, **__):
        raise LookupError(prior)

    monkeypatch.setattr(stored, "observe", lambda *_: None)
    monkeypatch.setattr(stored, "infer", infer)
    with pytest.raises(LookupError) as asked:
        stored.stored(None, SimpleNamespace(id="heart", config=config))
    assert asked.value.args == (given,)


def test_hearts_of_a_sweep_are_inferred_alike():
    with pytest.raises(ConfigError, match=r"inference\.tracker"):
        swept = CONFIG.model_dump(mode="json") | {"cases": {"inference.tracker": ["dis"]}}
        expand(validate(swept, "a.yaml"), "a.yaml")
