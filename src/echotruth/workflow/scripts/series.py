"""Run several stages of one heart, or of one of its views, in one process, so that modules are loaded only once."""

import gc

gc.disable()  # Modules stay: garbage is not looked for among them while they are loaded, nor later.

import os

from echotruth.workflow.series import ALONE, command, run_ahead, run_series
from echotruth.workflow.stage_cost import Cost

gc.freeze()
gc.enable()

if __name__ == "__main__":
    arguments, cost = command().parse_args(), Cost()
    run_series(arguments, cost)
    if arguments.then and ALONE not in os.environ:
        run_ahead(arguments, cost)
