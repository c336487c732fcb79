"""Echoes interpolated from those of skeleton elements against the echoes themselves."""

import numpy as np
import pytest

from echotruth.config import Probe
from echotruth.imaging.rf.clusters import Clusters, add_expanded
from echotruth.imaging.rf.kernel import Band, Grid
from echotruth.imaging.rf.probe import element_centres, pulse_band, pulse_spectrum

SPEED = 1540.0


def clusters(probe, max_range, tolerance):
    low, high = pulse_band(probe)
    node, weight = np.polynomial.legendre.leggauss(24)
    frequency = (low + high) / 2 + node * (high - low) / 2
    energy = weight * pulse_spectrum(probe, frequency) ** 2
    band = Band(frequency, energy / energy.sum(), Grid(4 * high, 15.0), np.zeros(24))
    return Clusters(element_centres(probe), SPEED, band, max_range, tolerance), band


def distances(probe, position):
    """Distances (elements, scatterers), m."""
    return np.hypot(position[:, 0] - element_centres(probe)[:, None], position[:, 1])


def in_a_sector(number, nearest, farthest, seed=0):
    random = np.random.default_rng(seed)
    angle, range_ = random.uniform(-0.6, 0.6, number), random.uniform(nearest, farthest, number)
    return np.stack([range_ * np.sin(angle), range_ * np.cos(angle), np.zeros(number)], axis=1)


@pytest.mark.parametrize("preset, scale", [("mouse_40MHz", 1), ("human_2_7MHz", 12)])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_echoes_of_random_scatterers_are_interpolated_from_skeleton_elements(preset, scale, tolerance):
    probe = Probe(preset=preset)
    found, band = clusters(probe, 13e-3 * scale, tolerance)
    position = in_a_sector(300, 3e-3 * scale, 12e-3 * scale)
    error, few = [], []
    for number in np.unique(numbers := found.numbers(position)):
        cluster = found[number]
        late = distances(probe, position[numbers == number]) / SPEED - cluster.delay[:, None]
        echoes = np.exp(-2j * np.pi * np.multiply.outer(late, band.frequency))
        residual = echoes - np.einsum("fe,fsk->esk", cluster.weights, echoes[cluster.skeleton])
        error.append(np.abs(residual) ** 2 @ band.weight)
        few.append(len(cluster.skeleton))
    assert np.sqrt(np.concatenate(error, axis=1).mean()) < 2 * tolerance
    assert max(few) < 48


def test_nearer_than_an_eighth_of_the_array_all_elements_are_the_skeleton():
    probe = Probe()
    found, _ = clusters(probe, 13e-3, 1e-3)
    number = found.numbers(np.array([[0.0, 0.3e-3, 0.0], [0.2e-3, 0.2e-3, 0.0]]))
    assert number[0] == number[1]
    assert (found[number[0]].weights == np.eye(probe.elements)).all()


def test_a_scatterer_at_the_greatest_range_or_beside_the_array_has_a_cluster():
    found, _ = clusters(Probe(), 13e-3, 1e-3)
    edge = np.array([[0.0, 13e-3, 0.0], [13e-3, 1e-9, 0.0], [-13e-3, 1e-9, 0.0]])
    assert all(len(found[number].skeleton) for number in found.numbers(edge))


@pytest.mark.parametrize("elements", [33, 5])
def test_the_expansion_of_clusters_is_the_sum_of_their_weighted_and_delayed_echoes(elements):
    probe = Probe(elements=elements)
    found, band = clusters(probe, 13e-3, 1e-3)
    chosen = [found[number] for number in np.unique(found.numbers(in_a_sector(20, 4e-3, 12e-3)))][:3]
    frequency, random = band.frequency[:4], np.random.default_rng(1)
    spectra, exact = [], 0
    for cluster in chosen:
        few = len(cluster.skeleton)
        i, j = np.triu_indices(few)
        echoes = np.zeros((4, few, few), complex)
        echoes[:, i, j] = random.standard_normal((4, len(i))) + 1j * random.standard_normal((4, len(i)))
        spectra.append(echoes[:, i, j])
        echoes[:, j, i] = echoes[:, i, j]
        phasor = np.exp(-2j * np.pi * np.multiply.outer(frequency, cluster.delay))
        carry = phasor[:, None] * cluster.weights
        exact = exact + np.einsum("kfi,kfg,kgj->kij", carry, echoes, carry)
    matrix = np.zeros((4, elements, elements), np.complex64)
    add_expanded(matrix, chosen, frequency, np.concatenate(spectra, axis=1).astype(np.complex64))
    assert np.linalg.norm(matrix - exact) < 1e-6 * np.linalg.norm(exact)
