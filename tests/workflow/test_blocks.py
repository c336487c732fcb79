"""A sweep that is made in blocks of hearts is the one that is made at once, byte for byte, and is continued so."""

import json
import re
from pathlib import Path

import pytest
from rigid_hearts import CONFIG
from workspace import Workspace, differing, planned

import echotruth as et
from echotruth.config.loading import ConfigError
from echotruth.workflow.blocks import Block
from echotruth.workflow.plan import Plan

MOTIONS = {f"heart{number}": f"motion{number % 7 if number % 3 else number}" for number in range(50)}


@pytest.mark.parametrize("count", [1, 2, 7, 49, 50, 80])
def test_every_heart_is_in_exactly_one_block(count):
    blocks = [Block(number, count).of(MOTIONS) for number in range(1, count + 1)]
    assert sorted(case for block in blocks for case in block) == sorted(MOTIONS)
    assert Block(0, count).of(MOTIONS) == []


@pytest.mark.parametrize("count", [1, 2, 7, 49, 50, 80])
def test_hearts_with_the_same_motion_are_in_one_block(count):
    blocks = [{MOTIONS[case] for case in Block(number, count).of(MOTIONS)} for number in range(1, count + 1)]
    assert sum(map(len, blocks)) == len(set(MOTIONS.values()))


def test_blocks_of_hearts_that_move_differently_have_the_same_size():
    motions = {f"heart{number}": str(number) for number in range(200)}
    assert {len(Block(number, 4).of(motions)) for number in range(1, 5)} == {50}


@pytest.mark.parametrize("text", ["", "3", "3/2", "a/b", "-1/2", "1/0"])
def test_what_is_no_block_is_refused_in_a_sentence(text):
    with pytest.raises(ConfigError, match=r"^mine: block = .*: give a number and that of all blocks, such as 3/40$"):
        Block.parse(text, "mine")


def test_block_is_read():
    assert Block.parse("3/40", "mine") == (3, 40) and Block.parse(None, "mine") == (1, 1)


THREE = re.sub(r"cases: .*\n", "cases: {fibres.endo_deg: [60, 65, 70]}\n", CONFIG)
"""Three hearts, none of which shares the motion of another."""
SWEEP = re.sub(r"cases: .*\n", """\
cases:
  file: hearts.csv
  draw: {number: 1, seed: 3, keys: {seed: {integers: [1, 1000]}}}
  where: fibres.endo_deg > 50
""", CONFIG)  # fmt: skip
TABLE = "case,fibres.endo_deg,label.group,note\na,60,sham,\nb,40,MI,is left out\nc,70,MI,last\n"
MORE = TABLE.replace("c,70", "d,65,MI,\nc,70")
"""Another heart, between those that were made."""


def sweep(folder: Path) -> Workspace:
    """Folder with the configuration of two hearts, and with their table."""
    made = Workspace(folder, SWEEP)
    (folder / "hearts.csv").write_text(TABLE)
    return made


def test_mark_of_a_block_changes_with_whatever_makes_its_hearts_again():
    def mark(config=THREE, number=1):
        import yaml

        return Plan(yaml.safe_load(config) | {"block": f"{number}/3"}).mark

    others = {
        mark(number=2),
        mark(THREE.replace("method: dis", "method: phase_correlation")),
        mark(THREE.replace("elements: 16", "elements: 20")),
        mark(THREE.replace("position: 0.5", "position: 0.6")),
        mark(THREE + "physiology: {twist_max_deg: 50}\n"),
    }
    assert len({mark(), *others}) == 6
    assert mark(THREE.replace("70]", "75]")) == mark(), "another heart is not in this block"


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Workspace:
    """The sweep in one plan."""
    made = sweep(tmp_path_factory.mktemp("whole") / "echotruth")
    made.echotruth("run", "tiny.yaml", "--cores", "2", "repository")
    return made


@pytest.fixture(scope="module")
def blocks(tmp_path_factory) -> Workspace:
    """The sweep in blocks of one heart, two at once."""
    made = sweep(tmp_path_factory.mktemp("blocks") / "echotruth")
    in_blocks(made, "--blocks-at-once", "2")
    return made


def in_blocks(workspace: Workspace, *options: str) -> dict[str, dict[str, int]]:
    """Make the repository in blocks of one heart; log of each Snakemake -> rule -> number of its jobs."""
    for log in workspace.out.glob("logs/snakemake*"):
        log.unlink()
    workspace.echotruth("run", "tiny.yaml", "--cores", "1", "--hearts-per-block", "1", *options, "repository")
    return {path.stem: planned(path.read_text()) for path in workspace.out.glob("logs/snakemake*")}


