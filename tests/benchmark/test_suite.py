"""The suite: its hearts, the rows of a heart against those of a repository, and its parts."""

import os
import subprocess
import sys
from collections import Counter
from hashlib import sha256

import numpy as np
import pandas as pd
import pytest

import echotruth as et
from benchmarks.suite import __main__ as command
from benchmarks.suite import columns, hearts, parts, scores
from benchmarks.suite.hearts import SuiteCase, cases_of, plan
from benchmarks.suite.scores import view_rows
from echotruth.config.imaging import ViewMotion
from echotruth.extras import MissingPackage
from echotruth.repository.version import version_of
from echotruth.workflow import instructions

GROUPS = {"healthy", "infarct", "late_activation", "hypertrophy", "dilation"}


@pytest.fixture(scope="module")
def cases():
    return [one for row in plan() for one in cases_of(row, 1)]


def test_hearts_are_as_many_as_the_ranks_need_and_mixed_over_the_parts():
    table = pd.DataFrame(plan())
    assert table["heart"].is_unique and table.groupby("part").size().eq(8).all()
    count = table.groupby(["split", "species"]).size()
    assert count["test", "mouse"] >= 48 and count["test", "human"] >= 12 and count["develop"].sum() == 16
    assert table.groupby("part")["split"].nunique().eq(1).all()
    assert table.groupby("part")["group"].nunique().ge(4).all()
    for _, part in table[table["species"] == "mouse"].groupby("split"):
        assert set(part["group"]) == GROUPS and part.groupby("group")["kind"].nunique().ge(1).all()


def test_case_is_what_its_labels_say(cases):
    assert len({one.case.config.seed for one in cases}) == len(plan())
    for case, sorts in cases:
        config, variation = case.config, sorts["variation"]
        realism, motion = config.realism, [view.motion for view in config.views.values()]
        assert realism.preset == (sorts["species"] if sorts["acoustics"] == "realistic" else "none")
        assert (config.geometry.preset, config.name) == (sorts["species"], sorts["case"])
        assert [view.plane for view in config.views.values()] == ["short_axis", "long_axis"]
        assert all((one != ViewMotion()) == (variation == "motion") for one in motion)
        assert (config.tracking.frame_step == 2) == (variation == "low_rate")
        assert config.bmode.sizes == (256, 128) and config.loop.kind == "circulation"
        assert config.loop.frames == (20 if sorts["species"] == "mouse" else 40)
        if sorts["species"] == "mouse":
            assert (realism.shadow.side != "none") == (variation == "shadow")
    mice = [one.sorts for one in cases if one.sorts["split"] == "test" and one.sorts["species"] == "mouse"]
    count = Counter((one["disease"], one["variation"]) for one in mice if one["acoustics"] == "realistic")
    variations = ("none", "motion", "shadow", "low_rate")
    assert min(count["diseased", name] for name in variations) >= 4
    assert all(count["healthy", name] for name in variations)


def test_ideal_case_has_the_motion_and_the_planes_of_the_realistic_one_and_no_drawn_condition(cases):
    ideal = {one.sorts["heart"]: one for one in cases if one.sorts["acoustics"] == "ideal"}
    real = {one.sorts["heart"]: one for one in cases if one.sorts["acoustics"] == "realistic"}
    assert len(ideal) >= 16 and len({version_of("mechanics", one.case.config) for one in real.values()}) == len(real)
    for heart, one in ideal.items():
        config, other = one.case.config, real[heart].case.config
        assert version_of("mechanics", config) == version_of("mechanics", other) and config.views == other.views
        assert real[heart].sorts["variation"] == "none"


def test_second_attempt_is_another_heart_of_the_same_kind():
    row = next(row for row in plan() if row["group"] == "infarct")
    first, again, second = (hearts.motion_keys(row, attempt) for attempt in (1, 1, 2))
    assert first == again and first.keys() == second.keys() and first != second
    low, high = hearts.SHAPE["geometry.scale"]
    assert low <= first["geometry.scale"] <= high


