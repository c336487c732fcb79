"""What the processes of the tests share: the cores, the instructions, and what is compiled.

To be imported before numpy and numba.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from echotruth.repository.provenance import code_version
from echotruth.workflow.compiled import CACHE_GROUPS, cache_folder, lock_cache_writes

ROOT = Path(__file__).parents[1]
SCRIPTS = ROOT / "src/echotruth/workflow/scripts"
# A compiled function is cached by the file it stands in, not by those it calls from: one cache a version of the code.
CACHE = ROOT / ".snakemake/numba" / code_version(*map(str, SCRIPTS.glob("*.py")))
os.environ["NUMBA_CACHE_DIR"] = str(CACHE)
# Threads of BLAS that wait for a core that is taken spin: a decomposition of a matrix then costs twenty times its work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# The instructions of jobs, so that what is compiled here serves jobs too; another process asks numpy for its names.
_CODE = "import json; from echotruth.workflow.instructions import environment; print(json.dumps(environment()))"
os.environ.update(json.loads(subprocess.run([sys.executable, "-c", _CODE], check=True, stdout=subprocess.PIPE).stdout))


def lend(caches):
    """Let jobs that look for their caches in a folder find, and fill, that of the tests."""
    CACHE.mkdir(parents=True, exist_ok=True)
    caches.mkdir(parents=True)
    for group in CACHE_GROUPS:
        (caches / cache_folder(group, SCRIPTS)).symlink_to(CACHE)


lock_cache_writes()
