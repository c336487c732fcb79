"""What jobs leave behind, without the jobs: benchmark files of Snakemake, and records."""

from pathlib import Path

from echotruth.config import Config
from echotruth.workflow.jobs import jobs

HEADER = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


def write_benchmark(folder: Path, job: str, s, cpu_time="NA") -> Path:
    """Write the benchmark file of a job."""
    file = folder / "benchmarks" / f"{job}.tsv"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{HEADER}{s}\t0:00:01\tNA\tNA\tNA\tNA\t-\t-\tNA\t{cpu_time}\n")
    return file


def finish(folder: Path, rule: str, config: Config, cases: list[str]) -> None:
    """Write a record of every job of a rule."""
    if rule in ("repository", "report"):
        paths = [folder / ("ledger/repository.json" if rule == "repository" else "report.html")]
    else:
        paths = [folder / f"ledger/{rule}/{job}.json" for job in jobs(rule, config, cases)]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('{"status": "complete"}')
