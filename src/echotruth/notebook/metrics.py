"""Metrics of the clips of a repository, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from echotruth.evaluation import clip_metrics as tables
from echotruth.evaluation.clip_metrics import ClipMetrics
from echotruth.repository.ledger import repository_folder


def clip_metrics(
    repository: str | Path,
    cases: Sequence[str] | None = None,
    views: Sequence[str] | None = None,
    sizes: Sequence[int] | None = None,
    trackers: Sequence[str] | None = None,
) -> ClipMetrics:
    """Read the metrics of all clips and trackers, as benchmarks of trackers and of strain print them (docs/metrics.md).

    Parameters
    ----------
    repository : str or Path
        A repository, finished or not.
    cases, views, sizes, trackers : sequence, optional
        Those to include. Default: all that was evaluated.

    Returns
    -------
    ClipMetrics
        Three tables. `clips` has a row per case, view, size_px and tracker; `segments` one per clip, tracker, AHA
        segment and component of strain; `reliability` one per clip, tracker and tenth of quality. docs/metrics.md
        tells their columns, which name their units. All begin with case, view, plane, size_px and tracker, and with
        heart, split, group, acoustics and variation, which are labels of the table of cases, "" where it has none
        (without a label, heart is that of the first case with the same motion), and the diagnosis.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, size or tracker.

    Examples
    --------
    >>> import echotruth as et
    >>> clips = et.clip_metrics("out/demo", views=["mid"], sizes=[128], trackers=["dis", "bspline_dic"]).clips
    >>> list(clips["tracker"]), bool(clips["delta_avg_percent"].between(0, 100).all())
    (['dis', 'bspline_dic'], True)
    """
    return tables.clip_metrics(repository_folder(repository), cases, views, sizes, trackers)
