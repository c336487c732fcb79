"""Where and when the wave goes: order, duration and region of late activation in hearts of mouse and human."""

import numpy as np
import pytest

from echotruth.config import Config
from echotruth.config.building import configure
from echotruth.mechanics.activation_map import activation_times
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.wall import wall

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2}


def heart(species="mouse", **activation):
    config = Config(geometry=COARSE | {"preset": species}, loop={"kind": "circulation"})
    return configure(config, **{f"pathology.activation.{key}": value for key, value in activation.items()})


def mapped(config):
    """Mesh, azimuth of the nodes (deg), and their times (ms)."""
    mesh = left_ventricle(config.geometry)
    times = activation_times(mesh, wall_depth(mesh), config.pathology.activation, config.fibres)
    return mesh, np.degrees(np.arctan2(mesh.nodes[:, 1], mesh.nodes[:, 0])), 1e3 * times


@pytest.mark.parametrize(
    ("species", "preset", "shortest", "longest"),
    [
        # The epicardium of people is activated within 63 to 96 ms of the onset of QRS (Circulation 59 (1979) 26), in
        # left bundle branch block within 113 to 140 (Circulation 61 (1980) 696); the QRS of a mouse lasts 11.5 ms.
        ("human", "normal", 40, 80),
        ("human", "lbbb", 113, 150),
        ("mouse", "normal", 6, 13),
        ("mouse", "lbbb", 15, 22),
    ],
)
def test_activation_takes_as_long_as_in_life(species, preset, shortest, longest):
    _, _, times = mapped(heart(species, preset=preset))
    assert times.min() < 0.1 * longest
    assert shortest < times.max() < longest


def test_left_bundle_branch_block_crosses_the_septum_and_ends_in_the_lateral_wall():
    mesh, azimuth, times = mapped(heart("human", preset="lbbb"))
    septal = np.abs(azimuth) < 30
    endo, epi = (np.unique(side) for side in (mesh.endo, mesh.epi))
    crossing = times[endo].min()
    assert times[epi].min() < 5 and 15 < crossing < 45
    assert times[septal].mean() < 0.5 * times[np.abs(azimuth) > 150].mean()
    assert np.abs(azimuth[times.argmax()]) > 140


def test_normally_the_endocardium_comes_first_and_the_base_last():
    mesh, _, times = mapped(heart("human", preset="normal"))
    endo, epi = (np.unique(side) for side in (mesh.endo, mesh.epi))
    assert times[endo].mean() < times[epi].mean() - 10
    assert mesh.nodes[times.argmax(), 2] > -5e-3


def test_times_hardly_depend_on_the_mesh():
    _, _, coarse = mapped(heart("human", preset="lbbb"))
    config = configure(heart("human", preset="lbbb"), **{"geometry.circumferential_elements": 36})
    _, _, fine = mapped(config)
    assert coarse.mean() == pytest.approx(fine.mean(), rel=0.05)
    assert coarse.max() == pytest.approx(fine.max(), rel=0.05)


def test_the_muscle_around_a_lead_is_early_and_a_late_site_changes_nothing():
    lead = {"position": 0.5, "azimuth_deg": 180.0, "depth": 1.0}
    paced = heart(sites=[lead])
    _, azimuth, times = mapped(paced)
    assert times[np.abs(azimuth) > 150].mean() < 0.6 * times[np.abs(azimuth) < 30].mean()
    _, _, same = mapped(heart(sites=[lead, {"time_ms": 100.0}]))
    np.testing.assert_array_equal(same, times)


def test_tissue_is_late_that_a_normal_wave_has_passed_long_since():
    blocked, normal, healthy = heart(preset="lbbb"), heart(preset="normal"), heart()
    found, usual, none = (wall(one, left_ventricle(one.geometry)).tissue for one in (blocked, normal, healthy))
    assert not none.activation_delay.any() and not none.region.any() and not usual.region.any()
    late = found.region == 3
    assert 0.3 < late.mean() < 0.7
    assert found.activation_delay[late].min() > usual.activation_delay.max()
    assert found.activation_delay[~late].max() <= usual.activation_delay.max()


def test_a_scar_goes_before_lateness():
    scarred = configure(
        heart(preset="lbbb"), **{"pathology.infarct.segments": [11], "pathology.infarct.border_mm": 0.3}
    )
    assert set(wall(scarred, left_ventricle(scarred.geometry)).tissue.region) == {0, 1, 2, 3}
