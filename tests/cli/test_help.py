"""Help, and what is said of mistyped commands and options."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from echotruth import cli
from echotruth.cli.command import Parser

NAMES = list(cli.COMMANDS)


@pytest.mark.parametrize("name", NAMES)
def test_help_has_description_examples_and_exit_statuses(call, name):
    status, output, errors = call(name, "--help")
    assert (status, errors) == (0, "")
    assert re.search(r"examples:\n  echotruth " + name, output) and re.search(r"exit status:\n  0  \w+", output)


@pytest.mark.parametrize("name", NAMES)
def test_every_example_is_understood(name, monkeypatch, call):
    examples = re.findall(rf"^  echotruth ({name}.*)$", call(name, "--help")[1], re.MULTILINE)
    for example in examples:
        import shlex

        words = shlex.split(example.partition("    #")[0].partition(" > ")[0])
        arguments, options = cli.parser().parse_known_args(words)
        assert arguments.command == name and (not options or name == cli.PASSES_ON)


def test_every_option_and_argument_is_explained():
    (commands,) = (action for action in cli.parser()._actions if action.dest == "command")
    assert list(commands.choices) == NAMES
    for name, parser in commands.choices.items():
        assert isinstance(parser, Parser)
        assert all(action.help for action in parser._actions), name


def test_command_alone_prints_what_there_is(call):
    status, output, _ = call()
    assert status == 2 and all(re.search(rf"^    {name}\b", output, re.MULTILINE) for name in NAMES)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["rnu", "a.yaml"], "COMMAND = rnu: did you mean run?"),
        (["xyz"], "COMMAND = xyz: use one of new, check,"),
        (["check", "a.yaml", "--quik"], "--quik: is not an option of echotruth check: did you mean --quick?"),
        (
            ["check", "a.yaml", "--cores", "2"],
            "--cores: is not an option of echotruth check: see echotruth check --help",
        ),
        (["check", "a.yaml", "b.yaml"], "b.yaml: is one argument too many"),
        (["evaluate", "out/demo", "--trakcer=dis"], "one of the arguments --tracker --onnx --command is required"),
        (["export", "out/demo", "--format", "mp5"], "--format = mp5: did you mean mp4?"),
        (["export", "out/demo", "--format", "mp4", "--rate", "fast"], "argument --rate: invalid float value: 'fast'"),
        (["evaluate", "out/demo", "--tracker", "dis", "--jobs", "5.1"], "argument --jobs: invalid int value: '5.1'"),
        (["check"], "the following arguments are required"),
    ],
)
def test_mistyped_command_is_refused_in_one_line(call, arguments, sentence):
    status, output, errors = call(*arguments)
    assert (status, output, errors.count("\n")) == (2, "", 1) and sentence in errors, errors


def test_reader_who_has_seen_enough_ends_the_command_without_a_word():
    config = Path(__file__).parents[2] / "config/sweep.yaml"
    command = f"{sys.executable} -m echotruth cases {config} --all | head -1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("case,") and done.stderr == ""


def test_cases_show_what_differs_and_all_shows_the_rest(call):
    few, whole = call("cases", "sweep")[1], call("cases", "sweep", "--all")[1]
    assert few.splitlines()[0] == "case,seed,fibres.endo_deg,fibres.epi_deg,mechanics.material.stiffness_kPa"
    assert len(few.splitlines()) == len(whole.splitlines()) == 109 and whole.splitlines()[0].count(",") > 100
