"""What is known of a case and of its trackers, as text for the page."""

from html import escape
from typing import Any

import numpy as np

from echotruth.viewer.clip import Clip

SCORES = {"nrmse_all": ("NRMSE", 100.0, "%"), "coverage": ("coverage", 100.0, "%")}
"""Score to its name, and factor and unit in which it is shown."""
MEASURES = {
    "ejection_fraction": ("ejection fraction", 100.0, "%"),
    "gls": ("GLS", 100.0, "%"),
    "twist_peak": ("peak twist", np.degrees(1), "°"),
}


def text(clip: Clip, trackers: list[str]) -> str:
    """Verdict on the case, its measures and what is particular about it, and the scores of trackers, as HTML.

    Parameters
    ----------
    clip : Clip
    trackers : list of str
        Names that the repository does not know are left out.
    """
    repository = clip.repository
    status, reason = repository.verdict(clip.case)
    verdict = status if status == "complete" else f"<b>{escape(status)}</b>"
    lines = [f"{escape(clip.case)}: {verdict}" + (f" ({escape(reason)})" if reason else "")]
    lines.append(_numbers(clip.of_heart("physiology", *MEASURES), MEASURES))
    lines += [f"{escape(name)}: {_scores(clip, name)}" for name in trackers if name in repository.trackers]
    particular = [
        f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
        for name, value in repository.distinctions.loc[clip.case].items()
        if value not in ("", None)
    ]
    lines.append(escape(", ".join(particular)))
    return "<br>".join(line for line in lines if line)


def _scores(clip: Clip, tracker: str) -> str:
    if "tracking" not in clip.parts:
        return "not tracked yet"
    try:
        return _numbers(clip.tracked(tracker, *SCORES), SCORES) or "unknown"
    except ValueError:  # of a tracker from outside
        return "not evaluated on this clip"


def _numbers(values: dict[str, Any], shown: dict[str, tuple[str, float, str]]) -> str:
    """Those of some numbers that are known, in words."""
    return ", ".join(
        f"{name} {factor * float(values[label]):.3g} {unit}"
        for label, (name, factor, unit) in shown.items()
        if label in values and np.isfinite(values[label])
    )
