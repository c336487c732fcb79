"""A SLURM of one node makes the bytes of jobs in one process."""

import importlib.util
import os
import shutil
from pathlib import Path

import pytest
from finished_repository import content
from workspace import COMMAND, Workspace, alone

PROGRAMS = ("slurmctld", "slurmd", "sbatch", "munged", "mungekey")
SEARCHED = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
MISSING = [program for program in PROGRAMS if shutil.which(program, path=SEARCHED) is None]
if importlib.util.find_spec("snakemake_executor_plugin_slurm") is None:
    MISSING.append("snakemake-executor-plugin-slurm")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)} (docs/cluster.md)"),
]

CLUSTER = Path(__file__).with_name("slurm.sh")
LIMIT = "600"
"""Seconds after which the cluster is shut down."""
NOT_STARTED = 78
"""Status of the script if a daemon of the cluster did not start."""


def test_slurm_makes_the_bytes_of_jobs_in_one_process(tmp_path):
    cluster = Workspace(tmp_path / "cluster")
    run = cluster.start(
        "timeout", LIMIT, str(CLUSTER), *COMMAND, "run", "tiny.yaml", "repository", "--profile", "slurm"
    )
    output, _ = run.communicate()
    if run.returncode == NOT_STARTED:
        pytest.skip(f"SLURM does not start on this machine: {output[-500:]}")
    assert run.returncode == 0, output
    assert content(cluster.out) == content(alone(tmp_path / "alone"))
    submitted = (cluster.out / "logs/snakemake.log").read_text().count("has been submitted with SLURM jobid")
    assert submitted <= 3  # the heart, its view, and the repository; not one a rule