@pytest.mark.slow
def test_blocks_make_the_bytes_of_one_plan(whole, blocks):
    assert differing(blocks.out, whole.out) == []
    assert len(list(blocks.out.glob("blocks/*.made"))) == 2
    assert not (blocks.out / "scratch").exists()


@pytest.mark.slow
def test_lost_record_is_made_again_in_its_block(whole, blocks):
    lost = next(blocks.out.glob("ledger/bmode/*/mid/128.json"))
    lost.unlink()
    made = in_blocks(blocks)
    assert sorted(made) == ["snakemake_0", "snakemake_" + str(1 + cases(blocks).index(lost.parts[-3]))]
    assert {**made.pop("snakemake_0")} == {"repository": 1}
    (jobs,) = made.values()
    assert jobs.pop("bmode") == 1 and "mechanics" not in jobs
    assert differing(blocks.out, whole.out) == []


def cases(workspace: Workspace) -> list[str]:
    return [line.partition(",")[0] for line in (workspace.out / "cases.csv").read_text().splitlines()[1:]]


@pytest.mark.slow
def test_repository_follows_a_block_that_was_made_by_a_run_that_was_interrupted(blocks):
    (blocks.out / "ledger/repository.json").unlink()  # as every job does before it commits
    assert in_blocks(blocks) == {"snakemake_0": {"repository": 1}}


def times(workspace: Workspace, pattern: str) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in workspace.out.glob(pattern)}


@pytest.mark.slow
def test_sweep_is_continued_with_another_row_and_read_without_its_table(blocks):
    marks, records = times(blocks, "blocks/*.made"), times(blocks, "ledger/*/*/**/*.json")
    (blocks.folder / "hearts.csv").write_text(MORE)
    assert blocks.planned()["rf"] == 1
    in_blocks(blocks)
    assert len(list(blocks.out.glob("blocks/*.made"))) == 3
    assert times(blocks, "blocks/*.made").items() >= marks.items(), "what was made is not planned again"
    more = times(blocks, "ledger/*/*/**/*.json")
    assert len(more) > len(records) and more.items() >= records.items()

    for name in ("hearts.csv", "tiny.yaml"):
        (blocks.folder / name).unlink()
    table = et.Repository(blocks.out).tree["cases"].to_dataset().to_dataframe().sort_index()
    assert [case.partition("_")[0] for case in table.index] == ["a", "c", "d"]
    assert list(table["label.group"]) == ["sham", "MI", "MI"] and set(table["status"]) == {"complete"}
    assert et.Repository(blocks.out).heart(table.index[2]).config.fibres.endo_deg == 65
    assert et.Repository(blocks.out).clip(table.index[2])["image"].shape == (4, 128, 128)
    blocks.echotruth("run", "out/tiny/config.yaml", "--cores", "1", "--hearts-per-block", "1", "repository")
    assert times(blocks, "ledger/*/*/**/*.json") == more


@pytest.mark.slow
def test_block_of_a_repository_that_is_not_laid_out_lays_it_out(tmp_path):
    made = Workspace(tmp_path / "echotruth", THREE)
    options = ("--configfile", "tiny.yaml", "--cores", "1")
    made.snakemake(*options, "--until", "mechanics", "--config", "block=2/3", "--", "hearts")
    assert len(cases(made)) == 3
    assert [path.stem for path in made.out.glob("ledger/mechanics/*")] == [cases(made)[1]]
    record = json.loads(next(made.out.glob("ledger/mechanics/*")).read_text())
    assert record["status"] == "complete"
    laid_out = (made.out / "config.yaml").stat().st_mtime_ns
    output = made.snakemake(*options, "--config", "block=0/3", status=1)
    assert "Missing input files" in output and "blocks/" in output
    assert (made.out / "config.yaml").stat().st_mtime_ns == laid_out


@pytest.mark.slow
def test_wrong_block_is_told_in_a_sentence(tmp_path):
    made = Workspace(tmp_path / "echotruth", THREE)
    output = made.snakemake("--configfile", "tiny.yaml", "-n", "--config", "block=4/3", status=1)
    assert "echotruth: configuration: block = 4/3: give a number and that of all blocks" in output
    assert "Traceback" not in output and not (Path(made.folder) / "out").exists()
