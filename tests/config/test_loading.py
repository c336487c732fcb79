"""An invalid configuration is refused in one sentence with file, key, value and remedy."""

import os
from pathlib import Path

import pytest

from echotruth.cases import expand
from echotruth.config import Config, Mechanics
from echotruth.config.building import configure
from echotruth.config.loading import ConfigError, beside, load, override
from echotruth.materials import LAWS
from echotruth.workflow.plan import as_yaml

ROOT = Path(__file__).parents[2]

BAD = {
    "geometry: {base_mm: 6}": "geometry.base_mm = 6.0: must lie within +-endo_length_mm = 5.4",
    "geometry: {remesh: true}": "geometry.remesh = true: applies to a wall read from a file: give geometry.file",
    "geometry: {file: a.vtu, wall_mm: 1}": "geometry.wall_mm = 1.0: applies to the ellipsoid: leave it out",
    "geometry: {file: a.vtu, dilation: 2}": "geometry.dilation = 2.0: needs remesh: true",
    "geometry: {file: a.vtu, sheet: s}": "geometry.sheet = 's': needs the fibre directions too",
    "geometry: {file: a.vtu, wall_cells: {values: [1]}}": "geometry.wall_cells.array is missing",
    "loop: {esv_uL: 60, edv_uL: 50}": "loop.esv_uL = 60.0: must be smaller than edv_uL = 50.0",
    "loop: {beats: [{}, {}], kind: circulation}": "loop.kind = 'circulation': must be measured with loop.beats",
    "loop: {beats: [{}, {}], prescribed: pressure}": "loop.prescribed = 'pressure': must be pressure_volume with",
    "loop: {beats: []}": "loop.beats = []: must have 1 to 16 beats",
    "loop: {beats: [{length: 0}]}": "loop.beats.0.length = 0: should be greater than or equal to 0.05",
    "loop: {beats: [{}, {}], frames: 3}": "loop.frames = 3: leaves 1 to one of the loop.beats, which need two each",
    "{loop: {beats: [{}, {}]}, motion: {kind: rigid}}": "motion.kind = 'rigid': must be beat with loop.beats",
    "{loop: {beats: [{}, {}]}, inference: {tracker: bspline_dic}}": "inference.tracker = 'bspline_dic': needs a loop",
    "{loop: {beats: [{}, {}]}, tracking: {trackers: {one: {method: bspline_cnn}}}}": ".method = 'bspline_cnn': knows",
    "{loop: {beats: [{}, {}], frames: 8}, tracking: {frame_step: 4}}": "smaller than the 4 frames of the shortest beat",
    "fibres: {endo_deg: 95}": "fibres.endo_deg = 95: should be less than or equal to 90",
    "fibres: {endo_deg: high}": "fibres.endo_deg = 'high': must be a number",
    "loop: {frames: '40'}": "loop.frames = '40': must be a whole number",
    "name: 1e5": "name = 100000.0: must be text: put it in quotes",
    "name: mine.zarr": "name = 'mine.zarr': must not end in .zarr, as the store does, which is out/NAME/",
    "physiology: {exclude_implausible: 'true'}": "must be true or false",
    "rf: {keep: channels}": "rf.keep = 'channels': must be a list, such as [1, 2]",
    "cases: {draw: {number: 2, keys: {seed: [1, 9]}}}": "cases.draw.keys.seed = [1, 9]: must be a distribution, such",
    "geometri: {}": "geometri is not a key: did you mean geometry?",
    "frames: 20": "frames is not a key: did you mean loop.frames or motion.file.frames?",
    "tracking: {window_px: 32}": "window_px is not a key: did you mean tracking.trackers.NAME.window_px?",
    "views: {preset: {position: 0.4}, mid: {}}": "views.preset = {'position': 0.4}: must be one of paper, echo",
    "views: {all: {position: 0.4}}": "views = 'all': is the name of the mean over all views in the lead",
    "bmode: {downsampling: [1, 3]}": "bmode.downsampling = [1, 3]: every entry must divide size_px = 512",
    "tracking: {trackers: {wide: {window_px: 256}}}": "window_px = 256: must not exceed the smallest image, 128 px",
    "tracking: {trackers: {both: {window_mm: 1.0}}}": "give either window_px or window_mm",
    "tracking: {trackers: {dis: {method: dis, presett: fast}}}": "tracking.trackers.dis.presett is not a key of the "
    "method dis (others: phase_correlation, ",
    "tracking: {trackers: {one: {method: bspline_dic, knots_mm: 1000}}}": "knots_mm = 1000.0: must not exceed bmode",
    "tracking: {grid_px: 5}": "tracking.grid_px is not a key: write tracking.grid, over the side of the image: 0.01",
    "tracking: {grid: 5}": "tracking.grid = 5: should be less than or equal to 0.25",
    "views: {c: {}}": "views = 'c': is the name of a file or folder of Zarr: choose another",
    "rf: {focus_mm: 12}": "rf.focus_mm = 12.0: must be smaller than bmode.field_of_view_mm = 12",
    "rf: {focus_mm: 10}": "rf.focus_mm = 10.0: must be smaller than 10, so that its focal_zones = 5 foci, "
    "focal_spacing_mm = 1 apart",
    "rf: {focal_spacing_mm: 4}": "rf.focus_mm = 6.5: must exceed 8, so that its focal_zones = 5 foci, "
    "focal_spacing_mm = 4 apart, lie in front",
    "rf: {scan: linear, width_mm: 3.0}": "rf.width_mm = 3.0: must not exceed 2.944, the length of the array",
    "mechanics: {material: {law: fungi}}": "mechanics.material.law = 'fungi': should be 'fung', 'guccione', ",
    "mechanics: {material: {fiber: 9}}": "fiber is not a key of the law fung (others: guccione, holzapfel_ogden, "
    "neo_hooke): did you mean mechanics.material.fibre?",
    "views: {a b: {}}": "views: the name 'a b': use letters, digits and underscores only, and begin with a letter",
    "tracking: {trackers: {c: {}}}": "tracking.trackers = 'c': is the name of a file or folder of Zarr: choose",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: text.replace(" ", ""))
