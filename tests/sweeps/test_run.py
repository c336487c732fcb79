"""The workflow on hearts from a table: made in blocks, continued with another row, and read without the table."""

import re

import pytest
import rigid_hearts
from workspace import Workspace

import echotruth as et

CASES = """\
cases:
  file: hearts.csv
  draw: {number: 2, seed: 3, keys: {seed: {integers: [1, 1000]}}}
  where: fibres.endo_deg > 50
"""
TABLE = "case,fibres.endo_deg,label.group,note\na,60,sham,\nb,40,MI,is left out\nc,70,MI,last\n"
MORE = TABLE.replace("c,70", "d,65,MI,\nc,70")

pytestmark = pytest.mark.slow


def test_hearts_of_a_table_are_made_in_blocks_continued_and_read_without_it(tmp_path):
    made = Workspace(tmp_path / "echotruth", re.sub(r"cases: .*\n", CASES, rigid_hearts.CONFIG))
    (made.folder / "hearts.csv").write_text(TABLE)
    run = ("run", "tiny.yaml", "--cores", "1", "--hearts-per-block", "2", "repository")
    made.echotruth(*run)
    assert len(list(made.out.glob("blocks/*.made"))) == 2, "hearts that differ in their speckle have one motion"
    marks = {path: path.stat().st_mtime_ns for path in made.out.glob("blocks/*.made")}
    records = {path: path.stat().st_mtime_ns for path in made.out.glob("ledger/*/*/**/*.json")}
    frame = et.Repository(made.out).tree["cases"].to_dataset().to_dataframe()
    assert [id.partition("_")[0] for id in frame.index] == ["a", "a", "c", "c"]
    assert list(frame["label.group"]) == ["sham", "sham", "MI", "MI"]
    assert list(frame["status"]) == ["complete"] * 4

    (made.folder / "hearts.csv").write_text(MORE)
    assert made.planned()["rf"] == 2
    made.echotruth(*run)
    assert {path: path.stat().st_mtime_ns for path in records} == records
    assert {path: path.stat().st_mtime_ns for path in marks} == marks, "what was made is not planned again"
    assert len(et.Repository(made.out).tree["cases/case"]) == 6

    (made.folder / "hearts.csv").unlink()
    (made.folder / "tiny.yaml").unlink()
    assert et.Repository(made.out).heart(frame.index[2]).config.fibres.endo_deg == 70
    assert et.Repository(made.out).clip(frame.index[2])["image"].shape == (4, 128, 128)
    made.echotruth("run", "out/tiny/config.yaml", *run[2:])
    assert {path: path.stat().st_mtime_ns for path in records} == records
