"""Workflow of a repository: geometry to tracking for every case and view, then repository and report.

    snakemake --configfile config/demo.yaml
"""

import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from shlex import quote

from snakemake.exceptions import WorkflowError

from echotruth.cases import expand as expand_cases
from echotruth.workflow.compiled import CACHE_GROUPS, cache_folder
from echotruth.config.loading import ConfigError, validate
from echotruth.mechanics.geometry.imported_mesh import fingerprint
from echotruth.mechanics.motion_file.files import content_hash
from echotruth.loop.cycle import read_loop
from echotruth.workflow.miniature import miniature
from echotruth.repository.provenance import code_version, settings_version
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
RUN = f"{quote(sys.executable)} {quote(str(SCRIPTS))}"  # used as {RUN}/rf.py


def code(*stages):
    """Version of the code of some stages; if it changes, they are run again."""
    return code_version(*(str(SCRIPTS / f"{stage}.py") for stage in stages))


shell.prefix("set -euo pipefail; ")


def record(stage, case="{case}", view=None):
    """Path of the record of a job."""
    return record_path(FOLDER, stage, case, view)


report: "workflow/report/workflow.rst"


wildcard_constraints:
    case="|".join(map(re.escape, CASES)),
    view="|".join(CONFIG.views),


include: "rules/repository.smk"
include: "rules/compile.smk"
include: "rules/mechanics.smk"
include: "rules/physiology.smk"
include: "rules/imaging.smk"
include: "rules/tracking.smk"
include: "rules/report.smk"


rule all:
    default_target: True
    input:
        MARKS.values(),
        RECORDS,
        rules.repository.output,
        rules.report.output,
        rules.report_images.output,
