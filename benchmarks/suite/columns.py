"""Columns of the tables of scores: a row per case, view, image size and tracker.

Beside those named here there is each metric of a clip, by the names of
:attr:`echotruth.evaluation.clip_metrics.ClipMetrics.clips` (docs/metrics.md). Segments and steps of quality are columns
of their own, which :func:`segments` and :func:`reliability` turn into rows.
"""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from echotruth.evaluation import reliability as steps
from echotruth.evaluation import segment_strain
from echotruth.evaluation.displacement_error import SEGMENTS
from echotruth.evaluation.segment_strain import Row

IDENTITY = (
    *("part", "split", "species", "heart", "group", "disease", "acoustics", "variation"),
    *("case", "view", "size_px", "tracker"),
)
"""`split` is develop or test; `species` mouse or human; `group` healthy, infarct, late_activation, hypertrophy or
dilation; `disease` healthy or diseased; `acoustics` realistic or ideal; `variation` none, motion, shadow or low_rate,
drawn conditions of realistic clips, which count as the others do."""

ABOUT = ("attempt", "plane", "diagnosis", "ejection_fraction_percent", "failure", "is_closed", "judged_closed")
"""`attempt` is the draw that gave a usable heart; `diagnosis` as in cases.csv (earlier parts: fresh, late, unknown);
`failure` why the tracker found nothing, or ""; `is_closed` whether the last frame is followed by the first, and
`judged_closed` whether the trackers think so."""

ROTATION = ("true_rotation_es_deg", "tracked_rotation_es_deg")
"""Of the wall about its centroid in a short axis."""

HASHES = ("code", "configuration", "images")
"""Of the code and the configurations of the whole suite, of those of the view with the settings of the tracker, and of
the images of the clip."""

TEXT = (*(name for name in IDENTITY if name not in ("part", "size_px")), "plane", "diagnosis", "failure", *HASHES)

OF_SEGMENT = segment_strain.COLUMNS[2:]
"""Columns of a segment and component: those of the long table less `aha` and `component`."""

OF_COMPONENT = tuple(name for name in OF_SEGMENT if name.startswith(segment_strain.WHAT))
"""Those of them that differ from component to component."""

TANGENTIAL = {"short_axis": "circumferential", "long_axis": "longitudinal"}
"""Plane -> the component of strain along the wall."""

PREFIX = {True: f"{segment_strain.RADIAL}_", False: ""}
"""Whether a component is radial -> what its columns begin with."""


def packed_segments(rows: Iterable[Row]) -> Row:
    """Columns of the strain of segments: `NAME_SS`, SS the AHA segment, as `true_es_percent_07`; radial ones begin with
    `radial_`."""
    found: Row = {}
    for row in rows:
        is_radial = row["component"] == segment_strain.RADIAL
        names = OF_COMPONENT if is_radial else OF_SEGMENT
        found |= {f"{PREFIX[is_radial]}{name}_{int(row['aha']):02d}": row[name] for name in names}
    return found


def packed_reliability(rows: Iterable[Row]) -> Row:
    """Columns of the steps of quality: `NAME_K`, K the step from 0, as `within_count_9`."""
    return {f"{name}_{step}": row[name] for step, row in enumerate(rows) for name in steps.COUNTS}


def segments(table: pd.DataFrame, is_radial: bool = False) -> pd.DataFrame:
    """Segments as rows: columns `IDENTITY`, and those of `ClipMetrics.segments`, of one component.

    Parameters
    ----------
    table : DataFrame
        As :func:`.parts.read_parts` returns it.
    is_radial : bool
        Whether the radial strain is wanted, and not that along the wall.
    """
    found = []
    for aha in range(1, SEGMENTS + 1):
        names = {f"{PREFIX[is_radial and name in OF_COMPONENT]}{name}_{aha:02d}": name for name in OF_SEGMENT}
        names = {column: name for column, name in names.items() if column in table}
        if names:
            component = segment_strain.RADIAL if is_radial else table["plane"].map(TANGENTIAL)
            rows = table[[*IDENTITY, *names]].rename(columns=names)
            found.append(rows.assign(aha=aha, component=component).dropna(subset=["points"]))
    return pd.concat(found, ignore_index=True)


def reliability(table: pd.DataFrame) -> pd.DataFrame:
    """Steps of quality as rows: columns `IDENTITY`, and those of `ClipMetrics.reliability`; the parameter as above."""
    found = []
    for step in range(steps.BINS):
        names = {f"{name}_{step}": name for name in steps.COUNTS}
        rows = table[[*IDENTITY, *names]].rename(columns=names)
        found.append(rows.assign(quality_low=step / steps.BINS, quality_high=(step + 1) / steps.BINS))
    return pd.concat(found, ignore_index=True)
