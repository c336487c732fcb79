"""Hearts before a probe, with random numbers that the name of a quantity sets."""

import numpy as np

from echotruth.imaging.medium.body import Scene
from echotruth.imaging.medium.medium import Medium, seed_medium
from echotruth.imaging.view import imaging_plane


def random(name):
    return np.random.default_rng(list(name.encode()))


def scene(config, heart, view="mid", step=4e-3):
    """A heart before the probe of a view, with frames a step, s, apart."""
    time = step * np.arange(len(heart.displacement))
    return Scene(config, heart, imaging_plane(config.views[view], config.rf, heart.endo_at_ed), random, time)


def everywhere(position):
    """As a beam that reaches all positions."""
    return np.ones(len(position), bool)


def medium(at, in_beam=everywhere):
    """The medium of a scene, and the arrays that were seeded."""
    seeded = seed_medium(at, in_beam)
    return Medium(at, seeded), seeded
