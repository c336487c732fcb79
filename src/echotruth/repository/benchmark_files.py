"""What jobs took, by the files that Snakemake's `benchmark` wrote: benchmarks/RULE/CASE/VIEW/SIZE.tsv."""

from csv import DictReader
from pathlib import Path


def core_seconds(file: Path) -> float:
    """Time for which a job had a core, s; 0 if its file cannot be read.

    The CPU time in it lacks the end of the job, because Snakemake looks every half second and later every half minute.
    So the time itself counts where it is more: that of jobs of one thread.
    """
    try:
        with file.open(encoding="utf-8", newline="") as lines:
            row = next(DictReader(lines, delimiter="\t"))
        return max(float(row[key]) for key in ("s", "cpu_time") if row[key] not in ("NA", "-"))
    except (OSError, ValueError, KeyError, StopIteration):
        return 0.0


def total(folder: Path, rule: str = "*") -> float:
    """Sum over the jobs of a rule, or of all, s.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    rule : str, optional
    """
    files = [*folder.glob(f"benchmarks/{rule}/**/*.tsv"), *folder.glob(f"benchmarks/{rule}.tsv")]
    return sum(map(core_seconds, files))
