"""Hearts from a table: a row a heart, a column a key, under ids that stay."""

import itertools
import random
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from echotruth.cases import expand, find_case, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError, load, override, validate
from echotruth.config.table import MAX_BYTES, MAX_CASES, MAX_COLUMNS
from echotruth.loop.cycle import SHIPPED
from echotruth.section import value_of
from echotruth.seeds import generator

TABLE = """\
case,fibres.endo_deg,pathology.infarct.segments,seed,label.group,label.age_weeks,note
m1,60,"[7, 8]",3,sham,12,"first, of two"
,72.5,,,MI,,
m3,,null,,sham,14.5,
"""


def test_each_row_is_a_heart_with_the_values_of_its_cells(hearts):
    first, second, third = hearts(TABLE)
    assert [case.parameters for case in (first, second, third)] == [
        {"fibres.endo_deg": 60, "pathology.infarct.segments": [7, 8], "seed": 3},
        {"fibres.endo_deg": 72.5},
        {"pathology.infarct.segments": None},
    ]
    for case in (first, second, third):
        assert case.config.model_dump() == override(Config(), case.parameters).model_dump()
    assert [case.labels for case in (first, third)] == [
        {"group": "sham", "age_weeks": 12},
        {"group": "sham", "age_weeks": 14.5},
    ]
    assert (first.note, second.note) == ("first, of two", "")


def test_ids_are_those_of_the_column_or_else_those_of_the_same_heart_in_a_grid(hearts):
    grid = expand(Config(cases={"fibres.endo_deg": [72.5]}))
    assert [case.id for case in hearts(TABLE)] == ["m1", grid[0].id, "m3"]


def test_rows_and_columns_in_another_order_are_the_same_hearts(hearts):
    header, *rows = TABLE.splitlines()
    before = {case.id: (case.config, case.labels) for case in hearts(TABLE)}
    for order in itertools.permutations(rows):
        assert {case.id: (case.config, case.labels) for case in hearts("\n".join([header, *order]))} == before
    columns = pd.read_csv("hearts.csv", dtype=str, keep_default_na=False)
    shuffled = columns[random.Random(1).sample(list(columns), len(list(columns)))].to_csv(index=False)
    assert {case.id: (case.config, case.labels) for case in hearts(shuffled)} == before


def test_rows_that_are_added_change_neither_ids_nor_random_numbers_of_those_that_were_there(hearts):
    before, after = hearts(TABLE), hearts(TABLE.replace("m3,", "new,61,,,,,\n,62,,,,,\nm3,"))
    assert len(after) == 5
    kept = {case.id: case for case in after}
    for case in before:
        assert kept[case.id].config == case.config
        numbers = [generator(one, "mid", "rf").random(4) for one in (case, kept[case.id])]
        assert np.array_equal(*numbers)


def test_column_that_is_added_empty_or_at_the_present_value_renames_no_heart(hearts):
    present = Config().fibres.epi_deg
    added = "\n".join(
        f"{line},{cell}" for line, cell in zip(TABLE.splitlines(), ["fibres.epi_deg", "", present, ""], strict=True)
    )
    assert [case.id for case in hearts(added)] == [case.id for case in hearts(TABLE)]


POSES = """\
case,views.mid.position,views.mid.tilt_deg,views.long_axis.rotation_deg,tracking.frame_step
plain,,,,
basal,0.2,,,
oblique,,12,30,
slow,,,,2
"""


def test_poses_of_views_and_the_frame_rate_of_trackers_differ_between_rows(hearts):
    plain, basal, oblique, slow = hearts(POSES)
    for case in (plain, basal, oblique, slow):
        assert case.config.model_dump() == override(Config(), case.parameters).model_dump()
    assert [case.config.views["mid"].position for case in (plain, basal)] == [0.5, 0.2]
    assert (oblique.config.views["mid"].tilt_deg, oblique.config.views["long_axis"].rotation_deg) == (12, 30)
    assert [case.config.tracking.frame_step for case in (plain, slow)] == [1, 2]
    columns = table([plain, basal, oblique, slow])
    assert list(columns["views.mid.tilt_deg"]) == [0, 0, 12, 0]
    assert list(columns["tracking.frame_step"]) == [1, 1, 1, 2]


def test_angle_offset_and_motion_of_a_probe_differ_between_rows(hearts):
    values = {"angle_deg": 10, "offset.lateral_mm": 1.5, "motion.drift.axial_mm": -0.2, "motion.rocking_deg": 3}
    keys = [f"views.mid.{name}" for name in values]
    plain, moved = hearts(f"case,{','.join(keys)}\nplain,,,,\nmoved,{','.join(map(str, values.values()))}\n")
    assert plain.config.views["mid"] == Config().views["mid"] and plain.heart == moved.heart
    assert [value_of(moved.config, key) for key in keys] == list(values.values())
    columns = table([plain, moved])
    assert [list(columns[key]) for key in keys] == [[0, value] for value in values.values()]


