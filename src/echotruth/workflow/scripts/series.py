"""Run several stages of one heart and view in one process, so that modules are loaded only once."""

from importlib import import_module

from echotruth.workflow.cost import Cost
from echotruth.workflow.job import parser, run

command = parser("series", __doc__)
command.add_argument("stages", nargs="+", help="names of scripts in this folder, such as phantom truth rf bmode")
arguments, cost = command.parse_args(), Cost()
for stage in arguments.stages:
    run(stage, import_module(stage).work, arguments, cost)
