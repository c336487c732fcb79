"""Time and memory that a job asks a cluster for, from what its work is expected to take.

Asked is three times the time and one and a half times the memory, because nodes differ.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

from echotruth.config import Config
from echotruth.workflow import expected_cost
from echotruth.workflow.imaged_tissue import rough_ellipsoid

TIME_MARGIN = 3.0
"""Time asked for over the time expected."""
MEMORY_MARGIN = 1.5
"""Memory asked for over the memory expected."""
START_SECONDS = 120.0
"""Time to start a process and, once, to compile its functions, s."""


class Demand(NamedTuple):
    """Time, min, and memory, MB, that a job asks for."""

    minutes: int
    megabytes: int


def mechanics(config: Config) -> Demand:
    """Demand of the mechanics and the measures of a heart."""
    return _demand(expected_cost.mechanics_seconds(config), expected_cost.mechanics_megabytes(config))


def images(config: Config) -> Demand:
    """Demand of the phantom, the truth, RF, B-mode, tracking and scores of a view, of the one that takes longest."""
    return _demand(_seconds(config)[0], expected_cost.images_megabytes(config))


def tracking(config: Config) -> Demand:
    """Demand of the tracking and the scores of a view, of the one that takes longest."""
    return _demand(_seconds(config)[1], expected_cost.tracking_megabytes(config))


def publication(cases: int, views: int) -> Demand:
    """Demand of the verification of a repository, and of its report."""
    return _demand(60 + 0.5 * cases * views, 1100 + 0.1 * cases * views)


_known: dict[tuple[object, ...], tuple[float, float, tuple[object, ...]]] = {}
"""Expected times by wall and sections, which most hearts of a sweep share; the sections stay, so that no other gets the
place of one of them in memory."""


def _seconds(config: Config) -> tuple[float, float]:
    """Expected CPU time of the longest view, s: of all its stages, and of tracking and scores alone."""
    loop = config.loop.frames, config.motion.kind, config.geometry.file
    sections: tuple[object, ...] = (
        config.phantom,
        config.probe,
        config.rf,
        config.realism,
        config.bmode,
        config.tracking,
    )
    sections += tuple(config.views.values())
    key = (rough_ellipsoid(config), *loop, *map(id, sections))
    if key not in _known:
        views = [expected_cost.view_seconds(config, view, is_rough=True) for view in config.views]
        whole = max(sum(view.values()) for view in views)
        _known[key] = whole, max(view["tracking"] + view["evaluation"] for view in views), sections
    return _known[key][:2]


def _demand(seconds: float, megabytes: float) -> Demand:
    minutes = ceil(TIME_MARGIN * (START_SECONDS + seconds) / 60)
    return Demand(minutes, 100 * ceil(MEMORY_MARGIN * megabytes / 100))
