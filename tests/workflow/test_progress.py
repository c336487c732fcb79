"""Progress of a run, from Snakemake's log and the durations of jobs."""

import io
import json

import pytest

from echotruth.workflow.execution import ProgressLine
from echotruth.workflow.progress import Progress, format_duration, measured_seconds

PLAN = """\
Provided cores: 2
Job stats:
job                 count
----------------  -------
all                     1
imaging                 4
mechanics               1
total                   6
"""


def began(rule, job):
    return f"[Sun Nov 22 02:39:38 2026]\nrule {rule}:\n    input: a\n    log: {rule}.log\n    jobid: {job}\n"


def ended(rule, job):
    return f"[Sun Nov 22 02:39:38 2026]\nFinished jobid: {job} (Rule: {rule})\n1 of 6 steps (17%) done\n"


class Run:
    """A run whose clock is set by hand."""

    def __init__(self, **weights):
        self.now = 0.0
        self.progress = Progress(weights, lambda: self.now)

    def read(self, text):
        for line in text.splitlines():
            self.progress.read_line(line)
        return self.progress


def test_time_left_is_that_of_stage_after_stage_on_the_cores_there_are():
    progress = Run(mechanics=40, imaging=100).read(PLAN)
    assert progress.fraction_done == 0
    assert progress.seconds_left == pytest.approx(40 + 4 * 100 / 2)


def test_running_jobs_count_as_far_as_they_are():
    run = Run(mechanics=40, imaging=100)
    run.read(PLAN + began("mechanics", 5))
    run.now = 10
    assert run.progress.running == "mechanics (1 of 1)"
    assert run.progress.fraction_done == pytest.approx(10 / 440)
    assert run.progress.seconds_left == pytest.approx(30 + 200)


def test_a_slow_machine_is_known_by_the_first_job_and_a_stage_by_its_own():
    run = Run(mechanics=40, imaging=100)
    run.read(PLAN + began("mechanics", 5))
    run.now = 80
    run.read(ended("mechanics", 5))
    assert run.progress.seconds_left == pytest.approx(2 * 200), "twice as slow as thought"
    run.read(began("imaging", 1) + began("imaging", 2))
    run.now = 130
    run.read(ended("imaging", 1) + ended("imaging", 2))
    assert run.progress.seconds_left == pytest.approx(50)
    assert run.progress.fraction_done == pytest.approx((80 + 100) / (80 + 200))


def test_work_that_is_done_ahead_counts_once():
    run = Run(mechanics=40, imaging=100, tracking=60)
    run.read(PLAN + "tracking                5\n")
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 160 / 2 + 5 * 60 / 5 / 2), "one clip is only tracked"
    run = Run(mechanics=40, imaging=100, tracking=60)
    run.read("Provided cores: 2\ntracking                4\n")
    assert run.progress.seconds_left == pytest.approx(4 * 60 / 2)


def test_share_never_falls_and_ends_at_one():
    run, before = Run(mechanics=40, imaging=1), 0.0
    run.read(PLAN)
    for number, rule in enumerate(["mechanics", *["imaging"] * 4]):
        run.read(began(rule, number))
        for _ in range(3):
            run.now += 30
            assert run.progress.fraction_done >= before
            before = run.progress.fraction_done
        run.read(ended(rule, number))
    assert run.progress.fraction_done == 1
    assert run.progress.seconds_left == 0


def test_failed_job_is_done_with_and_its_log_is_known():
    run = Run(mechanics=40, imaging=100)
    failed = "Error in rule imaging:\n    message: None\n    jobid: 1\n    log: out/mid.log (check log file(s))\n"
    run.read(PLAN + began("imaging", 1) + failed)
    assert [str(log) for log in run.progress.logs] == ["out/mid.log"]
    assert run.progress.seconds_left == pytest.approx(40 + 3 * 100 / 2)


def test_records_tell_what_the_jobs_of_a_rule_take(tmp_path):
    def record(path, **entries):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(json.dumps(entries))

    record("tracking/heart/mid.json", seconds=10, start_seconds=1)
    record("tracking/heart/base.json", seconds=20, start_seconds=1)
    assert measured_seconds(tmp_path) == {}, "of evaluation there is nothing yet"
    record("evaluation/heart/mid.json", seconds=2, start_seconds=1)
    record("evaluation/heart/base.json", status="skipped")
    assert measured_seconds(tmp_path) == {"tracking": 16 + 3}


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_line_is_rewritten_on_a_terminal_and_comes_once_in_a_while_elsewhere():
    for stream, expected in ((Terminal(), 4), (io.StringIO(), 2)):
        run = Run(mechanics=40, imaging=100)
        line = ProgressLine("demo", stream, lambda run=run: run.now)
        run.read(PLAN + began("mechanics", 5))
        for _ in range(4):
            line.show(run.progress)
            run.now += 10
        output = stream.getvalue()
        assert output.count("demo: ") == expected
        assert ("\n" in output) != stream.isatty()


@pytest.mark.parametrize("seconds, text", [(3, "10 s"), (42, "40 s"), (70, "1 min"), (1000, "17 min"), (9000, "2.5 h")])
def test_time_in_words(seconds, text):
    assert format_duration(seconds) == text
