"""The workflow on hearts from a table: run in batches, continued with another row, and read without the table."""

import os
import re
import subprocess
import sys
from pathlib import Path

import cores
import pytest
import rigid_hearts

import echotruth as et

ROOT = Path(__file__).parents[2]
CASES = """\
cases:
  file: hearts.csv
  draw: {number: 2, seed: 3, keys: {seed: {integers: [1, 1000]}}}
  where: fibres.endo_deg > 50
"""
TABLE = "case,fibres.endo_deg,label.group,note\na,60,sham,\nb,40,MI,is left out\nc,70,MI,last\n"
MORE = TABLE.replace("c,70", "d,65,MI,\nc,70")

pytestmark = pytest.mark.slow


def run(folder: Path, *options: str) -> str:
    """Output of `echotruth run`, which must succeed; the target `repository` leaves out the report."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "agg"}
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", "run", *options]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def planned(folder: Path, config: str) -> dict[str, int]:
    """Rule -> number of jobs that a run would start."""
    found = re.findall(r"^(\w+) +(\d+)$", run(folder, config, "-n", "--cores", "1", "repository"), re.MULTILINE)
    return {rule: int(count) for rule, count in found}


def test_hearts_of_a_table_are_made_in_batches_continued_and_read_without_it(tmp_path):
    cores.lend(tmp_path / ".snakemake/numba")
    config = re.sub(r"cases: .*\n", CASES, rigid_hearts.CONFIG)
    (tmp_path / "tiny.yaml").write_text(config)
    (tmp_path / "hearts.csv").write_text(TABLE)
    run(tmp_path, "tiny.yaml", "--cores", "1", "--batch", "repository=1/2")
    out = tmp_path / "out/tiny"
    assert 0 < len(list(out.glob("ledger/tracking/*/mid.json"))) < 4
    run(tmp_path, "tiny.yaml", "--cores", "1", "repository")
    assert planned(tmp_path, "tiny.yaml") == {}
    made = {path: path.stat().st_mtime_ns for path in out.glob("ledger/*/*/*.json")}
    frame = et.Repository(out).tree["cases"].to_dataset().to_dataframe()
    assert [id.partition("_")[0] for id in frame.index] == ["a", "a", "c", "c"]
    assert list(frame["label.group"]) == ["sham", "sham", "MI", "MI"]
    assert list(frame["status"]) == ["complete"] * 4

    (tmp_path / "hearts.csv").write_text(MORE)
    assert planned(tmp_path, "tiny.yaml")["imaging"] == 2
    run(tmp_path, "tiny.yaml", "--cores", "1", "repository")
    assert {path: path.stat().st_mtime_ns for path in made} == made
    assert len(et.Repository(out).tree["cases/case"]) == 6

    (tmp_path / "hearts.csv").unlink()
    (tmp_path / "tiny.yaml").unlink()
    assert et.Repository(out).heart(frame.index[2]).config.fibres.endo_deg == 70
    assert et.Repository(out).clip(frame.index[2])["image"].shape == (4, 128, 128)
    assert planned(tmp_path, "out/tiny/config.yaml") == {}
