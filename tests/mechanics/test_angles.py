"""Angles of fibres and sheets mean what they mean in the literature, written down anew here."""

from types import SimpleNamespace

import numpy as np
import pytest

from echotruth.mechanics import angles
from echotruth.mechanics.fibres import axes_from_normal

INNER, OUTER = 1.0e-3, 2.0e-3


@pytest.fixture(scope="module")
def tube():
    """Points of a tube about the long axis, where the gradients of Laplace's equation are known.

    The potential through the wall is log(r / INNER) / log(OUTER / INNER), from apex to base it is linear in z.
    """
    random = np.random.default_rng(3)
    azimuth, radius = random.uniform(-np.pi, np.pi, 500), np.append(random.uniform(INNER, OUTER, 498), [INNER, OUTER])
    alpha, transverse, beta = random.uniform(-1.5, 1.5, (3, 500)) * np.array([[1.0], [0.8], [1.0]])
    outwards = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(500)])
    return SimpleNamespace(
        outwards=outwards,
        axes=axes_from_normal(outwards),
        upwards=np.tile([0, 0, 1.0], (500, 1)),
        depth=(radius - INNER) / (OUTER - INNER),
        potential=np.log(radius / INNER) / np.log(OUTER / INNER),
        alpha=alpha,
        transverse=transverse,
        beta=beta,
    )


def axis(upwards, outwards):
    """Bayer 2012: columns circumferential, longitudinal, transmural, of two gradients."""
    longitudinal = upwards / np.linalg.norm(upwards, axis=-1, keepdims=True)
    transmural = outwards - np.sum(outwards * longitudinal, axis=-1, keepdims=True) * longitudinal
    transmural /= np.linalg.norm(transmural, axis=-1, keepdims=True)
    return np.stack([np.cross(longitudinal, transmural), longitudinal, transmural], axis=-1)


def orient(frame, alpha, beta):
    """Bayer 2012: turned by alpha about the transmural axis, then by beta about the fibre."""
    zero, one = np.zeros_like(alpha), np.ones_like(alpha)
    about_transmural = np.array(
        [[np.cos(alpha), -np.sin(alpha), zero], [np.sin(alpha), np.cos(alpha), zero], [zero, zero, one]]
    )
    about_fibre = np.array([[one, zero, zero], [zero, np.cos(beta), np.sin(beta)], [zero, -np.sin(beta), np.cos(beta)]])
    return frame @ np.moveaxis(about_transmural, -1, 0) @ np.moveaxis(about_fibre, -1, 0)


def test_helix_and_sheet_angle_are_alpha_and_beta_of_bayer(tube):
    ours = angles.frames_from_angles(tube.axes, tube.alpha, np.zeros(500), tube.beta)
    theirs = orient(axis(tube.upwards, tube.outwards), tube.alpha, tube.beta)
    np.testing.assert_allclose(ours, theirs.swapaxes(-1, -2), atol=1e-14)


def test_transverse_angle_is_that_of_the_fibre_seen_along_the_long_axis(tube):
    frames = angles.frames_from_angles(tube.axes, tube.alpha, tube.transverse, tube.beta)
    np.testing.assert_allclose(np.linalg.det(frames), 1)
    fibre = frames[:, 0]
    around = np.cross([0, 0, 1.0], tube.outwards)
    outwards, around, up = (np.sum(fibre * way, axis=-1) for way in (tube.outwards, around, tube.upwards))
    np.testing.assert_allclose(np.arctan(outwards / around), tube.transverse, atol=1e-9)
    np.testing.assert_allclose(np.arctan(up / around), tube.alpha, atol=1e-9)


def test_angles_come_back(tube):
    frames = angles.frames_from_angles(tube.axes, tube.alpha, tube.transverse, tube.beta)
    np.testing.assert_allclose(
        angles.angles_from_frames(frames, tube.axes), [tube.alpha, tube.transverse, tube.beta], atol=1e-9
    )


def test_neither_fibre_nor_sheet_has_a_head(tube):
    frames = angles.frames_from_angles(tube.axes, tube.alpha, tube.transverse, tube.beta)
    for head in ([-1.0, -1, 1], [-1, 1, -1], [1, -1, -1]):
        flipped = frames * np.array(head)[:, None]
        np.testing.assert_allclose(
            angles.angles_from_frames(flipped, tube.axes), angles.angles_from_frames(frames, tube.axes), atol=1e-9
        )


@pytest.mark.parametrize("epi", [-20.0, -60.0])
def test_our_rule_and_ldrb_part_where_the_conventions_say(tube, epi):
    """The package of Bayer's rule, fed with the gradients of the tube."""
    calculus = pytest.importorskip("ldrb.calculus")

    def ldrb(beta, epi_only):
        n, nothing, found = len(tube.depth), np.zeros(3 * len(tube.depth)), np.zeros((3, 3 * len(tube.depth)))
        dofs = (*(np.arange(i, 3 * n, 3) for i in range(3)), np.arange(n))
        scalars = 1 - tube.potential, np.zeros(n), tube.potential, np.ones(n)
        outwards = tube.outwards.ravel()
        gradients = -outwards, nothing, outwards, tube.upwards.ravel(), np.zeros(n)
        chambers = 3 * (60.0, epi), 3 * beta
        calculus.compute_fiber_sheet_system(*found, *dofs, *scalars, *gradients, *chambers[0], *chambers[1], epi_only)
        return found.reshape(3, n, 3).swapaxes(0, 1)

    def rule(helix, sheet):
        return angles.frames_from_angles(tube.axes, np.radians(helix), np.zeros(500), np.radians(sheet))

    at = tube.potential
    linear = rule(60 + (epi - 60) * at, -65 + 90 * at)
    np.testing.assert_allclose(ldrb((-65.0, 25.0), epi_only=True), linear, atol=1e-12)
    # The whole of it blends in the endocardial frame once more; beyond a right angle, the other way round.
    helix = angles.angles_from_frames(ldrb((0.0, 0.0), epi_only=False), tube.axes)[0]
    span = (epi - 60) * at
    blended = 60 + at * np.where(span < -90, span + 180, span)
    np.testing.assert_allclose(np.sin(2 * helix), np.sin(2 * np.radians(blended)), atol=1e-4)
