"""Progress of a run, from Snakemake's log and the durations of jobs."""

import io

import pytest

from echotruth.workflow.execution import ProgressLine
from echotruth.workflow.progress import EXPECTED, Progress, expected_durations, format_duration, replay

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


def began(rule, job, log=""):
    log = log or f"{rule}.log"
    return f"[Sun Nov 22 02:39:38 2026]\nrule {rule}:\n    input: a\n    log: {log}\n    jobid: {job}\n"


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


def test_end_of_the_rule_that_only_collects_the_results_is_the_end_of_the_run():
    run = Run(mechanics=40, imaging=100)
    run.read("Provided cores: 1\nall                     1\nmechanics               1\n" + began("mechanics", 1))
    run.now = 40
    run.read(ended("mechanics", 1) + began("all", 0) + ended("all", 0))
    assert (run.progress.fraction_done, run.progress.seconds_left) == (1, 0)
    assert run.progress.running == "starting", "no job is left"


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


def test_compilation_in_the_first_heart_does_not_count_for_the_others():
    run = Run(mechanics=40, imaging=0, compile_mechanics=20)
    run.read("Provided cores: 1\nmechanics               3\n" + began("mechanics", 1))
    assert run.progress.seconds_left == pytest.approx(20 + 3 * 40)
    run.now = 120  # half as fast as expected, compilation included
    run.read(ended("mechanics", 1))
    assert run.progress.seconds_left == pytest.approx(2 * 80)


def test_compiling_longer_than_expected_does_not_make_the_rest_longer():
    run = Run(mechanics=40, imaging=100, compile=1)
    run.read("Provided cores: 1\ncompile               1\nmechanics               1\nimaging               4\n")
    run.read(began("compile", 1))
    run.now = 30
    run.read(ended("compile", 1))
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 100)


def test_work_that_is_done_ahead_counts_once():
    run = Run(mechanics=40, imaging=100, tracking=60)
    run.read(PLAN + "tracking                5\n")
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 160 / 2 + 5 * 60 / 5 / 2), "one clip is only tracked"
    run = Run(mechanics=40, imaging=100, tracking=60)
    run.read("Provided cores: 2\ntracking                4\n")
    assert run.progress.seconds_left == pytest.approx(4 * 60 / 2)


def test_jobs_whose_work_was_done_ahead_do_not_count_as_fast_ones():
    run = Run(imaging=100, tracking=60)
    run.read("Provided cores: 1\nimaging               3\ntracking              5\n")
    run.read(began("tracking", 1, "logs/tracking/imaged_before/mid.log"))
    run.now = 60
    run.read(ended("tracking", 1))
    assert run.progress.seconds_left == pytest.approx(3 * 160 + 60), "as fast as expected"
    run.read(began("imaging", 2, "logs/imaging/new/mid.log"))
    run.now = 220
    run.read(ended("imaging", 2) + began("tracking", 3, "logs/tracking/new/mid.log"))
    run.now = 221
    run.read(ended("tracking", 3))
    assert run.progress.seconds_left == pytest.approx(2 * 160 + 60)
    assert run.progress.fraction_done == pytest.approx(220 / 600)
    run.read(began("tracking", 4, "logs/tracking/imaged_before/apex.log"))
    assert run.progress.running == "tracking (3 of 5)"


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


def test_job_that_is_tried_again_is_planned_again():
    run = Run(mechanics=40, imaging=100)
    failed = "Error in rule imaging:\n    message: None\n    jobid: 1\n    log: out/mid.log (check log file(s))\n"
    run.read(PLAN + began("imaging", 1) + failed + "Trying to restart job 1.\n")
    assert not run.progress.logs and not run.progress.failed_jobs
    assert run.progress.seconds_left == pytest.approx(40 + 4 * 100 / 2)
    run.read(began("imaging", 1) + failed)
    assert run.progress.failed_jobs == {"imaging": 1} and len(run.progress.logs) == 1


def test_log_read_later_gives_the_progress_of_then(tmp_path):
    log = tmp_path / "snakemake.log"
    log.write_text(PLAN + began("mechanics", 5) + "[Sun Nov 22 02:40:18 2026]\n" + ended("mechanics", 5)[27:])
    progress = replay(log, {"mechanics": 40, "imaging": 100}, runs=False)
    assert progress.seconds_left == pytest.approx(200) and not progress.running_jobs
    log.write_text(PLAN + began("mechanics", 5) + "[Sun Nov 22 02:39:48 2026]\n")
    progress = replay(log, {"mechanics": 40, "imaging": 100}, runs=False)
    assert progress.fraction_done == pytest.approx(10 / 440)
    assert [(job.rule, str(job.log)) for job in progress.running_jobs] == [("mechanics", "mechanics.log")]


def test_durations_that_a_run_expected_are_found_again(tmp_path):
    assert expected_durations(tmp_path) == {}
    (tmp_path / EXPECTED).write_text('{"imaging": 3}')
    assert expected_durations(tmp_path) == {"imaging": 3.0}
    (tmp_path / EXPECTED).write_text('{"imaging"')
    assert expected_durations(tmp_path) == {}


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


def test_planning_that_takes_long_is_told():
    run, stream = Run(), Terminal()
    line = ProgressLine("demo", stream, lambda: run.now)
    line.show(run.progress)
    assert not stream.getvalue()
    run.now = 60
    line.show(run.progress)
    assert stream.getvalue().endswith("demo: planning")


@pytest.mark.parametrize("seconds, text", [(3, "10 s"), (42, "40 s"), (70, "1 min"), (1000, "17 min"), (9000, "2.5 h")])
def test_time_in_words(seconds, text):
    assert format_duration(seconds) == text
