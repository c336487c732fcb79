"""Progress of a run, from the logs of Snakemake and the durations that jobs are expected to have."""

import io
import time

import pytest

from echotruth.workflow.progress import Progress, RunLog, format_duration
from echotruth.workflow.snakemake_process import ProgressLine

PLAN = """\
Provided cores: 2
Job stats:
job                 count
----------------  -------
all                     1
rf                      4
mechanics               1
total                   6
"""
START = time.mktime(time.strptime("Sun Nov 22 02:00:00 2026", "%a %b %d %H:%M:%S %Y"))


class Run:
    """A run whose clock is set by hand, of one Snakemake or several."""

    def __init__(self, jobs=None, **expected):
        self.now = START
        self.progress = Progress(expected, jobs, lambda: self.now)
        self.log = self.begin()

    def begin(self):
        self.log = RunLog()
        self.progress.logs.append(self.log)
        return self.log

    def read(self, text, at=None):
        self.now = self.now if at is None else START + at
        stamp = time.strftime("[%a %b %d %H:%M:%S %Y]", time.localtime(self.now))
        for line in f"{stamp}\n{text}".splitlines():
            self.log.read_line(line)
        return self.progress


def began(rule, job, log=""):
    return f"localrule {rule}:\n    input: a\n    log: {log or f'{rule}.log'}\n    jobid: {job}\n"


def ended(rule, job):
    return f"Finished jobid: {job} (Rule: {rule})\n1 of 6 steps (17%) done\n"


def failed(rule, job, log):
    return f"Error in rule {rule}:\n    message: None\n    jobid: {job}\n    log: {log} (check log file(s))\n"


def test_time_left_is_that_of_rule_after_rule_on_the_cores_there_are():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("mechanics", 5))
    assert run.progress.share == 0
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 100 / 2)


def test_end_of_the_rule_that_only_collects_the_results_is_the_end_of_the_run():
    run = Run(mechanics=40, rf=100)
    run.read("all                     1\nmechanics               1\n" + began("mechanics", 1))
    run.read(ended("mechanics", 1) + began("all", 0) + ended("all", 0), 40)
    assert (run.progress.share, run.progress.seconds_left) == (1, 0)
    assert run.progress.activity == "starting", "no job is left"


def test_running_jobs_count_as_far_as_they_are():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("mechanics", 5))
    run.now += 10
    assert run.progress.activity == "mechanics (1 of 1)"
    assert run.progress.share == pytest.approx(10 / 440)
    assert run.progress.seconds_left == pytest.approx(30 + 200)


def test_a_slow_machine_is_known_by_the_jobs_that_have_ended():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("mechanics", 5))
    run.read(ended("mechanics", 5) + began("rf", 1) + began("rf", 2), 80)
    assert run.progress.seconds_left == pytest.approx(2 * 200), "twice as slow as thought"
    assert run.progress.activity == "rf (1 of 4)"


def test_several_snakemakes_have_one_progress():
    run = Run({"mechanics": 2, "rf": 8}, mechanics=40, rf=100)
    run.read(PLAN + began("mechanics", 1))
    assert run.progress.seconds_left == pytest.approx(2 * 40 / 2 + 8 * 100 / 2), "the second has not said what it plans"
    run.read(ended("mechanics", 1), 40)
    run.begin()
    run.read(PLAN + began("mechanics", 1), 40)
    run.read(ended("mechanics", 1), 80)
    assert run.progress.share == pytest.approx(80 / 880), "jobs of both have the number 1"
    assert run.progress.seconds_left == pytest.approx(8 * 100 / 2)


def test_snakemakes_side_by_side_have_the_cores_of_both():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("rf", 1))
    run.begin()
    run.read(PLAN + began("rf", 1))
    assert run.progress.seconds_left == pytest.approx(2 * 40 / 2 + 8 * 100 / 4)
    assert run.progress.activity == "rf (1 of 8)" and len(run.progress.running) == 2


def test_share_never_falls_and_ends_at_one():
    run, before, seconds = Run(mechanics=40, rf=1), 0.0, 0
    run.read(PLAN)
    for number, rule in enumerate(["mechanics", *["rf"] * 4]):
        run.read(began(rule, number), seconds)
        for _ in range(3):
            seconds += 30
            run.now = START + seconds
            assert run.progress.share >= before
            before = run.progress.share
        run.read(ended(rule, number), seconds)
    assert run.progress.share == 1 and run.progress.seconds_left == 0


def test_failed_job_is_done_with_and_its_log_is_known():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("rf", 1) + failed("rf", 1, "out/mid.log"))
    assert [str(job.log) for job in run.progress.failed] == ["out/mid.log"] and not run.progress.running
    run.read(began("rf", 2))
    assert run.progress.seconds_left == pytest.approx(40 + 3 * 100 / 2)


def test_job_that_is_tried_again_is_planned_again():
    run = Run(mechanics=40, rf=100)
    run.read(PLAN + began("rf", 1) + failed("rf", 1, "out/mid.log") + "Trying to restart job 1.\n")
    assert not run.progress.failed
    run.read(began("rf", 1))
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 100 / 2)
    run.read(failed("rf", 1, "out/mid.log"))
    assert [job.rule for job in run.progress.failed] == ["rf"]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_line_is_rewritten_on_a_terminal_and_comes_once_in_a_while_elsewhere():
    for stream, expected in ((Terminal(), 4), (io.StringIO(), 2)):
        run = Run(mechanics=40, rf=100)
        line = ProgressLine("demo", stream, lambda run=run: run.now)
        run.read(PLAN + began("mechanics", 5))
        for _ in range(4):
            line.show(run.progress)
            run.now += 10
        output = stream.getvalue()
        assert output.count("demo: ") == expected
        assert ("\n" in output) != stream.isatty()


def test_planning_that_takes_long_is_told():
    run, stream = Run(), Terminal()
    line = ProgressLine("demo", stream, lambda: run.now)
    line.show(run.progress)
    assert not stream.getvalue()
    run.now += 60
    line.show(run.progress)
    assert stream.getvalue().endswith("demo: planning")


@pytest.mark.parametrize("seconds, text", [(3, "10 s"), (42, "40 s"), (70, "1 min"), (1000, "17 min"), (9000, "2.5 h")])
def test_time_in_words(seconds, text):
    assert format_duration(seconds) == text
