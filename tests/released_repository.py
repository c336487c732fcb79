"""Small repositories, made in seconds: one that is finished, one of which a heart failed, one that stopped half-way."""

import os
from pathlib import Path

from finished_repository import begin, blank, configured, do, finish, jobs

from echotruth.sharing.release.attribution import Attribution, Author
from echotruth.workflow.failure import CaseFailed

SWEEP = {"fibres.endo_deg": [60.0, 70.0]}
REASON = "no equilibrium at frame 2 | of 3"
GIVEN = Attribution(
    (Author("Doe", "Jane", "0000-0002-1825-0097", "Example University"), Author("The Heart Group")),
    *("CC-BY-4.0", "https://spdx.org/licenses/CC-BY-4.0", "https://example.org/hearts", "1.2.0"),
)
CHANGED = 1_700_003_600
"""Time of the publication."""


def make_finished(folder: Path) -> Path:
    """A finished repository."""
    finish(folder, configured(cases=SWEEP))
    os.utime(folder / "SHA256SUMS", (CHANGED, CHANGED))
    return folder


def make_failed(folder: Path) -> Path:
    """A repository of two hearts, of which the second has no solution."""

    def result(job):
        if job.config.fibres.endo_deg == 70.0:
            raise CaseFailed(REASON)
        return blank(job)

    return finish(folder, configured(cases=SWEEP), result)


def make_unfinished(folder: Path) -> Path:
    """A repository of two hearts, of which the first is complete and the second was not begun."""
    config = configured(cases=SWEEP)
    for job in jobs(folder, begin(folder, config)[0]):
        do(job)
    return folder