def test_refused_in_one_sentence(refusal, text):
    assert BAD[text] in refusal(text)


def test_frequency_above_nyquist_is_refused_with_the_rate_it_needs(tmp_path):
    file = tmp_path / "bad.yaml"
    file.write_text("probe: {frequency_MHz: 60, sampling_MHz: 100}")
    with pytest.raises(ConfigError, match=r"above the Nyquist frequency of sampling_MHz = 100.*180 MHz"):
        load(file)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: cannot be read"):
        load(tmp_path / "nowhere.yaml")


@pytest.mark.parametrize("name", ["demo", "fimh25", "hearts", "paper", "realistic", "rodero", "sweep"])
def test_shipped_configurations_are_accepted_in_every_folder(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load(ROOT / f"config/{name}.yaml").name == name
    assert configure(name).name == name


def test_table_is_that_beside_the_configuration_and_not_that_of_the_working_folder(tmp_path, monkeypatch):
    study, elsewhere = tmp_path / "study", tmp_path / "else"
    for folder in (study, study / "tables", elsewhere):
        folder.mkdir()
        (folder / "hearts.csv").write_text(f"case,note\na,{folder.name}\n")
    names = {"mine": "hearts.csv", "below": "tables/hearts.csv", "above": "../else/hearts.csv"}
    for name, table in (names | {"absolute": str(study / "hearts.csv")}).items():
        (study / f"{name}.yaml").write_text(f"cases: {{file: {table}}}")
    notes = {"mine": "study", "below": "tables", "above": "else", "absolute": "study"}
    for folder in (elsewhere, study):
        monkeypatch.chdir(folder)
        for name, note in notes.items():
            path = study / f"{name}.yaml"
            for given in (path, os.path.relpath(path)):
                assert expand(load(given))[0].note == expand(str(given))[0].note == note
        assert expand({"cases": {"file": "hearts.csv"}})[0].note == folder.name  # no file names it


def test_table_of_several_files_is_beside_the_last_that_names_it(tmp_path):
    for name, text in (("a", "cases: {file: x.csv}"), ("b", "cases: {file: x.csv}"), ("c", "seed: 2"), ("d", "")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "my.yaml").write_text(text)
    files = [tmp_path / name / "my.yaml" for name in "abcd"]
    merged = {"seed": 2, "cases": {"file": "x.csv", "seed": [1, 2]}}
    assert beside(merged, *files) == merged | {"cases": {"file": str(tmp_path / "b/x.csv"), "seed": [1, 2]}}
    for cases in ({"file": "y.csv"}, {"file": 1}, {"seed": [1, 2]}, None):
        other = {"cases": cases}
        assert beside(other, *files) == other


@pytest.mark.parametrize("text", ["1e-6", "1E-06", "+1e-6", "1.0e-06", "0.000001"])
def test_small_numbers_are_numbers_however_they_are_written(tmp_path, text):
    (tmp_path / "small.yaml").write_text(f"mechanics: {{viscosity_Pa_s: {text}}}")
    assert load(tmp_path / "small.yaml").mechanics.viscosity_Pa_s == 1e-6


def test_text_that_looks_like_a_number_stays_one(tmp_path):
    (tmp_path / "named.yaml").write_text("name: '1e5'")
    (tmp_path / "again.yaml").write_text(as_yaml(load(tmp_path / "named.yaml")))
    assert load(tmp_path / "again.yaml").name == "1e5"


def test_dumped_configuration_reads_back_the_same(tmp_path):
    import yaml

    config = Config(seed=3)
    file = tmp_path / "again.yaml"
    file.write_text(yaml.safe_dump(config.model_dump(mode="json")))
    assert load(file) == config


def test_law_that_is_swept_takes_its_own_moduli_and_keeps_the_stiffness():
    config = Config(mechanics=Mechanics(material=LAWS["fung"].Law(stiffness_kPa=2.0, fibre=12.0)))
    changes = {"mechanics.material.fibre": 7.0, "mechanics.material.law": "guccione"}
    material = override(config, changes).mechanics.material
    assert material == LAWS["guccione"].Law(stiffness_kPa=2.0, fibre=7.0)
