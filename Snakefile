"""Hearts, their images with the true motion, and trackers scored by it, in one Zarr repository.

    snakemake --cores 2                                   # makes out/demo
    snakemake --cores 2 --configfile config/sweep.yaml    # makes out/sweep

The way of a view, of which docs/workflow.md has the picture:

    heart -> phantom -> rf -> bmode --+
      |                               +-> tracking -> repository -> report
      +----> truth -------------------+

- What a rule makes is a group of the Zarr hierarchy: its output is the `zarr.json` of the group, which is there when
  the group is whole. A job that was killed leaves nothing.
- A group says in its attributes what it was made with: a hash of the settings and the code of its stage and of all
  before it. `PLAN.settle` sets aside what was made otherwise, so that Snakemake makes it again. Dates of files say
  nothing of that, and so what a job reads is `ancient`.
- A heart without a solution is a group too, which says why. What follows it writes groups that say skipped.
"""

import glob
import sys
from pathlib import Path

if (Path(workflow.basedir) / "src").is_dir():  # a checkout runs itself, whatever is installed
    sys.path.insert(0, f"{workflow.basedir}/src")

from echotruth.config.loading import ConfigError, beside
from echotruth.workflow import lock, processes
from echotruth.workflow.plan import Plan

if not config:

    configfile: f"{workflow.basedir}/config/demo.yaml"


try:
    PLAN = Plan(beside(config, *workflow.configfiles))
    PLAN.settle()
except (ConfigError, lock.LockError, OSError) as error:
    sys.exit(f"echotruth: {error}")

OUT, STORE = PLAN.folder.as_posix(), PLAN.store.as_posix()
HEARTS = list(PLAN.hearts)  # material, fibre angles, loop, disease: all that makes a heart move as it does
CASES = list(PLAN.cases)  # a heart, and how it is imaged: seed of the scatterers, array, realism
VIEWS = list(PLAN.config.views)  # slices: short axes from base to apex, long axes
SIZES = list(PLAN.config.bmode.sizes)  # resolutions, px

CLIP = f"{STORE}/clips/{{case}}/{{view}}"  # a case seen in a view

shell.prefix(processes.prefix(Path(workflow.basedir)))  # sets $SCRIPTS and what all processes share


wildcard_constraints:
    heart="[^/]+",
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


rule all:
    default_target: True
    input:
        expand(f"{STORE}/hearts/{{heart}}/zarr.json", heart=HEARTS),
        expand(f"{CLIP}/truth/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        expand(f"{CLIP}/bmode/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        expand(f"{CLIP}/tracking/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        f"{OUT}/SHA256SUMS",
        f"{OUT}/report.html",


onstart:
    PLAN.begin()  # writes the configuration of each case
