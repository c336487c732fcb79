"""Small repositories, made in seconds: one that is finished, and a described one that failed and stopped half-way."""

import os
from pathlib import Path

from finished_repository import SIZE, configured, finish, job_of, jobs, lay_out, result
from PIL import Image

from echotruth.cases import expand
from echotruth.repository import ledger
from echotruth.repository.description import attribution, describe
from echotruth.repository.ledger import record_path

SWEEP = {"fibres.endo_deg": [60.0, 70.0]}
REASON = "no equilibrium at frame 2 | of 3"
GIVEN = ("CC-BY-4.0", "https://example.org/hearts", "1.2.0", None)
AUTHORS = [
    "Doe, Jane; 0000-0002-1825-0097; Example University; https://ror.org/example",
    "The Heart Group; https://example.org",
]
BEGIN, END = 1_700_000_000, 1_700_003_600
"""Times of the first record and of the last, that of the publication."""


def given(authors=AUTHORS):
    return attribution(list(authors), *GIVEN)


def set_times(folder: Path) -> None:
    """Give the records times that do not depend on when the test runs."""
    for second, path in enumerate(sorted((folder / "ledger").rglob("*/*.json"))):
        os.utime(path, (BEGIN + second, BEGIN + second))
    os.utime(folder / "ledger/repository.json", (END, END))


def make_finished(folder: Path) -> Path:
    """A finished repository with a table of scores and a figure, not described."""
    finish(folder, configured(cases=SWEEP))
    figures = folder / "figures"
    figures.mkdir()
    (figures / "leaderboard.csv").write_text(
        "size_px,view,tracker,rank,nrmse_percent\n64,all,one,1,12.5\n64,mid,one,1,\n"
    )
    Image.new("RGB", (8, 4), (200, 10, 10)).save(figures / "heart.png")
    set_times(folder)
    return folder


def make_unfinished(folder: Path) -> Path:
    """A described repository of three hearts: the first is complete, the second failed, the third has stopped."""
    config = configured(seeds=(1, 2, 3))
    cases = expand(config)
    lay_out(folder, config, cases)
    for job in jobs(folder, config, cases[0].id):
        job.commit(result(job))
    failed, stopped = (job_of(folder, record_path(folder, "mechanics", case.id)) for case in cases[1:])
    failed.commit_without_result("failed", REASON)
    stopped.commit(result(stopped))
    path = record_path(folder, "tracking", cases[0].id, "mid", SIZE)
    ledger.commit(path, ledger.read(path) | {"failures": {"one": "it ended with status 3"}})
    describe(folder)
    return folder