def test_row_at_the_pose_of_the_configuration_has_the_id_of_the_heart_without_one(hearts):
    (there,) = hearts("views.mid.position,tracking.frame_step\n0.5,1\n")
    (moved,) = hearts("views.mid.position,tracking.frame_step\n0.4,1\n")
    assert there.id == "heart" and moved.id.startswith("position0.4_")


def test_views_themselves_and_the_trackers_are_the_same_in_all_rows(refusal):
    assert "views.mid.plane cannot be swept" in refusal("views.mid.plane\nlong_axis\n")
    assert "tracking.grid cannot be swept" in refusal("tracking.grid\n0.02\n")
    assert "tracking.trackers.dis.preset cannot be swept" in refusal("tracking.trackers.dis.preset\nfast\n")
    assert "did you mean views.mid.position?" in refusal("views.middle.position\n0.3\n")
    assert "row 1: views.mid.position = 3" in refusal("views.mid.position\n3\n")


def test_factors_of_segments_stand_in_a_cell_as_json(hearts):
    (weak,) = hearts('case,mechanics.regional.contractility\na,"{""11"": 0.6, ""12"": 0.45}"\n')
    assert weak.config.mechanics.regional.contractility == {11: 0.6, 12: 0.45}


def test_mesh_and_loop_of_a_row_stay_together(hearts, tmp_path):
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text((SHIPPED / "mouse.csv").read_text())
        (tmp_path / f"{name}.stl").write_text("")
    rows = "case,geometry.file,geometry.remesh,loop.file\np,a.stl,true,a.csv\nq,b.stl,true,b.csv\nhealthy,,,\n"
    cases = hearts(rows)
    pairs = [(case.config.geometry.file, case.config.loop.file) for case in cases]
    assert pairs == [("a.stl", "a.csv"), ("b.stl", "b.csv"), (None, "mouse")]


def test_table_grid_and_draws_multiply_and_ids_of_rows_are_continued(hearts):
    cases = "seed: [1, 2], draw: {number: 3, keys: {fibres.epi_deg: {uniform: [-46, -38]}}}"
    found = hearts(TABLE.replace(",seed,", ",fibres.disarray_deg,"), cases=cases)
    assert len({case.id for case in found}) == 3 * 2 * 3
    assert sum(case.id.startswith("m1_epi-") for case in found) == 6
    assert {case.parameters["seed"] for case in found if case.labels["group"] == "MI"} == {1, 2}


def test_id_of_a_row_is_continued_only_by_what_differs(hearts):
    ids = [case.id for case in hearts("case,fibres.endo_deg\nm1,60\n", cases="seed: [1, 2]")]
    assert ids[0] == "m1" and ids[1].startswith("m1_seed2_")
    assert [find_case(validate({"cases": {"file": "hearts.csv", "seed": [1, 2]}}, "x"), id).id for id in ids] == ids


@pytest.mark.parametrize(
    ("column", "cell", "value"),
    [
        ("loop.file", "human", "human"),
        ("seed", "2.0", 2),
        ("fibres.endo_deg", "6e1", 60.0),
        ("fibres.endo_deg", " 60 ", 60),
        ("physiology.exclude_implausible", "FALSE", False),
        ("geometry.wall_mm", "null", None),
    ],
)
def test_cell_is_read_as_what_its_key_takes(hearts, column, cell, value):
    (case,) = hearts(f"case,{column}\none,{cell}\n")
    found = case.parameters[column]
    assert found == value and type(found) is type(value)


def test_text_of_digits_stays_text_for_a_key_that_takes_text(hearts, tmp_path):
    (tmp_path / "007").write_text((SHIPPED / "mouse.csv").read_text())
    assert hearts("loop.file\n007\n")[0].config.loop.file == "007"


