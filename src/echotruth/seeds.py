"""Seeds of random numbers: a generator for each thing that is drawn, whatever else is drawn and in whatever order."""

import json
from hashlib import sha256

import numpy as np

from echotruth.cases import Case


def generator(case: Case, view: str, name: str) -> np.random.Generator:
    """Generator of random numbers, seeded by four things alone: seed and id of the case, the view, and a name.

    Parameters
    ----------
    case : Case
    view : str
        Name of the view.
    name : str
        What is drawn: a stage, as "phantom", or a part of it, as "blood".
    """
    key = json.dumps([case.config.seed, case.id, view, name]).encode()
    return np.random.default_rng(np.frombuffer(sha256(key).digest(), np.uint32))
