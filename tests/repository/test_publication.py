"""Publication: the table of the cases with what became of them, the metadata of the folders, and the checksums."""

import re
from contextlib import chdir

import pandas as pd
import pytest
import xarray as xr
from finished_repository import blank, configured, content, finish, remake

import echotruth as et
from echotruth.cases import expand, table
from echotruth.config import Physiology
from echotruth.repository.publication import CHECKSUMS, checksum
from echotruth.workflow.failure import CaseFailed

SWEEP = {"table": 'case,fibres.endo_deg,label.group,note\none,60,sham,"first, of ""three"""\ntwo,65,,\nthree,70,MI,\n'}
CONFIG = configured(views=("mid",), cases=SWEEP)
LENGTHENS = "the mean longitudinal strain at end-systole is 0.04 and must be at most 0"


def result(job):
    """The second heart lengthens, the third has no solution."""
    if job.case.id == "three":
        raise CaseFailed("no equilibrium at frame 3")
    found = blank(job)
    if job.stage == "mechanics" and job.case.id == "two":
        job.notes["bounded"] = {"longitudinal_strain_max": 0.04}
    return found


def changed(**sections):
    return CONFIG.model_copy(update=sections)


def test_table_has_a_row_a_case_with_its_heart_what_became_of_it_labels_and_keys(done):
    found = pd.read_csv(done / "cases.csv", keep_default_na=False, dtype=str).set_index("case")
    assert list(found["status"]) == ["complete", "implausible", "failed"]
    assert found["reason"].iloc[0] == "" and found["reason"].iloc[1].startswith(LENGTHENS)
    assert found["reason"].iloc[2] == "no equilibrium at frame 3"
    assert list(found["heart"]) == [case.heart for case in expand(CONFIG)]
    assert list(found["label.group"]) == ["sham", "", "MI"] and found["note"].iloc[0] == 'first, of "three"'
    assert set(found.columns) == {*table(expand(CONFIG)).columns, "status", "reason", "heart"} - {"case"}


def test_checksums_are_of_every_file_of_the_store_and_of_those_that_describe_it(done):
    lines = (done / CHECKSUMS).read_text().splitlines()
    listed = {name: hash for hash, name in (line.split("  ", 1) for line in lines)}
    files = [path for path in (done / "small.zarr").rglob("*") if path.is_file()]
    files += [done / "cases.csv", done / "config.yaml"]
    assert listed == {path.relative_to(done).as_posix(): checksum(path) for path in files}


def test_store_opens_as_a_tree_from_its_root_and_from_each_heart_and_clip(done):
    tree = et.Repository(done).tree
    assert set(tree["hearts"].children) == {case.heart for case in expand(CONFIG)}
    assert {"title", "summary", "references", "config", "seed", "packages"} <= set(tree.attrs)
    with xr.open_datatree(done / "small.zarr/clips/one/mid", engine="zarr", consolidated=True) as clip:
        assert clip.attrs == {"case": "one", "view": "mid", "heart": expand(CONFIG)[0].heart}
        assert clip["bmode/64/image"].dims == ("frame", "axial", "lateral")
    assert not tree["clips/three/mid"]["rf"].variables


@pytest.mark.parametrize("case", ["two", "three"])
def test_groups_of_a_heart_that_is_not_imaged_say_skipped_and_why(done, case):
    repository = et.Repository(done)
    for name in ("phantom", "rf", "truth/64", "bmode/64", "points", "tracking/one"):
        found = repository.attributes(name, case, "mid")
        assert found["status"] == "skipped" and found["reason"] == repository.cases.loc[case, "reason"], name
    assert repository.attributes("heart", "three")["status"] == "failed"
    assert repository.arrays("mechanics", "two")["displacement"].size, "an implausible heart keeps its arrays"
    assert repository.shown == ["one"]


def test_a_wider_bound_images_what_it_decides_otherwise_and_nothing_else(folder):
    before = content(folder)
    made = remake(folder, changed(physiology=Physiology(longitudinal_strain_max=0.1)), result)
    stages = ["phantom two mid", "rf two mid", "truth two mid", "bmode two mid", "points two mid"]
    stages.append("tracking two mid one")
    assert made == [*stages, "repository"]
    after = content(folder)
    kept = [name for name in before if name.startswith(("small.zarr/hearts", "small.zarr/clips/one"))]
    assert kept and all(after[name] == before[name] for name in kept)
    assert list(et.Repository(folder).cases["status"]) == ["complete", "complete", "failed"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("swept", "statuses"),
    [
        ({"pathology.infarct.segments": [[7, 8]]}, ["complete"]),  # in all hearts, and not in the configuration itself
        ({"mechanics.regional.contractility": [{}, {7: 0.1}]}, ["implausible", "complete"]),  # in no column
    ],
)
def test_reader_judges_each_heart_by_its_own_findings(tmp_path, swept, statuses):
    def congested(job):
        found = blank(job)
        job.notes["bounded"] = {"edp_max_mmHg": 20.0}
        return found

    finish(tmp_path, configured(views=("mid",), cases=swept), congested)
    assert list(et.Repository(tmp_path).cases["status"]) == statuses


def test_implausible_hearts_are_imaged_if_the_configuration_says_so(folder):
    made = remake(folder, changed(physiology=Physiology(exclude_implausible=False)), result)
    assert len(made) == 7 and all(" two " in name for name in made[:-1])
    assert list(et.Repository(folder).cases["status"]) == ["complete", "implausible", "failed"]


def test_bound_that_decides_nothing_otherwise_changes_the_configuration_and_makes_nothing(folder):
    assert remake(folder, changed(physiology=Physiology(twist_max_deg=89.0)), result) == ["repository"]
    assert remake(folder, changed(physiology=Physiology(twist_max_deg=89.0)), result) == []


def test_label_that_changes_is_published_and_makes_nothing(folder):
    other = changed(cases=CONFIG.cases.model_copy(update={"table": SWEEP["table"].replace("sham", "control")}))
    assert remake(folder, other, result) == ["repository"]
    assert list(et.Repository(folder).cases["label.group"]) == ["control", "", "MI"]


def test_case_that_leaves_the_configuration_is_not_listed_and_returns_without_a_job(folder):
    before = content(folder)
    fewer = SWEEP["table"].replace("two,65,,\n", "")
    assert remake(folder, changed(cases=CONFIG.cases.model_copy(update={"table": fewer})), result) == ["repository"]
    assert list(et.Repository(folder).cases.index) == ["one", "three"]
    assert remake(folder, CONFIG, result) == ["repository"] and content(folder) == before


def test_publishing_again_gives_the_same_bytes(folder):
    before = content(folder)
    (folder / CHECKSUMS).unlink()
    assert remake(folder, CONFIG, result) == ["repository"] and content(folder) == before


def test_configuration_of_the_repository_has_the_lines_of_the_table_and_makes_it_again(done, tmp_path):
    text = (done / "config.yaml").read_text()
    assert re.search(r"table: \|\n    case,fibres.endo_deg,label.group,note\n    one,60,sham,\"first", text)
    with chdir(tmp_path):
        assert et.Repository(done).config == CONFIG


def test_table_that_is_damaged_is_refused_in_a_sentence(folder):
    (folder / "cases.csv").write_text("heart\n\x00")
    with pytest.raises(FileNotFoundError, match=r"cases.csv is damaged: run the configuration again, which writes it$"):
        et.Repository(folder).cases  # noqa: B018 - it is read
    assert remake(folder, CONFIG, result) == ["repository"]