REFUSED = {
    "case,fibres.endo_deg\na,60\nb,95\n": "hearts.csv, row 2: fibres.endo_deg = 95: should be less than or equal to 90",
    "case,fibres.endo\na,60\n": "hearts.csv, column 'fibres.endo': fibres.endo is not a key: did you mean",
    "case,age\na,60\n": "column 'age': age is not a key: write label.age if it is a label",
    "case,label.my age\na,60\n": "column 'label.my age': name it label.",
    "case,fibres\na,60\n": "column 'fibres': fibres is a section",
    "case,seed\na b,1\n": "row 1: case = 'a b': use at most 80 letters",
    "case,seed\nzarr.json,1\n": "row 1: case = zarr.json: is the name of a file or folder of Zarr: choose another",
    "case,seed\na,1\n\nb,2\na,3\n": "row 4: case = a is the id of row 1 too",
    "case,seed\na,1\nA,2\n": "row 1 and hearts.csv, row 2 have ids that differ in capitals alone",
    "seed,label.x\n2,a\n2,b\n": "row 1 and hearts.csv, row 2 are the same heart, seed2_b105c5: leave one",
    "case,seed\na,1.5\n": "row 1: seed = 1.5: must be a whole number",
    "case,seed\na,1,2\n": "(Expected 2 fields in line 2, saw 3)",
    "case,seed\na\n": "row 1 has 1 cells and not 2",
    "case;seed\na;1\n": "separated by semicolons: separate them by commas",
    "case,seed,seed\na,1,2\n": "column 'seed' is given twice",
    "case,seed\n": "has no rows",
    'case,note\na,"b\n': "is not a table of comma-separated values",
    "case,pathology.infarct.segments\na,[7\n": "row 1: pathology.infarct.segments = '[7': must be a list",
    "case,loop.file\na,mouse\nb,none.csv\n": "hearts.csv, row 2: loop: none.csv: there is no file ",
    "case,geometry.file,geometry.remesh\na,a.stl,true\n": "row 1: geometry.file = 'a.stl': there is no file",
    "case,loop.edv_uL,loop.esv_uL\na,50,20\nb,20,50\n": "row 2: loop.esv_uL = 50.0: must be smaller than edv_uL",
    f"case,note\na,{'x' * 4001}\n": "row 1, column note: has 4001 characters: write at most 4000",
    f"case,{','.join(f'label.a{i}' for i in range(MAX_COLUMNS))}\n": "has 257 columns",
    f"seed\n{'1' * MAX_BYTES}\n": "holds 2.0 MiB, and a table at most 2 MiB",
    "seed\n" + "1\n" * (MAX_CASES + 1): "has more than 100000 rows",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: repr(text[:40]))
def test_table_that_cannot_be_run_is_refused_with_file_row_and_column(refusal, text):
    sentence = refusal(text)
    assert sentence.startswith("my.yaml: ") and "hearts.csv" in sentence
    assert REFUSED[text] in sentence


def test_mesh_of_a_row_without_a_new_mesh_of_the_same_size_is_refused(refusal, tmp_path):
    (tmp_path / "a.vtu").write_text("")
    assert "row 1: the meshes may differ in size: set geometry.remesh: true" in refusal("geometry.file\na.vtu\n")


def test_key_in_two_places_is_refused(refusal):
    assert "seed is swept by hearts.csv, column 'seed' too" in refusal("seed\n1\n", "", "seed: [1, 2]")


@pytest.mark.parametrize("name", ["absent.csv", ".", "/dev/zero"])
def test_file_that_is_no_table_is_refused(name):
    with pytest.raises(ConfigError, match=f"cases.file = '{name}': .*give the path of a CSV file"):
        validate({"cases": {"file": name}}, "my.yaml")


def test_text_that_is_not_unicode_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_bytes("case,note\na,é\n".encode("latin-1"))
    with pytest.raises(ConfigError, match="is not UTF-8 text: give the path of a CSV file"):
        validate({"cases": {"file": "a.csv"}}, "my.yaml")
    (tmp_path / "a.csv").write_text("case,note\na,é\n", encoding="utf-8-sig")
    assert expand(validate({"cases": {"file": "a.csv"}}, "my.yaml"))[0].note == "é"


def test_configuration_holds_the_rows_and_not_the_path(hearts, tmp_path):
    cases = hearts(TABLE)
    config = validate({"cases": {"file": "hearts.csv"}}, "my.yaml")
    (tmp_path / "hearts.csv").unlink()
    again = validate(config.model_dump(mode="json"), "again")
    assert "hearts.csv" not in again.model_dump_json()
    assert [(case.id, case.config, case.labels) for case in expand(again)] == [
        (case.id, case.config, case.labels) for case in cases
    ]


def test_table_of_cases_has_labels_and_notes(hearts):
    frame = table(hearts(TABLE)).set_index("case")
    assert list(frame.columns[:5]) == ["seed", "diagnosis", "label.group", "label.age_weeks", "note"]
    assert list(frame["label.group"]) == ["sham", "MI", "sham"]
    np.testing.assert_array_equal(frame["label.age_weeks"], [12, np.nan, 14.5])
    assert list(frame["diagnosis"]) == ["infarct", "healthy", "healthy"]
    assert "note" not in table(expand(Config()))
    assert "label.empty" not in table(hearts("case,label.empty\na,\n"))


BEATS = {"loop.kind": "circulation"}


def test_blocks_of_the_page_are_valid(tmp_path, monkeypatch):
    page = (Path(__file__).parents[2] / "docs/cases.md").read_text()
    settings, _ = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (meshes,) = re.findall(r"```\n(case,.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hearts.csv").write_text("case,seed\na,1\nb,2\n")
    (tmp_path / "my.yaml").write_text(settings)
    assert len(expand(load("my.yaml"), "my.yaml")) > 100
    for name in re.findall(r"\w+/\w+\.\w+", meshes):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text((SHIPPED / "human.csv").read_text())
    found = expand(Config(cases={"table": meshes}))
    assert [(case.id, case.labels["group"]) for case in found] == [("p01", "HCM"), ("p02", "control")]
