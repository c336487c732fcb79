"""A SLURM of one node makes the bytes of a local run."""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from rigid_hearts import CONFIG

from echotruth.workflow.lease import VARIABLE

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


def run(folder, *options, prefix=()):
    folder.mkdir(exist_ok=True)
    (folder / "tiny.yaml").write_text(CONFIG)
    command = [*prefix, sys.executable, "-c", "from echotruth.cli import main; main()", "run", "tiny.yaml", *options]
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if prefix and done.returncode == NOT_STARTED:
        pytest.skip(f"SLURM does not start on this machine: {done.stderr[-500:]}")
    assert done.returncode == 0, done.stderr


def content(folder):
    files = [path for path in (folder / "out/tiny").glob("*.zarr/**/*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_slurm_makes_the_bytes_of_a_local_run(tmp_path):
    local, cluster = tmp_path / "local", tmp_path / "cluster"
    run(local, "--cores", "2")
    run(cluster, "--profile", "slurm", prefix=["timeout", LIMIT, str(CLUSTER)])
    assert content(cluster) == content(local)
    submitted = (cluster / "out/tiny/logs/snakemake.log").read_text().count("has been submitted with SLURM jobid")
    assert submitted <= 7  # one compilation, two hearts, two views, publication and report; not one a rule and heart
