"""Drawn hearts: their distributions, the evenness of quasi-random points, and that they stay."""

import math

import numpy as np
import pytest
from scipy import stats

from echotruth.cases import expand
from echotruth.cases.draws import draws, sobol, unit_points
from echotruth.config import Config
from echotruth.config.cases import Distribution, Draw
from echotruth.config.loading import ConfigError, validate

KEYS = {
    "fibres.endo_deg": Distribution(uniform=[60, 75]),
    "fibres.epi_deg": Distribution(normal=[-42, 2]),
    "loop.edv_uL": Distribution(normal=[50, 5], limits=[45, 60]),
    "mechanics.material.stiffness_kPa": Distribution(log_uniform=[0.8, 2.4]),
    "seed": Distribution(integers=[1, 6]),
    "pathology.infarct.segments": Distribution(choice=[None, [7, 8], [1]], weights=[2, 1, 1]),
}


def drawn(number=4096, seed=7, keys=KEYS):
    values = draws(Draw(number=number, seed=seed, keys=keys))
    assert len(values) == number
    return {key: [value[key] for value in values] for key in keys}


@pytest.mark.parametrize(
    ("key", "distribution"),
    [
        ("fibres.endo_deg", stats.uniform(60, 15)),
        ("fibres.epi_deg", stats.norm(-42, 2)),
        ("loop.edv_uL", stats.truncnorm(-1, 2, 50, 5)),
        ("mechanics.material.stiffness_kPa", stats.loguniform(0.8, 2.4)),
    ],
)
def test_values_have_their_distribution(key, distribution):
    """By the distance of Kolmogorov and Smirnov, and the mean within four of its standard errors."""
    values = np.array(drawn()[key])
    assert stats.kstest(values, distribution.cdf).pvalue > 1e-3
    assert abs(values.mean() - distribution.mean()) < 4 * distribution.std() / math.sqrt(len(values))


def test_pose_and_motion_of_a_probe_are_drawn_for_every_case():
    keys = {
        "views.mid.angle_deg": {"uniform": [-15, 15]},
        "views.mid.motion.breathing.phase_deg": {"uniform": [0, 360]},
    }
    cases = expand(validate({"cases": {"draw": {"number": 4, "keys": keys}}}, "test"))
    views = [case.config.views["mid"] for case in cases]
    assert sorted(np.floor([view.angle_deg / 7.5 for view in views])) == [-2, -1, 0, 1]  # one in each quarter
    assert len({view.motion.breathing.phase_deg for view in views}) == 4 and len({case.heart for case in cases}) == 1


def test_truncated_values_stay_within_their_limits_and_rounding_within_bounds():
    values = drawn(20000)
    assert min(values["loop.edv_uL"]) >= 45 and max(values["loop.edv_uL"]) <= 60
    narrow = {"fibres.endo_deg": Distribution(uniform=[60.00000011, 60.00000012])}
    assert set(drawn(keys=narrow)["fibres.endo_deg"]) <= {60.00000011, 60.00000012}


def test_whole_numbers_and_choices_have_their_frequencies():
    values = drawn(6144)
    assert all(isinstance(seed, int) for seed in values["seed"])
    counts = np.bincount(values["seed"], minlength=7)[1:]
    assert stats.chisquare(counts).pvalue > 1e-3
    segments = [str(value) for value in values["pathology.infarct.segments"]]
    counts = [segments.count(name) for name in ("None", "[7, 8]", "[1]")]
    assert sum(counts) == 6144
    assert stats.chisquare(counts, [3072, 1536, 1536]).pvalue > 1e-3


def points(number, seed=7, dimensions=6):
    keys = {f"key{axis}": Distribution(uniform=[0, 1]) for axis in range(dimensions)}
    return np.stack(list(unit_points(Draw(number=number, seed=seed, keys=keys)).values()), axis=1)


