"""What a viewer has chosen to see, the inputs for it, and the address that says so."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from urllib.parse import urlencode

from bokeh.models import AutocompleteInput, InputWidget, Select

from echotruth.repository.choice import main_view
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS
from echotruth.viewer.curves import CONTOURS, LINE, MEASURES, MIDDLE, WALL
from echotruth.viewer.tint import COLOURS, WALL_COMPONENTS

NOTHING, TRUTH = "", "truth"
"""In place of a second tracker: none, and the truth at the points of the first."""
MANY = 30
"""Cases of which a list is offered; of more, those whose names contain what is typed."""


@dataclass(frozen=True)
class Choice:
    """A clip, and what is drawn over it.

    Attributes
    ----------
    size : int
        Pixels along a side.
    other : str
        Second tracker, `TRUTH` or `NOTHING`.
    colour : str
        A key of :data:`echotruth.viewer.tint.COLOURS`.
    component : str
        Of strain, as "RR"; empty for colours without one.
    curve : str
        Strain of the curves: `line` (of a contour), RR, TT or RT.
    measure : {"engineering", "green_lagrange"}
    part : str
        Part of the wall of the curves, as "middle" (a contour), "wall", "layer 1" or "segment 7".
    frame : int or None
        Frame at which the clip stands; None if it plays.
    """

    case: str
    view: str
    size: int
    tracker: str
    other: str = NOTHING
    colour: str = "strain"
    component: str = ""
    curve: str = LINE
    measure: str = "engineering"
    part: str = MIDDLE
    frame: int | None = None

    @property
    def address(self) -> str:
        """The choice as the query of an address; what is as it would be without it is left out."""
        plain = {field.name: field.default for field in fields(self)} | {"frame": self.frame}  # the browser adds it
        return urlencode({name: value for name, value in asdict(self).items() if value != plain[name]})


def first(repository: Repository) -> Choice:
    """What is shown at first: the first case that is complete, or the first of all."""
    cases = repository.present
    case = next((case for case in cases if repository.verdict(case).status == "complete"), cases[0])
    return Choice(case, main_view(repository.config), repository.sizes[0], repository.trackers[-1])


def asked(repository: Repository, query: Mapping[str, Sequence[str]]) -> tuple[Choice, str]:
    """What an address asks for, and what of it the repository does not have, in a sentence.

    What it does not say, or what is not there, is as at first.

    Parameters
    ----------
    repository : Repository
    query : dict
        Name -> values, as `urllib.parse.parse_qs` gives them.
    """
    given = {name: values[-1] for name, values in query.items() if values}
    known = {name: value for name, value in given.items() if value in _known(repository, name)}
    chosen = {name: int(value) if name in ("size", "frame") else value for name, value in known.items()}
    choice = replace(first(repository), **chosen)  # type: ignore[arg-type]  # each has its type
    unknown = [f"{name} {given[name]!r}" for name in asdict(choice) if name in given and name not in known]
    return choice, f"There is no {', no '.join(unknown)} here: see the lists for what there is." if unknown else ""


def _known(repository: Repository, name: str) -> Container[str]:
    """Values that a part of an address can have."""
    known: dict[str, Container[str]] = {
        "case": repository.rows,
        "view": repository.views,
        "size": list(map(str, repository.sizes)),
        "tracker": repository.trackers,
        "other": [TRUTH, *repository.trackers],
        "colour": list(COLOURS),
        "component": [*LABELS["strain_component"], *WALL_COMPONENTS],
        "curve": [LINE, *WALL_COMPONENTS],
        "measure": list(MEASURES),
        "part": [*CONTOURS, WALL, *(f"layer {n}" for n in range(1, 99)), *(f"segment {n}" for n in range(1, 18))],
        "frame": list(map(str, range(repository.config.loop.frames))),
    }
    return known.get(name, ())


def inputs(repository: Repository, choice: Choice) -> dict[str, InputWidget]:
    """Inputs for all but the frame, by name; the page fills in the options that depend on what is chosen."""
    others = [(NOTHING, "–"), (TRUTH, "the truth"), *((name, name) for name in repository.trackers)]
    return {
        "case": _case_input(repository.present, choice.case),
        "view": Select(title="View", value=choice.view, options=repository.views, width=110),
        "size": Select(title="Size (px)", value=str(choice.size), options=list(map(str, repository.sizes)), width=80),
        "tracker": Select(title="Tracker", value=choice.tracker, options=repository.trackers, width=150),
        "other": Select(title="Beside it", value=choice.other, options=others, width=150),
        "colour": Select(title="Colour", value=choice.colour, options=list(COLOURS.items()), width=190),
        "component": Select(title="Component", value=choice.component, options=[], width=220, visible=False),
        "curve": Select(title="Curve", value=choice.curve, options=[], width=230),
        "measure": Select(title="Measure", value=choice.measure, options=list(MEASURES.items()), width=220),
        "part": Select(title="Part of the wall", value=choice.part, options=[], width=120),
    }


def _case_input(cases: list[str], case: str) -> InputWidget:
    if len(cases) <= MANY:
        return Select(title="Case", value=case, options=cases, width=230)
    return AutocompleteInput(
        title=f"Case (of {len(cases)}: type a part of its name)",
        value=case,
        completions=cases,
        search_strategy="includes",
        case_sensitive=False,
        min_characters=1,
        max_completions=20,
        width=330,
    )
