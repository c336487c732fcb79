"""Hearts, their images with the true motion, and trackers scored by it, in one Zarr repository.

    snakemake --cores 2                                   # makes out/demo
    snakemake --cores 2 --configfile config/sweep.yaml    # makes out/sweep

docs/workflow.md follows a view through the rules, which have in common:

- PLAN, of src/echotruth/workflow/plan.py, gives the inputs and params that depend on the configuration. `code` (version
  of the script and all that it imports), `settings` and `excluded` are params so that a job runs again if they change.
- The output is a record in OUT/ledger. Arrays go to the store, OUT/NAME.zarr, as a side effect; then the record is
  written, with their checksums and a status. Snakemake follows records, and the files in OUT/scratch that phantom and
  rf pass on.
- A heart without a solution has a record too, with the status failed. If a case is excluded, because its heart failed
  or is outside the bounds of `physiology`, the records of its views say skipped, with the reason. The run goes on.
- Groups (heart, view, report) are jobs that a cluster may run as one. By priority the later stage comes first, so that
  a view is finished, and its scratch deleted, before the next one begins.
"""

import sys

from echotruth.config import shipped
from echotruth.config.loading import ConfigError
from echotruth.workflow import lease, processes
from echotruth.workflow.plan import Plan

if not config:

    configfile: shipped.path_of("demo")


try:
    PLAN = Plan(config)
    lease.join(PLAN.folder)  # the lease: one run at a time writes the folder, and its processes end with it
except (ConfigError, lease.LeaseError) as error:
    sys.exit(f"echotruth: {error}")

OUT = PLAN.folder.as_posix()

shell.prefix(processes.prefix(PLAN.folder))  # sets $SCRIPTS, $REPOSITORY and what all processes share


envvars:
    lease.VARIABLE,


wildcard_constraints:
    case="[^/]+",
    view="[^/]+",
    size="[0-9]+",


include: "rules/mechanics.smk"
include: "rules/phantom.smk"
include: "rules/rf.smk"
include: "rules/truth.smk"
include: "rules/bmode.smk"
include: "rules/tracking.smk"
include: "rules/inference.smk"
include: "rules/repository.smk"
include: "rules/report.smk"


localrules:
    all,
    hearts,


rule all:
    default_target: True
    input:
        PLAN.records,  # Snakemake makes what is lost again only if it is asked for
        rules.repository.output,
        rules.report.output,


onstart:
    PLAN.begin()  # takes the lease, and lays out the table of cases and empty arrays
