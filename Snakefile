"""Hearts, their images with the true motion, and trackers scored by it, in one Zarr repository.

    snakemake --cores 2                                   # makes out/demo
    snakemake --cores 2 --configfile config/sweep.yaml    # makes out/sweep

The way of a view, of which docs/workflow.md has the picture:

    heart -> phantom -> rf -> bmode --+
      |                               |
      +----> truth -------------------+-> tracking -> repository -> report
      |                               |
      +----> points ------------------+

- What a rule makes is a group of the Zarr hierarchy: its output is the `zarr.json` of the group, which is there when
  the group is whole. A job that was killed leaves nothing.
- A group says in its attributes what it was made with: a hash of the settings and the code of its stage and of all
  before it. Snakemake makes what is missing. What was made otherwise is asked for by the file below TOUCHED that its
  job makes besides, and a job whose groups stand reads nothing (`PLAN.asked_for`, `PLAN.needed`). Dates of files say
  nothing, and so all that is read is `ancient`.
- A heart without a solution is a group too, which says why. What follows it writes groups that say skipped.
"""

import sys
from pathlib import Path

ROOT = Path(workflow.current_basedir)  # also if another workflow takes this one as a module
if (ROOT / "src").is_dir():  # a checkout runs itself, whatever is installed
    sys.path.insert(0, f"{ROOT}/src")

from echotruth.config.loading import ConfigError, beside
from echotruth.workflow import lock, processes
from echotruth.workflow.plan import Plan
from echotruth.workflow.status import conclusion

if not config:

    configfile: f"{ROOT}/config/demo.yaml"


try:
    PLAN = Plan(beside(config, *workflow.configfiles))
except (ConfigError, OSError) as error:
    sys.exit(f"echotruth: {error}")

OUT, STORE = PLAN.folder.as_posix(), PLAN.store.as_posix()
HEARTS = list(PLAN.hearts)  # material, fibre angles, loop, disease: all that makes a heart move as it does
CASES = list(PLAN.cases)  # a heart, and how it is imaged: seed of the scatterers, array, realism
VIEWS = list(PLAN.config.views)  # slices: short axes from base to apex, long axes; or volumes
SIZES = list(PLAN.config.image_names)  # resolutions, px, or volume
TRACKERS = list(PLAN.config.tracking.trackers)

HEART = f"{STORE}/hearts/{{heart}}/zarr.json"
CLIP = f"{STORE}/clips/{{case}}/{{view}}"  # a case seen in a view
OF_CLIP = [*expand("truth/{size}", size=SIZES), *expand("bmode/{size}", size=SIZES), "points"]
OF_CLIP += expand("tracking/{tracker}", tracker=TRACKERS)
TOUCHED = PLAN.touched  # files that jobs of this run touch
GROUPS = expand(HEART, heart=HEARTS) + expand(f"{CLIP}/{{group}}/zarr.json", case=CASES, view=VIEWS, group=OF_CLIP)
GROUPS += expand(f"{STORE}/inference/{{case}}/zarr.json", case=CASES if PLAN.config.inference.tracker else [])

shell.prefix(processes.prefix(ROOT))  # sets $SCRIPTS and what all processes share


wildcard_constraints:
    heart="[^/]+",
    case="[^/]+",
    view="[^/]+",
    tracker="[^/]+",


include: "rules/mechanics.smk"
include: "rules/phantom.smk"
include: "rules/rf.smk"
include: "rules/truth.smk"
include: "rules/points.smk"
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
        PLAN.asked_for(GROUPS),
        f"{OUT}/SHA256SUMS",
        f"{OUT}/report.html",
        PLAN.unpublished,
        PLAN.unreported,


onstart:
    try:
        PLAN.begin()  # writes the configuration of each case
    except (lock.LockError, OSError) as error:
        sys.exit(f"echotruth: {error}")


onsuccess:
    PLAN.end()
    print(*conclusion(PLAN.config, PLAN.folder), sep="\n")  # warnings, and hearts that have no result


onerror:
    PLAN.end()