@pytest.mark.slow
def test_rows_of_a_view_are_those_of_the_repository_that_a_run_makes(finished):
    repository = et.Repository(finished)
    case, metrics = next(iter(repository.every.values())), repository.metrics()
    sorts, heart = dict.fromkeys(columns.IDENTITY[:8], "a") | {"case": case.id}, repository.heart(case.id)
    heart.arrays["physiology"] = {"ejection_fraction": repository.read("physiology/ejection_fraction", case.id)}
    for view in case.config.views:
        rows = pd.DataFrame(view_rows(SuiteCase(case, sorts), heart, view))
        keys = ["size_px", "tracker"]
        of_view = {
            name: table[(table["case"] == case.id) & (table["view"] == view)]
            for name, table in metrics._asdict().items()
        }
        clips = of_view["clips"].set_index(keys).loc[list(zip(*(rows[key] for key in keys), strict=True))]
        for size, image in zip(rows["size_px"], rows["images"], strict=True):
            stored = np.ascontiguousarray(repository.read(f"bmode/{size}/image", case.id, view))
            assert sha256(stored.tobytes()).hexdigest()[:16] == image
        numbers = clips.select_dtypes("number").columns
        np.testing.assert_allclose(rows[numbers].to_numpy(float), clips[numbers].to_numpy(float), rtol=1e-6, atol=1e-6)
        tangential = of_view["segments"].query("component != 'radial'").sort_values([*keys, "aha"])
        found = columns.segments(rows.assign(part=1)).sort_values([*keys, "aha"])
        names = ["aha", *columns.OF_SEGMENT]
        np.testing.assert_allclose(
            found[names].to_numpy(float), tangential[names].to_numpy(float), rtol=1e-4, atol=1e-4
        )
        assert set(found["component"]) == set(tangential["component"])
        by = [*keys, "quality_low"]
        steps = columns.reliability(rows.assign(part=1)).sort_values(by)["within_count"].to_numpy(float)
        np.testing.assert_array_equal(steps, of_view["reliability"].sort_values(by)["within_count"].to_numpy(float))


