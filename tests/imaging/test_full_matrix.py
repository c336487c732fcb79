"""The RF against the exact sum over elements, and the laws it must keep."""

import numba
import numpy as np
import pytest

from benchmarks.exact_sum import exact_matrix
from echotruth.config import Probe
from echotruth.config.realism import Shadow
from echotruth.imaging.recorder import LENS_ACCURACY
from echotruth.imaging.rf import clusters, full_matrix
from echotruth.imaging.rf.full_matrix import PLANE_ACCURACY, FullMatrix
from echotruth.imaging.rf.shadow import Rib

CENTRE = 25e6
DEVIATION = 12.5e6 / np.sqrt(8 * np.log(2))
DEPTH = 11e-3


@pytest.fixture(scope="module")
def matrix():
    return FullMatrix(Probe(), DEPTH)


def sector(number, seed=0, elevation=0.0, nearest=3e-3, farthest=10e-3, half_angle=32.0):
    """Positions (m) and amplitudes of scatterers at random in a sector."""
    random = np.random.default_rng(seed)
    angle = np.radians(random.uniform(-half_angle, half_angle, number))
    range_ = random.uniform(nearest, farthest, number)
    beside = random.uniform(-elevation, elevation, number)
    return np.stack([range_ * np.sin(angle), range_ * np.cos(angle), beside], axis=1), random.standard_normal(number)


def relative(estimate, exact):
    return np.linalg.norm(estimate - exact) / np.linalg.norm(exact)


def error(probe, position, amplitude, lens=False, **options):
    """Relative L2 error against the exact sum, of every sixth frequency."""
    matrix = FullMatrix(probe, options.pop("depth", DEPTH), elevation=lens, **options)
    found = matrix(position, amplitude)[::6]
    return relative(found, exact_matrix(probe, position, amplitude, matrix.frequency[::6], elevation=lens))


@pytest.mark.parametrize("attenuation", [0.0, 1.0])
def test_in_the_plane_the_rf_is_the_exact_sum_with_directivity_and_attenuation(attenuation):
    probe = Probe(attenuation_dB_per_cm_MHz=attenuation)
    assert error(probe, *sector(60)) < PLANE_ACCURACY


def test_nearer_than_half_of_a_long_array_the_rf_is_the_exact_sum_too():
    """Echoes of few elements determine those of all there too; angles differ, so that directivities fit less well."""
    position, amplitude = sector(6, nearest=1.5e-3, farthest=2.9e-3)
    assert error(Probe(elements=128), position, amplitude) < 10 * PLANE_ACCURACY


def test_the_memory_of_the_spectra_of_clusters_is_bounded(monkeypatch):
    """Expanded one after the other, the clusters give the sum that they give together."""
    monkeypatch.setattr(clusters, "FEWEST", 0)
    position, amplitude = sector(30)
    matrix = FullMatrix(Probe(elements=16), DEPTH, elevation=False)
    together = matrix(position, amplitude)
    monkeypatch.setattr(full_matrix, "EXPANDED", 0)
    np.testing.assert_allclose(matrix(position, amplitude), together, atol=1e-5 * np.abs(together).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    "preset, scale, half_angle",
    [("mouse_40MHz", 1, 24), ("human_3MHz", 12, 32)],
)
def test_other_arrays_come_as_near_to_the_exact_sum(preset, scale, half_angle):
    """Elements of 0.88 wavelengths only within 24 degrees: further out their echoes are longer than a kernel."""
    probe = Probe(preset=preset, attenuation_dB_per_cm_MHz=0.5)
    position, amplitude = sector(20, nearest=4e-3 * scale, farthest=10e-3 * scale, half_angle=half_angle)
    assert error(probe, position, amplitude, depth=11e-3 * scale) < PLANE_ACCURACY


@pytest.mark.parametrize(
    "preset, scale, depth, edge_width",
    [
        ("mouse_25MHz", 1, 1.5e-3, 0.5e-3),
        ("mouse_25MHz", 1, 4e-3, 0.5e-3),
        pytest.param("human_2_7MHz", 12, 1.5e-3, 0.5e-3, marks=pytest.mark.slow),
    ],
)
def test_behind_a_rib_the_rf_is_the_exact_sum_of_what_passes(preset, scale, depth, edge_width):
    probe = Probe(preset=preset)
    edges = {"edge_deg": 3.0, "edge_width_mm": edge_width * scale * 1e3}
    rib = Rib(Shadow(side="right", depth_mm=depth * scale * 1e3, **edges))
    position, amplitude = sector(80, nearest=2e-3 * scale, farthest=10e-3 * scale, half_angle=24)
    matrix = FullMatrix(probe, DEPTH * scale, elevation=False)
    exact = exact_matrix(probe, position, amplitude, matrix.frequency[::24], elevation=False, rib=rib)
    shaded, clear = matrix.behind(rib)(position, amplitude)[::24], matrix(position, amplitude)[::24]
    assert relative(shaded, exact) < 1.5 * PLANE_ACCURACY < 1e-3 * relative(clear, exact)


