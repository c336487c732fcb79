"""True motion, strain and labels at every pixel of every frame and image size."""

import logging
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from echotruth.config import Bmode
from echotruth.heart import Heart
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import PixelTruth
from echotruth.imaging.view import Plane
from echotruth.workflow.job import Job, Result, main


class Later:
    """An array of the truth that is made when it is written, so that one is in memory at a time.

    Parameters
    ----------
    truth : PixelTruth
    name : str
    """

    def __init__(self, truth: PixelTruth, name: str) -> None:
        self._truth, self._name = truth, name

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[np.generic]:
        return np.asarray(self._truth[self._name], dtype)


class Truth(Mapping[str, Mapping[str, ArrayLike]]):
    """Truth of a view by group; tissue is located for one image size at a time.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    bmode : Bmode
    """

    def __init__(self, heart: Heart, plane: Plane, bmode: Bmode) -> None:
        self._heart, self._plane, self._bmode = heart, plane, bmode

    def __getitem__(self, group: str) -> Mapping[str, ArrayLike]:
        size = int(group.removeprefix("truth/"))
        logging.getLogger("echotruth").info("%d px", size)
        truth = PixelTruth(self._heart, self._plane, *pixel_centres(self._bmode, size))
        return {name: Later(truth, name) for name in truth}

    def __iter__(self) -> Iterator[str]:
        return (f"truth/{size}" for size in self._bmode.sizes)

    def __len__(self) -> int:
        return len(self._bmode.sizes)


def work(job: Job) -> Result:
    return Truth(job.heart, Plane(**job.read("phantom", "origin", "axes")), job.case.config.bmode)


if __name__ == "__main__":
    main("truth", work, __doc__)
