"""Progress of a run, from what Snakemake says of its steps."""

import io
from types import SimpleNamespace

import pytest

from echotruth.workflow.progress import Progress

PLAN = """\
Job stats:
job           count
----------  -------
all               1
mechanics         2
rf                4
total             7
"""


def began(rule, number, log="out/a.log", indent=""):
    return f"{indent}rule {rule}:\n    output: b\n    log: {log}\n    jobid: {number}\n    wildcards: case=a\n"


def failed(rule, number, log):
    return f"Error in rule {rule}:\n    message: None\n    jobid: {number}\n    log: {log} (check log file(s))\n"


def ended(rule, number):
    return f"Finished jobid: {number} (Rule: {rule})\n1 of 7 steps (14%) done\n"


@pytest.fixture
def told():
    """A progress to which text is told at a time."""
    clock = SimpleNamespace(now=0.0)
    progress = Progress({"mechanics": 40, "rf": 10}, clock=lambda: clock.now)

    def tell(output, now=0.0):
        clock.now = now
        for line in output.splitlines():
            progress.read_line(line)
        return progress

    return tell


def test_share_is_that_of_the_expected_time_and_the_rest_takes_as_long_in_proportion(told):
    assert told("Building DAG of jobs...\n").text == ""
    assert told(PLAN).text == "0 of 6 jobs, 0 %, starting"
    assert told(began("mechanics", 1) + began("mechanics", 2)).text == "0 of 6 jobs, 0 %, mechanics x 2"
    progress = told(ended("mechanics", 1) + began("rf", 3), now=100)
    assert progress.share == pytest.approx(40 / 120)
    assert progress.text == "1 of 6 jobs, 33 %, mechanics, rf, about 3 min left"
    progress = told("".join(ended("rf", number) for number in range(3, 7)) + ended("mechanics", 2), now=300)
    assert progress.share == 1 and progress.text == "6 of 6 jobs, 100 %"
    assert told("localrule all:\n    jobid: 0\n" + ended("all", 0), now=301).text == "6 of 6 jobs, 100 %"


def test_jobs_of_a_group_on_a_cluster_are_read_as_others(told):
    assert told(PLAN + began("rf", 3, indent="    ")).running["3"].rule == "rf"
    assert told("localrule rf:\n    jobid: 4\n").running["4"].rule == "rf"


def test_failed_job_is_told_with_its_log_until_it_is_tried_again(told):
    progress = told(PLAN + began("rf", 3) + failed("rf", 3, "out/mid.log"))
    assert [str(step.log) for step in progress.failed.values()] == ["out/mid.log"] and not progress.running
    assert "1 failed" in progress.text
    progress = told("Trying to restart job 3.\n" + began("rf", 3))
    assert not progress.failed and list(progress.running) == ["3"]


class Terminal(io.StringIO):
    def isatty(self):
        return True
