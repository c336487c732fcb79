"""A repository of which nothing but scores of the repository's own trackers can be read, and its folder."""

import numpy as np

from echotruth.cases import Case
from echotruth.repository import schema
from echotruth.repository.reader import Repository

LENGTHS = {"region": 7, "component": 3, "statistic": 3, "polar": 2, "aha": 17, "reference": 3, "wall_component": 3}
LENGTHS |= {"agreement": 4, "contour": 3}


class Board(Repository):
    """Scores of hearts, all of them one number.

    Parameters
    ----------
    config : Config
    folder : Path
    hearts : dict
        Case -> view -> score of each tracker.
    about : dict, optional
        Attributes of groups, by group, case and view.
    """

    def __init__(self, config, folder, hearts, about=None):
        self._remote, self._place, self._folder, self.config = None, str(folder), folder, config
        self.hearts, self.shown, self.about = hearts, list(hearts), about or {}
        self.rows = {case: row for row, case in enumerate(hearts)}
        self._known = {case: Case(case, {}, config) for case in hearts}

    def read(self, path, case, view=None, *index):
        group, _, name = path.rpartition("/")
        shape = [LENGTHS[dim] for dim in schema.arrays_of(group)[name].dims[1:]]
        return np.full(shape, self.hearts[case][view][index[0]])

    def attributes(self, group_name, case="", view=None):
        return self.about.get((group_name, case, view), {})
