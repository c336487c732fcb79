"""What is known of a case and of its trackers, as text for the page."""

from __future__ import annotations

from html import escape

import numpy as np

from echotruth.viewer.clip import Clip

SCORES = {"nrmse_all": ("NRMSE", 100, "%"), "coverage": ("coverage", 100, "%")}
"""Score to its name, and factor and unit in which it is shown."""
MEASURES = {
    "ejection_fraction": ("ejection fraction", 100, "%"),
    "gls": ("GLS", 100, "%"),
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
    repository, case = clip.repository, clip.case
    known = repository.cases.loc[case].to_dict()
    status, reason, _ = (known.pop(name) for name in ("status", "reason", "heart"))
    verdict = status if status == "complete" else f"<b>{escape(status)}</b>"
    lines = [f"{escape(case)}: {verdict}" + (f" ({escape(reason)})" if reason else "")]
    lines.append(", ".join(_measures(clip)))
    lines += [f"{escape(name)}: {', '.join(_scores(clip, name))}" for name in trackers if name in repository.trackers]
    particular = [
        f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
        for name, value in known.items()
        if value not in ("", None)
    ]
    lines.append(escape(", ".join(particular)))
    return "<br>".join(line for line in lines if line)


def _measures(clip: Clip) -> list[str]:
    repository = clip.repository
    if not repository.is_written("physiology/scalars", clip.case):
        return []
    values = repository.arrays("physiology", clip.case)
    return [
        f"{name} {_number(factor * float(values[label]))} {unit}"
        for label, (name, factor, unit) in MEASURES.items()
        if label in values and np.isfinite(values[label])
    ]


def _scores(clip: Clip, tracker: str) -> list[str]:
    if not clip.has("evaluation"):
        return ["not tracked yet"]
    try:
        found = clip.tracked(tracker, *SCORES)
    except ValueError:  # of a tracker from outside
        return ["not evaluated on this clip"]
    return [f"{name} {_number(factor * float(found[label]))} {unit}" for label, (name, factor, unit) in SCORES.items()]


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "unknown"
