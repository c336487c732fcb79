"""The hearts of a table of cases: several cases may be of one."""

from echotruth.cases import Case
from echotruth.cases.case import Label
from echotruth.cases.ids import integer_if_whole
from echotruth.repository.settings import motions


def hearts_of(cases: dict[str, Case]) -> dict[str, str]:
    """Heart of every case: its label; without one, that of the first case with the same motion, or the name of that."""
    told = {name: label_text(case.labels.get("heart")) for name, case in cases.items()}
    if all(told.values()):
        return told
    motion = motions({name: case.config for name, case in cases.items()})
    first: dict[str, str] = {}
    for name, heart in told.items():
        first.setdefault(motion[name], heart or name)
    return {name: heart or first[motion[name]] for name, heart in told.items()}


def label_text(label: Label) -> str:
    """A label as text, a whole number without a decimal point; "" if there is none."""
    return "" if label is None else str(integer_if_whole(label))
