"""The suite: its hearts, the rows of a heart against those of a repository, and its parts."""

from collections import Counter
from hashlib import sha256

import numpy as np
import pandas as pd
import pytest

import echotruth as et
from benchmarks.suite import __main__ as command
from benchmarks.suite import columns, hearts, parts
from benchmarks.suite.hearts import SuiteCase, cases_of, plan
from benchmarks.suite.scores import view_rows
from echotruth.config.imaging import ViewMotion
from echotruth.repository.version import motion_hash

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
        assert config.bmode.sizes == (256, 128) and (config.loop.frames, config.loop.kind) == (20, "circulation")
        if sorts["species"] == "mouse":
            assert (realism.shadow.side != "none") == (variation == "shadow")
    plain = [one.sorts["variation"] for one in cases if one.sorts["acoustics"] == "realistic"]
    share = {name: count / len(plain) for name, count in Counter(plain).items()}
    assert share["motion"] == pytest.approx(0.25, abs=0.01) and share["shadow"] == pytest.approx(0.25, abs=0.01)


def test_ideal_case_has_the_motion_and_the_planes_of_the_realistic_one_and_no_drawn_condition(cases):
    ideal = {one.sorts["heart"]: one for one in cases if one.sorts["acoustics"] == "ideal"}
    real = {one.sorts["heart"]: one for one in cases if one.sorts["acoustics"] == "realistic"}
    assert len(ideal) >= 16 and len({motion_hash(one.case.config) for one in real.values()}) == len(real)
    for heart, one in ideal.items():
        config, other = one.case.config, real[heart].case.config
        assert motion_hash(config) == motion_hash(other) and config.views == other.views
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
    with pytest.raises(ValueError, match="its images are not those of the part"):
        parts.make_part(1, trackers=mine, say=lambda _: None)


def test_parts_of_other_code_are_refused(made, monkeypatch):
    other = [row | {"code": "d"} for row in rows_of({"heart": "mouse99"})]
    (made / "part-02.csv.gz").write_bytes(parts.packed(pd.DataFrame(other)))
    with pytest.raises(ValueError, match=r"part-02.* was made with other code than part-01"):
        parts.read_parts(made)


@pytest.mark.parametrize("arguments", [["part", "99"], ["part", "2", "--tracker", "nowhere.yaml"]])
def test_what_is_not_there_is_refused_in_one_line(made, monkeypatch, capsys, arguments):
    monkeypatch.setattr("sys.argv", ["suite", *arguments])
    assert command.main() == 2 and capsys.readouterr().err.count("\n") == 1