def test_each_pair_of_keys_has_a_point_in_every_cell_of_sobol_that_is_due():
    """Of 256 points of a digital net in base 2, every 1/16 of an axis has 16, whatever the shift."""
    net = points(256)
    for axis in net.T:
        assert np.all(np.bincount((axis * 256).astype(int), minlength=256) == 1)
    cells = (net[:, 0] * 16).astype(int) * 16 + (net[:, 1] * 16).astype(int)
    assert np.all(np.bincount(cells, minlength=256) == 1)


def test_sequence_is_that_of_scipy_before_the_shift():
    with pytest.warns(UserWarning, match="balance"):
        reference = stats.qmc.Sobol(5, scramble=False).random(100)
    np.testing.assert_array_equal(sobol(100, 5) / 2**30, reference)


def test_a_larger_number_keeps_the_hearts_that_were_there():
    for more in (101, 128, 1000):
        assert draws(Draw(number=more, keys=KEYS))[:100] == draws(Draw(number=100, keys=KEYS))
    before, after = (
        [case.id for case in expand(Config(cases={"draw": {"number": n, "keys": CONTINUOUS}}))] for n in (5, 12)
    )
    assert after[:5] == before and len(set(after)) == 12


CONTINUOUS = {"fibres.endo_deg": {"uniform": [60, 75]}, "fibres.epi_deg": {"uniform": [-46, -38]}}


def test_draws_depend_on_their_seed_and_not_on_the_order_of_keys():
    first = drawn(50)
    assert drawn(50) == first
    assert drawn(50, keys=dict(reversed(KEYS.items()))) == first
    assert drawn(50, seed=8)["fibres.endo_deg"] != first["fibres.endo_deg"]


def test_drawn_values_are_what_they_were_when_first_published():
    """A repository is read by drawing its hearts again, also by other versions of the libraries."""
    assert drawn(3) == PUBLISHED


PUBLISHED = {
    "fibres.endo_deg": [67.567, 60.067, 63.817],
    "fibres.epi_deg": [-42.0781, -37.6898, -43.4487],
    "loop.edv_uL": [59.8665, 50.837, 53.7127],
    "mechanics.material.stiffness_kPa": [0.995205, 1.72375, 1.30976],
    "seed": [6, 3, 2],
    "pathology.infarct.segments": [[7, 8], None, None],
}


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        ({"number": 3}, "cases.draw.keys is missing: it must be given"),
        ({"number": 10**6, "keys": CONTINUOUS}, "cases.draw.number = 1000000: should be less than or equal to 100000"),
        (
            {"number": 3, "keys": {"fibres.endo": {"uniform": [1, 2]}}},
            "cases.draw.keys.fibres.endo: fibres.endo is not",
        ),
        ({"number": 3, "keys": {"seed": {}}}, "give one of uniform, log_uniform, normal, integers, choice"),
        (
            {"number": 3, "keys": {"seed": {"uniform": [2, 1]}}},
            "uniform = [2.0, 1.0]: must be the lower bound and then",
        ),
        ({"number": 3, "keys": {"seed": {"log_uniform": [0, 1]}}}, "must have positive bounds"),
        (
            {"number": 3, "keys": {"seed": {"uniform": [0, 1], "limits": [0, 1]}}},
            "limits = [0.0, 1.0]: applies to normal",
        ),
        ({"number": 3, "keys": {"seed": {"choice": [1, 2], "weights": [1]}}}, "one entry for each of the 2 of choice"),
        ({"number": 9, "keys": {"seed": {"choice": [1, 2]}}}, "are the same heart, heart: draw fewer hearts"),
        ({"number": 3, "keys": {"seed": {"uniform": [1, 9]}}}, "draw 1: seed = "),
        ({"number": 9, "keys": {"fibres.endo_deg": {"uniform": [80, 99]}}}, "should be less than or equal to 90"),
    ],
)
def test_draw_that_cannot_be_made_is_refused(draw, sentence):
    with pytest.raises(ConfigError) as error:
        expand(validate({"cases": {"draw": draw}}, "my.yaml"), "my.yaml")
    assert str(error.value).startswith("my.yaml: ") and sentence in str(error.value)