def lens_errors(probe, depth, beside, bands, harmonic=False):
    """Relative L2 error of scatterers in the beam for each band of ranges, mm, at a dozen frequencies."""
    matrix, errors = FullMatrix(probe, depth, harmonic=harmonic), []
    some = slice(None, None, len(matrix.frequency) // 12)
    for nearest, farthest in bands:
        position, amplitude = sector(60, elevation=beside, nearest=nearest * 1e-3, farthest=farthest * 1e-3)
        inside = matrix.in_beam(position)
        scatterers = position[inside], amplitude[inside]
        exact = exact_matrix(probe, *scatterers, matrix.frequency[some], harmonic=harmonic)
        errors.append(relative(matrix(*scatterers)[some], exact))
    return np.array(errors)


@pytest.mark.parametrize(
    "preset, attenuation, depth, beside, bands",
    [
        ("mouse_25MHz", 0.0, DEPTH, 0.7e-3, [(1, 1.4), (1.4, 2), (2, 3), (3, 4), (4, 5.5), (5.5, 11)]),
        pytest.param("human_2_7MHz", 0.5, 120e-3, 7e-3, [(12, 18), (25, 40), (60, 120)], marks=pytest.mark.slow),
        pytest.param("mouse_40MHz", 0.5, DEPTH, 0.7e-3, [(1, 2), (4, 11)], marks=pytest.mark.slow),
    ],
)
def test_under_the_lens_the_rf_is_the_fresnel_integral_at_all_ranges(preset, attenuation, depth, beside, bands):
    probe = Probe(preset=preset, attenuation_dB_per_cm_MHz=attenuation)
    assert (lens_errors(probe, depth, beside, bands) < LENS_ACCURACY).all()


@pytest.mark.parametrize(
    "preset, depth, beside, bands",
    [
        ("mouse_25MHz", DEPTH, 0.5e-3, [(1, 2), (2, 3.5), (3.5, 11)]),
        pytest.param("human_2_7MHz", 120e-3, 7e-3, [(12, 18), (25, 40), (60, 120)], marks=pytest.mark.slow),
    ],
)
def test_under_the_lens_the_rf_of_a_harmonic_is_the_product_of_the_beam_at_half_the_frequency_squared_and_the_beam(
    preset, depth, beside, bands
):
    """In a band for which six frequencies determine the sum near the array, and in one for which three do."""
    probe = Probe(preset=preset, bandwidth=0.5 if preset == "mouse_25MHz" else 0.11, attenuation_dB_per_cm_MHz=0.5)
    assert (lens_errors(probe, depth, beside, bands, harmonic=True) < LENS_ACCURACY).all()


def test_behind_a_rib_near_the_array_the_rf_under_the_lens_is_the_exact_sum_of_what_passes():
    rib = Rib(Shadow(side="right", depth_mm=1.2, edge_deg=3.0, edge_width_mm=0.5))
    position, amplitude = sector(60, elevation=0.3e-3, nearest=1.5e-3, farthest=3e-3, half_angle=24)
    matrix = FullMatrix(Probe(), DEPTH)
    exact = exact_matrix(Probe(), position, amplitude, matrix.frequency[::24], rib=rib)
    assert relative(matrix.behind(rib)(position, amplitude)[::24], exact) < LENS_ACCURACY


def test_clusters_give_the_echoes_that_all_elements_give(monkeypatch, matrix):
    """Both kinds of echoes, those that are spread and those that are summed, with two exponents."""
    position, amplitude = sector(200, elevation=4e-4, nearest=2e-3)
    exponent = np.where(np.arange(200) % 2, 2.0, 0.0)
    direct = matrix(position, amplitude, exponent)
    monkeypatch.setattr(clusters, "FEWEST", 0)
    assert 0 < relative(matrix(position, amplitude, exponent), direct) < 5e-3


def test_under_the_lens_a_scatterer_in_the_plane_is_nearly_exact():
    assert error(Probe(), np.array([[0.4e-3, 6.5e-3, 0.0]]), np.ones(1), lens=True) < 2e-3


def test_band_reaches_the_faint_edges_of_the_pulse(matrix):
    weight = np.exp(-((matrix.frequency[[0, -1]] - CENTRE) ** 2) / (2 * DEVIATION**2))
    assert (weight < 0.02).all()


def test_sending_and_receiving_can_be_swapped(matrix):
    echoes = matrix(*sector(50, elevation=3e-4))
    assert (echoes == echoes.transpose(0, 2, 1)).all()


def test_echoes_superpose(matrix):
    position, amplitude = sector(60, elevation=3e-4)
    parts = matrix(position[:25], amplitude[:25]) + matrix(position[25:], amplitude[25:])
    # Echoes that are summed are cut where those of the last neighbour are over.
    assert relative(matrix(position, amplitude), parts) < 1e-4


def test_scatterers_out_of_the_record_or_the_beam_are_left_out(matrix):
    far = np.array([[0.0, 13e-3, 0.0], [0.0, 6.5e-3, 5e-3]])
    assert not matrix.in_beam(far).any()
    assert not matrix(far, np.ones(2)).any()
    assert matrix.in_beam(np.array([[0.0, 6.5e-3, 0.0]])).all()


@pytest.mark.parametrize("options", [{}, {"harmonic": True}, {"elevation": False}])
def test_bytes_do_not_depend_on_threads(options):
    position, amplitude = sector(500, elevation=5e-4, nearest=1e-3)
    results = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(FullMatrix(Probe(), DEPTH, **options)(position, amplitude).tobytes())
    numba.set_num_threads(1)
    assert results[0] == results[1]


@pytest.mark.parametrize("elements", [2, 17])
def test_every_pair_is_filled_whatever_the_number_of_elements(elements):
    position, amplitude = sector(10)
    assert error(Probe(elements=elements), position, amplitude) < 2e-5


def test_a_record_too_long_for_integer_times_is_refused():
    with pytest.raises(ValueError, match="too long"):
        FullMatrix(Probe(), 0.4)


def test_no_record_is_a_multiple_of_256_samples_long():
    """Or the traces of all pairs would share a few cache lines."""
    probe = Probe()
    lengths = {FullMatrix(probe, depth, elevation=False).samples for depth in np.linspace(11e-3, 12.5e-3, 7)}
    assert len(lengths) > 2 and all(length % 256 for length in lengths)
