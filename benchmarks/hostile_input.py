"""What becomes of hostile configurations, meshes and motions, and of damaged repositories, on the command line.

    python benchmarks/hostile_input.py

Everything is drawn from a seed. Each input is refused in a sentence, found by `echotruth check`, or accepted rightly,
for a reason that is stated; all else is a fault: a traceback, a process that ends or goes on for ever, silence, code
that was run, or a file outside of a repository that was touched. Inputs go to a process of their own, which is started
again if one of them ends it. Writes results/hostile_input.json, with every input, and results/hostile_input.md; the
exit status is 1 if there is a fault.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import hostile_configurations
import hostile_meshes
import hostile_repository
import numpy as np
from hostile_child import ACCEPTED, FOUND, REFUSED, Child, Trial

import echotruth

PARTS = {module.PART: module for module in (hostile_configurations, hostile_meshes, hostile_repository)}
RESULTS = Path(__file__).parent / "results"


def cpu_s() -> float:
    """Processor time of this process and of those that have ended, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def run(part: str, seed: int) -> list[Trial]:
    """All inputs of a part; faults are printed as they are found."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        child = Child(folder)
        trials = []
        for trial in PARTS[part].tried(folder, child, np.random.default_rng(seed), folder / "marker"):
            trials.append(trial)
            if trial.is_fault:
                print(f"{trial.outcome}: {trial.kind}: {trial.name}\n{trial.said}", flush=True)
        child.close()
    print(part, dict(Counter(trial.outcome for trial in trials)), flush=True)
    return trials


def page(report: dict[str, dict]) -> str:
    """The table of kinds and outcomes."""
    lines = [
        "# Hostile input",
        "",
        f"`benchmarks/hostile_input.py`, version {echotruth.__version__}. An input is refused in a sentence,",
        "found by `echotruth check`, or accepted rightly: what it holds is valid, and read as it stands there, or is",
        "read by nothing. All else is a fault: a traceback, a process that ends or never does, silence, code that",
        "was run, or a file outside of the repository that was touched or taken along.",
    ]
    for part, results in report.items():
        counts: dict[str, Counter[str]] = {}
        for trial in results["trials"]:
            counts.setdefault(trial["kind"], Counter())[trial["outcome"]] += 1
        total = sum(counts.values(), Counter())
        lines += [
            "",
            f"## {part.capitalize()}",
            "",
            f"{total.total()} inputs, {results['cpu_s']:.0f} s of processor time.",
            "",
        ]
        lines += ["| | inputs | refused | found | accepted rightly | faults |", "|---|---|---|---|---|---|"]
        for kind, count in (*sorted(counts.items()), ("all", total)):
            told = [count[outcome] for outcome in (REFUSED, FOUND, ACCEPTED)]
            cells = [count.total(), *told, count.total() - sum(told)]
            lines.append(f"| {kind} | {' | '.join(map(str, cells))} |")
        reasons = Counter(trial["said"] for trial in results["trials"] if trial["outcome"] == ACCEPTED)
        lines += ["", *(f"- accepted, {number}: {reason}" for reason, number in sorted(reasons.items()))]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="the others stay as they were")
    parser.add_argument("--seed", type=int, default=38)
    arguments = parser.parse_args()
    path = RESULTS / "hostile_input.json"
    before = json.loads(path.read_text()) if path.is_file() else {}
    report = {part: before[part] for part in PARTS if part in before}
    for part in arguments.parts:
        start = cpu_s()
        trials = [asdict(trial) for trial in run(part, arguments.seed)]
        spent = round(cpu_s() - start, 1)
        counts = dict(sorted(Counter(trial["outcome"] for trial in trials).items()))
        report[part] = {"seed": arguments.seed, "cpu_s": spent, "outcomes": counts, "trials": trials}
    report = {part: report[part] for part in PARTS if part in report}
    path.write_text(json.dumps(report, indent=1, ensure_ascii=True) + "\n")
    path.with_suffix(".md").write_text(page(report))
    return int(any(outcome.startswith("fault") for results in report.values() for outcome in results["outcomes"]))


if __name__ == "__main__":
    sys.exit(main())
