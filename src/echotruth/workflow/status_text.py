"""The status of a repository as text."""

from __future__ import annotations

from collections.abc import Iterator

from echotruth.workflow.progress import format_duration
from echotruth.workflow.status import Status

MAX_REASONS = 10
"""Largest number of hearts that are named with their reasons."""
MAX_LOGS = 5
"""Largest number of logs that are named."""
STATES = {
    "never begun": "has not been begun",
    "killed": "is not finished; its run ended without finishing ({holder}): run the configuration again",
    "stopped": "is not finished, and no run works on it: run the configuration again",
    "finished": "is finished",
}


def text(status: Status) -> str:
    """The status, a line for each part, then the hearts, then what failed."""
    return "\n".join([f"{status.folder}: {_state(status)}", *_parts(status), *verdicts(status), *_logs(status)])


def _state(status: Status) -> str:
    if status.state != "running":
        return STATES[status.state].format(holder=status.holder)
    words = [f"running ({status.holder})"]
    if status.share is not None:
        words.append(f"{100 * status.share:.0f} % of this run done")
    words.append(status.activity)
    if status.seconds_left:
        words.append(f"about {format_duration(status.seconds_left)} left")
    return ", ".join(words)


def _parts(status: Status) -> list[str]:
    if not status.parts:
        return []
    columns = ("done", "running", "failed", "waiting")
    lines = ["", f"{'':10}" + "".join(f"{column:>10}" for column in columns)]
    for name, part in status.parts.items():
        done = f"{part.done}/{part.jobs}"
        numbers = (str(getattr(part, column) or "-") for column in columns[1:])
        lines.append(f"{name:10}{done:>10}" + "".join(f"{number:>10}" for number in numbers))
    return lines


def verdicts(status: Status) -> list[str]:
    """Number of hearts by verdict, and the reasons of those that are not complete."""
    if not status.hearts:
        return []
    number = sum(status.verdicts.values())
    counts = [f"{count} {verdict}" for verdict, count in status.verdicts.items()]
    rest = [f"{status.hearts - number} not known yet"] if number < status.hearts else []
    return ["", f"Hearts by their motion: {', '.join([*counts, *rest])}", *_reasons(status)]


def _reasons(status: Status) -> Iterator[str]:
    for case, (verdict, reason) in list(status.reasons.items())[:MAX_REASONS]:
        yield f"  {case}: {verdict}: {reason}"
    if len(status.reasons) > MAX_REASONS:
        yield f"  and {len(status.reasons) - MAX_REASONS} more (cases/status and cases/reason of the repository)"


def _logs(status: Status) -> list[str]:
    if not status.logs:
        return []
    logs = [f"  {path}" for path in status.logs[:MAX_LOGS]]
    more = [f"  and {len(status.logs) - MAX_LOGS} more"] if len(status.logs) > MAX_LOGS else []
    return ["", "Logs of jobs that ended with an error:", *logs, *more]
