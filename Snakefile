"""Hearts, their images with the true motion, and trackers scored by it, in one Zarr repository.

    snakemake --cores 2                                   # makes out/demo
    snakemake --cores 2 --configfile config/sweep.yaml    # makes out/sweep
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
    lease.join(PLAN.folder)
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


# What a block of a large sweep makes; see docs/cluster.md.
rule hearts:
    input:
        PLAN.records,
    output:
        touch(PLAN.mark),


onstart:
    PLAN.begin()
