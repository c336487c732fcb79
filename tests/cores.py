"""What the processes of the tests share: the cores, the instructions, and what is compiled.

To be imported before numpy and numba.
"""

import json
import os
import subprocess
import sys

# Threads of BLAS that wait for a core that is taken spin: a decomposition of a matrix then costs twenty times its work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# The instructions of jobs, so that what is compiled here serves jobs too; another process asks numpy for its names.
_CODE = "import json; from echotruth.workflow.instructions import environment; print(json.dumps(environment()))"
os.environ.update(json.loads(subprocess.run([sys.executable, "-c", _CODE], check=True, stdout=subprocess.PIPE).stdout))

from echotruth.workflow.processes import cache, guard_cache  # noqa: E402 - it imports numpy

os.environ["NUMBA_CACHE_DIR"] = str(cache())  # that of jobs, wherever they run
guard_cache()

import numba  # noqa: E402 - it reads where the cache is

numba.set_num_threads(1)  # the other cores are those of other workers
