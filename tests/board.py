"""A repository of which nothing but scores of the repository's own trackers can be read, and its folder."""

import numpy as np

from echotruth.cases import Case
from echotruth.evaluation.leaderboard import SCORES
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
    """

    def __init__(self, config, folder, hearts):
        self._remote, self._place, self._folder, self.config = None, str(folder), folder, config
        self.hearts, self.shown = hearts, list(hearts)
        self.indices = dict.fromkeys(config.views, 0)
        self._known = {case: Case(case, {}, config) for case in hearts}

    def arrays(self, group, case, view=None, *names, store=None):
        dims = {array.name: array.dims[array.leading :] for array in schema.named(group)}
        scores = dict(zip(self.config.tracking.trackers, self.hearts[case][view], strict=True))
        assert set(names) == set(SCORES)
        return {name: np.full([LENGTHS[dim] for dim in dims[name]], scores[group.rpartition("/")[2]]) for name in names}
