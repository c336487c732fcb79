"""A repository of hearts, one DAG: geometry ... tracking for every case and view, then repository and report.

    snakemake --configfile config/demo.yaml
"""

import re
import subprocess
import sys
from pathlib import Path
from shlex import quote

from snakemake.exceptions import WorkflowError

from echotruth.cases import expand as expand_cases
from echotruth.config.loading import ConfigError, validate
from echotruth.mechanics.geometry.body import fingerprint
from echotruth.mechanics.loop import read_loop
from echotruth.provenance import code_version, settings_version
from echotruth.repository.ledger import GATES, VIEW_STAGES, record_path

if not config:

    configfile: "config/demo.yaml"


try:
    SOURCE = ", ".join(map(str, workflow.configfiles)) or "--config"
    CONFIG = validate(config, SOURCE)
    CASES = {case.id: case for case in expand_cases(CONFIG, SOURCE)}
except ConfigError as error:
    raise WorkflowError(str(error))

FOLDER = Path("out") / CONFIG.name
SCRIPTS = Path(workflow.basedir) / "workflow/scripts"
RUN = f"{quote(sys.executable)} {quote(str(SCRIPTS))}"  # {RUN}/rf.py runs a script


def code(*stages):
    """Version of the code behind stages; a change of it runs them again."""
    return code_version(*(str(SCRIPTS / f"{stage}.py") for stage in stages))


# A compiled function is cached by the file it stands in, not by those it calls from: one cache a version of the code.
ALL_CODE = code(*(script.stem for script in SCRIPTS.glob("*.py")))
CACHE = quote(str(Path(".snakemake/numba").absolute() / ALL_CODE))
shell.prefix(f"set -euo pipefail; export NUMBA_CACHE_DIR={CACHE}; ")


def record(stage, case="{case}", view=None):
    return record_path(FOLDER, stage, case, view)


report: "workflow/report/workflow.rst"


wildcard_constraints:
    case="|".join(map(re.escape, CASES)),
    view="|".join(CONFIG.views),


include: "rules/repository.smk"
include: "rules/mechanics.smk"
include: "rules/physiology.smk"
include: "rules/imaging.smk"
include: "rules/tracking.smk"
include: "rules/report.smk"


rule all:
    default_target: True
    input:
        RECORDS,
        rules.repository.output,
        rules.report.output,