def rows_of(heart, trackers=None, images="i"):
    """Rows of a heart that nobody made."""
    known = {"split": "test", "heart": heart["heart"], "variation": "none", "case": heart["heart"], "view": "mid"}
    known |= {"species": "mouse", "size_px": 256, "failure": "", "images": images, "code": "c", "cpu_s": 0.5}
    return [known | {"tracker": name, "nrmse_all_percent": np.float64(100 / 3)} for name in trackers or ("dis", "one")]


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Folder of part 1, made of rows that nobody made."""
    monkeypatch.setattr(parts, "heart_rows", rows_of)
    monkeypatch.setattr(parts, "FOLDER", tmp_path / "parts")
    monkeypatch.setattr(parts, "SCRATCH", tmp_path / "scratch")
    parts.make_part(1, say=lambda _: None)
    return tmp_path / "parts"


def test_part_is_read_as_it_was_written_and_is_the_same_bytes_again(made):
    table, path = parts.read_parts(made), made / "part-01.csv.gz"
    assert len(table) == 16 and set(table["failure"]) == {""} and set(table["variation"]) == {"none"}
    assert table["nrmse_all_percent"].tolist() == [33.333] * 16 and "cpu_s" not in table
    before = path.read_bytes()
    for kept in made.parent.glob("scratch/*/*.json"):
        kept.unlink()
    parts.make_part(1, say=lambda _: None)
    assert path.read_bytes() == before


def test_hearts_that_were_made_are_not_made_again(made, monkeypatch):
    monkeypatch.setattr(parts, "heart_rows", None)
    assert parts.make_part(1, say=lambda _: None) == made / "part-01.csv.gz"


def test_further_tracker_is_put_beside_a_part_with_the_same_images_alone(made, monkeypatch, tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("other: {method: dis}")
    parts.make_part(1, trackers=mine, say=lambda _: None)
    assert set(parts.read_parts(made)["tracker"]) == {"dis", "one", "other"}
    monkeypatch.setattr(parts, "heart_rows", lambda *given: rows_of(*given, images="j"))
    with pytest.raises(ValueError, match=r"its images are not those of the part, by .* instructions"):
        parts.make_part(1, trackers=mine, say=lambda _: None)


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("", "mine.yaml: names no tracker"),
        ("{}", "mine.yaml: names no tracker"),
        ("- dis", "mine.yaml: contains a list"),
        ("a: [", "mine.yaml, line 1: "),
        ("dis: {method: dis}", "mine.yaml: the tracker dis is in .*part-01.csv.gz already"),
        ("other: {method: dis}", "mine.yaml: the tracker other is in .*part-01-first.csv.gz already"),
    ],
)
def test_file_without_a_new_tracker_is_refused(made, tmp_path, text, refusal):
    first, mine = tmp_path / "first.yaml", tmp_path / "mine.yaml"
    first.write_text("other: {method: dis}")
    for _ in range(2):  # its own file may be made again
        parts.make_part(1, trackers=first, say=lambda _: None)
    mine.write_text(text)
    with pytest.raises(ValueError, match=refusal):
        parts.make_part(1, trackers=mine, say=lambda _: None)


def test_rows_that_are_there_twice_are_refused(made):
    (made / "part-01-copy.csv.gz").write_bytes((made / "part-01.csv.gz").read_bytes())
    with pytest.raises(ValueError, match=r"part-01\.csv\.gz: the tracker dis is in mouse\d+ a second time"):
        parts.read_parts(made)


@pytest.mark.parametrize("place", range(len(hearts.FILES)))
def test_version_is_of_the_files_of_the_suite_too(monkeypatch, tmp_path, place):
    monkeypatch.setattr(hearts, "plan", lambda: plan()[:1])
    before = hearts.suite_version.__wrapped__()
    changed = tmp_path / "changed.py"
    changed.write_bytes(hearts.FILES[place].read_bytes() + b"#")
    monkeypatch.setattr(hearts, "FILES", tuple(changed if k == place else f for k, f in enumerate(hearts.FILES)))
    assert hearts.suite_version.__wrapped__() != before


def test_cost_is_that_of_this_process_and_of_those_that_it_started():
    begun = scores._cpu_time()
    busy = "import time\nwhile time.process_time() < 0.5: pass"
    subprocess.run([sys.executable, "-c", busy], check=True)
    assert scores._cpu_time() - begun == pytest.approx(0.5, abs=0.2)


def test_command_runs_with_the_instructions_of_a_run(tmp_path):
    other = {name: "" for name in instructions.environment()}
    code = (
        "import sys, runpy; from echotruth.workflow import instructions\n"
        "if instructions.environment().items() <= __import__('os').environ.items(): sys.exit(7)\n"
        "from benchmarks.suite import __main__ as command; command.set_instructions(); sys.exit(0)"
    )
    ended = subprocess.run([sys.executable, "-c", code], env=os.environ | other, check=False)
    assert ended.returncode == 7


def test_parts_of_other_code_are_refused(made, monkeypatch):
    other = [row | {"code": "d"} for row in rows_of({"heart": "mouse99"})]
    (made / "part-02.csv.gz").write_bytes(parts.packed(pd.DataFrame(other)))
    with pytest.raises(ValueError, match=r"part-02.* was made with other code than part-01"):
        parts.read_parts(made)


@pytest.mark.parametrize("arguments", [["part", "99"], ["part", "2", "--tracker", "nowhere.yaml"]])
def test_what_is_not_there_is_refused_in_one_line(made, monkeypatch, capsys, arguments):
    monkeypatch.setattr("sys.argv", ["suite", *arguments])
    assert command.main() == 2 and capsys.readouterr().err.count("\n") == 1


def test_package_that_is_missing_is_told_in_one_line(made, monkeypatch, capsys):
    def without(*_):
        raise MissingPackage("model.onnx needs the package onnxruntime")

    monkeypatch.setattr(parts, "make_part", without)
    monkeypatch.setattr("sys.argv", ["suite", "part", "1"])
    assert command.main() == 2 and capsys.readouterr().err.count("\n") == 1


def test_page_without_parts_says_so_and_which_parts_a_rank_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(parts.read_parts, "__defaults__", (tmp_path,))
    monkeypatch.setattr("sys.argv", ["suite", "page", "--page", str(tmp_path / "page.md")])
    assert command.main() == 0
    text = " ".join((tmp_path / "page.md").read_text().split())
    assert "No part of the suite has been made yet" in text and "Numbers of hearts" not in text
    table = pd.DataFrame(plan()).groupby(["split", "species"])["part"].agg(["min", "max"])
    assert table.loc["develop"].to_numpy().tolist() == [[1, 2]] * 2 and "Parts 1 and 2 are the half develop" in text
    assert table.loc["test", "mouse"].tolist() == [3, 8] and "parts 3 to 8, the mice" in text
    assert table.loc["test", "human"].tolist() == [9, 10] and "parts 9 and 10, the people" in text
