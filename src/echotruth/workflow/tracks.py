"""What trackers find in a clip; what an earlier run found in the same clip is not tracked again."""

import logging
from collections.abc import Callable
from hashlib import sha256

import numpy as np

from echotruth.evaluation.clip import Clip
from echotruth.repository.checksums import is_whole
from echotruth.repository.provenance import code_version, settings_version
from echotruth.section import Section
from echotruth.tracking import trackers
from echotruth.tracking.failure import TrackerFailed
from echotruth.workflow.job import Job

log = logging.getLogger("echotruth")


class Tracks:
    """Tracks of one clip, by tracker.

    Parameters
    ----------
    job : Job
        Job of the stage tracking.
    clip : Clip
    track : callable
        :func:`echotruth.tracking.tracker.track`; the script names it, as its code is among that of the stage.

    Attributes
    ----------
    made_from : dict
        Tracker -> hash of all that its tracks are made from.
    failures : dict
        Tracker -> why there is no estimate.
    """

    def __init__(self, job: Job, clip: Clip, track: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
        self._job, self._clip, self._track, self._content = job, clip, track, _digest(clip)
        self.made_from: dict[str, str] = {}
        self.failures: dict[str, str] = {}

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (frame, grid rows, grid columns, 2), lateral, axial, m, and quality (frame, rows, columns)."""
        tracker = self._job.config.tracking.trackers[name]
        self.made_from[name] = self._fingerprint(tracker)
        if self._stand(name):
            log.info("%s: taken up", name)
            found = self._job.read(f"tracking/{self._job.size}/{name}")
            return found["displacement"], found["quality"]
        try:
            return self._clip.on_grid(*self._track(*self._clip.tracker_arguments, tracker))
        except TrackerFailed as error:
            log.warning("%s: %s", name, error)
            self.failures[name] = str(error)
            return self._clip.on_grid(*self._clip.no_estimate)

    def _stand(self, name: str) -> bool:
        """Whether an earlier run tracked the same clip with the same tracker, and its files are whole."""
        earlier, group = self._job.earlier, f"tracking/{self._job.size}/{name}/"
        made_from = self.made_from[name]
        if not made_from or earlier.get("made_from", {}).get(name) != made_from or name in earlier["failures"]:
            return False
        files = {path: hash for path, hash in earlier["sha256"].items() if path.startswith(group)}
        own = {path.relative_to(self._job.store.path).as_posix() for path in self._job.files(group.rstrip("/"))}
        return own == set(files) != set() and all(
            is_whole(self._job.store.path / path, hash) for path, hash in files.items()
        )

    def _fingerprint(self, tracker: Section) -> str:
        """Hash of code and settings of a tracker, and of what it is given.

        Empty for a tracker from outside, whose code is not known: it is never taken for the same.
        """
        method = getattr(tracker, "method", "external")
        return "" if method == "external" else settings_version(method_code(method), tracker, self._content)


def method_code(method: str) -> str:
    """Version of the code of one method: a change of the others leaves its results as they are."""
    others = frozenset((trackers.__name__, f"{trackers.__name__}.{name}") for name in trackers.NAMES - {method})
    return code_version("echotruth.evaluation.clip", "echotruth.tracking.tracker", unless=others)


def _digest(clip: Clip) -> str:
    """Hash of all that a tracker is given."""
    content = sha256()
    for value in (*clip.tracker_arguments, clip.inside):
        array = np.ascontiguousarray(value)
        content.update(f"{array.dtype} {array.shape} ".encode())
        content.update(array.tobytes())
    return content.hexdigest()
