"""Expansion of a configuration into its hearts.

They are the rows of the table, times the grid, times draws, without those that conditions leave out.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from echotruth.cases import rows
from echotruth.cases.case import Case, Combination
from echotruth.cases.checks import check_condition_key, check_files, check_ids, check_keys
from echotruth.cases.conditions import Condition
from echotruth.cases.sections import Sweep
from echotruth.config import Config
from echotruth.config.building import Source, configure
from echotruth.config.loading import ConfigError
from echotruth.config.reading import Errors
from echotruth.config.table import LABEL


def expand(config: Source, source: str = "configuration") -> list[Case]:
    """Cases of a configuration, in the order of the rows, then of the grid, then of the draws.

    Parameters
    ----------
    config : Config, dict, str or Path
        Anything that :func:`echotruth.configure` accepts.
    source : str
        What errors call the configuration.

    Returns
    -------
    list of Case

    Raises
    ------
    ConfigError
        If a key cannot be swept, a combination is not valid, a file is missing, or conditions leave no case.

    Examples
    --------
    >>> import echotruth as et
    >>> config = et.configure(cases={"geometry.wall_mm": [0.9, 1.1], "seed": [1, 2]})
    >>> [case.id for case in et.expand(config)]
    ['wall0.9_b94424', 'wall0.9_seed2_74e3c3', 'wall1.1_e79e50', 'wall1.1_seed2_7c0d55']
    """
    config, errors = configure(config), Errors()
    hearts = list(_hearts(config, source, errors))
    errors.raise_all(source)
    if not hearts:
        raise ConfigError(f"{source}: cases.where leaves out all {config.cases.number} cases: widen a condition")
    check_ids(hearts, source)
    check_files(hearts, source)
    return [case for _, case in hearts]


def all_cases(config: Config) -> dict[str, Case]:
    """Cases by id; the files that they name need not be there any more."""
    errors = Errors()
    cases = {case.id: case for _, case in _hearts(config, config.name, errors)}
    errors.raise_all(config.name)
    return cases


def find_case(config: Config, id: str) -> Case:
    """Case with an id; the files that it names need not be there any more."""
    sweep, conditions = Sweep(config, config.name), _conditions(config, config.name)
    for heart in combinations(config, config.name):
        if id.startswith(heart.given_id) and _meets(conditions, sweep, heart) and sweep.id(heart) == id:
            return sweep.case(heart)
    raise ConfigError(f"{id} is not a case of {config.name}: the ids are in out/{config.name}/cases.csv")


def combinations(config: Config, source: str) -> Iterator[Combination]:
    """All rows, times the grid, times draws.

    Raises
    ------
    ConfigError
        If a cell of the table is not valid.
    """
    grid, draws = config.cases.grid, _draws(config)
    for row, values, (number, draw) in product(rows.combinations(config, source), product(*grid.values()), draws):
        parameters = row.parameters | dict(zip(grid, values, strict=True)) | draw
        yield replace(row, parameters=parameters, origin=", ".join(filter(None, [row.origin, number])))


def _hearts(config: Config, source: str, errors: Errors) -> Iterator[tuple[Combination, Case]]:
    """Combinations that meet the conditions, and their cases; what is wrong with them is collected."""
    check_keys(config, source)
    sweep, conditions = Sweep(config, source), _conditions(config, source)
    for heart in combinations(config, source):
        # A condition that cannot be asked of one case can be asked of no other: that error stands alone.
        if not _meets(conditions, sweep, heart):
            continue
        with errors.collecting():
            yield heart, sweep.case(heart)
        if errors.are_enough:
            return


def _draws(config: Config) -> list[tuple[str, dict]]:
    """What errors call each draw, and its values; one empty draw if nothing is drawn."""
    if config.cases.draw is None:
        return [("", {})]
    from echotruth.cases.draws import draws

    return [(f"draw {number}", values) for number, values in enumerate(draws(config.cases.draw), 1)]


def _conditions(config: Config, source: str) -> list[Condition]:
    """The conditions, whose keys exist."""
    conditions = [Condition(text, source) for text in config.cases.where]
    for condition in conditions:
        for key in sorted(condition.keys):
            check_condition_key(config, key, condition.place)
    return conditions


def _meets(conditions: list[Condition], sweep: Sweep, heart: Combination) -> bool:
    def lookup(key: str) -> object:
        return heart.labels.get(key.removeprefix(LABEL)) if key.startswith(LABEL) else sweep.value(key, heart)

    return all(condition.holds(lookup, heart.origin or heart.parameters) for condition in conditions)
