"""Rows of one heart: it is solved, imaged, tracked and scored as a run does it, and its images are thrown away.

Unlike a run, truth is made at the points that are tracked alone, and labels at end-diastole alone.
"""

from __future__ import annotations

import resource
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from hashlib import sha256
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from echotruth.cases import Case
from echotruth.config import Config
from echotruth.config.diagnosis import diagnosis
from echotruth.evaluation import segment_strain
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.clip import Clip, make_clip
from echotruth.evaluation.clip_metrics import ClipTruth, clip_rows
from echotruth.evaluation.curves import REFERENCE
from echotruth.evaluation.point_tracks import SIDE
from echotruth.evaluation.points import Truth, ground_truth
from echotruth.evaluation.scoring import estimated, scored_estimate
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.labels import unpack
from echotruth.imaging.recorder import sixteen_bit
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.tracks import visible
from echotruth.imaging.truth import PixelTruth
from echotruth.imaging.view import Plane, before_probe
from echotruth.loop.cycle import frame_times
from echotruth.repository.datasets import as_stored
from echotruth.repository.schema import LABELS
from echotruth.repository.version import version_of
from echotruth.seeds import generator
from echotruth.tracking.closure import closure
from echotruth.tracking.point_grid import grid_pixels, grid_positions
from echotruth.units import mm

from .columns import ROTATION, packed_reliability, packed_segments
from .hearts import SuiteCase, cases_of, suite_version, usable_heart

Row = dict[str, Any]
Labels = dict[int, np.ndarray]
"""Image size -> packed labels at end-diastole, (3, axial, lateral)."""


def heart_rows(heart: Mapping[str, Any], trackers: dict[str, Any] | None = None) -> list[Row]:
    """Rows of all cases of a heart.

    Parameters
    ----------
    heart : mapping
        Row of the plan.
    trackers : dict, optional
        By name, as in a configuration. Default: those of the suite.
    """
    # BLAS sums depend on the number of threads, and the bytes must not.
    with threadpool_limits(1):
        return [
            row | {"attempt": attempt}
            for attempt, one, solved, view in heart_views(heart, trackers)
            for row in view_rows(one, solved, view)
        ]


def heart_views(
    heart: Mapping[str, Any], trackers: dict[str, Any] | None = None
) -> Iterator[tuple[int, SuiteCase, Heart, str]]:
    """Attempt, case, solved heart and name of every view of a heart; the arguments are those of :func:`heart_rows`."""
    attempt, solved = usable_heart(heart)
    for one in cases_of(heart, attempt, trackers):
        for view in one.case.config.views:
            yield attempt, one, replace(solved, config=one.case.config), view


def view_rows(one: SuiteCase, heart: Heart, view: str) -> Iterator[Row]:
    """Rows of one view of a case, of every image size and tracker."""
    case, config = one.case, one.case.config
    truth, labels, clips = view_clips(case, heart, view)
    points = clip_truth(config, view, truth, labels)
    for clip in clips:
        keys = one.sorts | {"view": view, "size_px": clip.size} | _about(config, heart, view, clip)
        for name, settings in config.tracking.trackers.items():
            began = _cpu_time()
            estimate, failure = estimated(clip, settings)
            own = {"tracker": name, "failure": failure, "cpu_s": _cpu_time() - began}
            found = scored_estimate(clip, truth, estimate)
            tracked = found | as_stored(case, {"tracking/TRACKER": found})["tracking/TRACKER"]
            row, segments, steps = clip_rows(tracked, points)
            turned = truth.courses["rotation"][truth.es], tracked["tracked_rotation"][truth.es]
            row |= dict(zip(ROTATION, np.degrees(turned), strict=True))
            yield (
                keys
                | own
                | {"configuration": version_of("tracking", config, view, name)}
                | row
                | packed_segments(segments)
                | packed_reliability(steps)
            )


def view_clips(case: Case, heart: Heart, view: str) -> tuple[Truth, Labels, list[Clip]]:
    """Truth and labels of a view, and its clip of each size."""
    config = case.config
    moving, plane = before_probe(heart, config, view)
    truth, labels = ground_truth(moving, plane, config.views[view].plane, config), _labels(config, moving, plane)
    images = imaged(case, moving, plane, view).items()
    return truth, labels, [make_clip(case, view, frames, labels[size], truth.inside) for size, frames in images]


def _cpu_time() -> float:
    """User and system time of this process and of those that it started and that have ended, s."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in spent)


def imaged(case: Case, moving: Heart, plane: Plane, view: str) -> dict[int, np.ndarray]:
    """Clips of a view, (frame, axial, lateral), uint8, by image size."""
    config, random = case.config, partial(generator, case, view)
    sequence = Sequence(config, moving, plane, random)
    scatterers = as_stored(case, {"phantom": sequence.scatterers()})["phantom"]
    lines, range_ = sixteen_bit(sequence.lines(scatterers)), sequence.scanner.range
    gain = clip_gain(config.probe, config.bmode, lines.shape[:2], range_, random("dropout"))
    return bmode_clip(lines, sequence.scanner.scan, range_, config.bmode, gain, config.views[view].motion.is_closed)


def _labels(config: Config, moving: Heart, plane: Plane) -> Labels:
    first = replace(moving, displacement=moving.displacement[:1])
    return {
        size: PixelTruth(first, plane, *pixel_centres(config.bmode, size))["labels"][0] for size in config.bmode.sizes
    }


def clip_truth(config: Config, view: str, truth: Truth, labels: Labels) -> ClipTruth:
    """Truth of a view as the metrics of clips take it."""
    unit, inside = config.bmode.field_of_view_mm * mm / SIDE, truth.inside
    tissue = {
        name: values[grid_pixels(config)][inside] for name, values in unpack(labels[config.bmode.size_px]).items()
    }
    position = np.column_stack([grid_positions(config)[inside], np.zeros(inside.sum())])
    displacement = np.dstack([truth.displacement, truth.through_plane])
    plane, engineering = REFERENCES.index(REFERENCE), LABELS["measure"].index("engineering")
    return ClipTruth(
        inside=inside,
        displacement=displacement / unit,
        visible=visible(config, position + displacement),
        unit=unit,
        tissue=segment_strain.Tissue(tissue["layer"], tissue["segment"], tissue["region"], layers=config.fibres.layers),
        plane=config.views[view].plane,
        time=frame_times(config.loop),
        es=truth.es,
        curves={
            "segment_strain": truth.courses["segment_strain"][plane, :, engineering],
            "line_strain": truth.courses["line_strain"],
        },
    )


def _about(config: Config, heart: Heart, view: str, clip: Clip) -> Row:
    """Columns of :data:`.columns.ABOUT` and `HASHES` that do not depend on the tracker."""
    return {
        "plane": config.views[view].plane,
        "diagnosis": diagnosis(config),
        "ejection_fraction_percent": 100 * float(heart.arrays["physiology"]["ejection_fraction"]),
        "is_closed": clip.is_closed,
        "judged_closed": not closure(clip.frames[:: clip.frame_step], clip.mask).is_open,
        "code": suite_version(),
        "images": sha256(clip.frames.tobytes()).hexdigest()[:16],
    }
