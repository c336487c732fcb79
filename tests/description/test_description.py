"""Documents of a repository: the same bytes again, true, and honest about what is missing."""

import csv
import json
import re
import subprocess
from contextlib import chdir
from hashlib import sha256
from pathlib import Path
from shutil import copytree

import known_repository
import pytest
import yaml
from described_repository import REASON, SWEEP, given

from echotruth.repository import ledger
from echotruth.repository.check import check
from echotruth.repository.description import DescriptionError, attribution, describe

pytest.importorskip("mlcroissant")
pytest.importorskip("rocrate")
pytestmark = pytest.mark.slow

SCHEMA = Path(__file__).parent / "cff-1.2.0-schema.json"
"""Schema of the Citation File Format 1.2.0 (Druskat et al., CC BY 4.0, doi 10.5281/zenodo.5171937)."""
DOCUMENTS = ["clips.csv", "checksums.sha256", "README.md", "CITATION.cff", "croissant.json", "ro-crate-metadata.json"]


def contents(folder):
    return {name: (folder / name).read_bytes() for name in (*DOCUMENTS, "workflow/Snakefile")}


def card(folder):
    return (folder / "README.md").read_text()


def test_same_repository_gives_the_same_bytes(described, tmp_path):
    first = contents(described)
    describe(described, None, given())
    assert contents(described) == first
    copy = copytree(described, tmp_path / "small")  # keeps times
    for name in (*DOCUMENTS, "workflow/Snakefile"):
        (copy / name).unlink()
    describe(copy, None, given())
    assert contents(copy) == first


def test_checksums_are_those_of_all_files_of_the_store(described):
    listed = dict(line.split("  ")[::-1] for line in (described / "checksums.sha256").read_text().splitlines())
    files = {path for path in (described / "small.zarr").rglob("*") if path.is_file()}
    found = {path.relative_to(described).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}
    assert listed == found


def test_clips_have_the_grid_of_the_configuration(described):
    config = yaml.safe_load((described / "config.yaml").read_text())
    rows = list(csv.DictReader((described / "clips.csv").read_text().splitlines()))
    assert len(rows) == 2 * 2
    for row in rows:
        pixel = config["bmode"]["field_of_view_mm"] * 1e-3 / int(row["size_px"])
        assert float(row["pixel_axial_m"]) == pytest.approx(pixel, rel=1e-6)
        assert float(row["pixel_lateral_m"]) == pytest.approx(pixel, rel=1e-6)
        assert float(row["frame_time_s"]) == pytest.approx(60 / 500 / 3, rel=1e-6)  # of the mouse's 500 beats/min


def test_characters_that_mean_something_else_in_tables_and_in_latex_are_escaped(finished, tmp_path):
    describe(finished, tmp_path, attribution(["Doe|Roe, Jane", "Heart & Lung_1"], None, None, "1.0.0", None))
    assert "| authors | Jane Doe\\|Roe, Heart & Lung_1 |" in card(tmp_path)
    assert r"author = {Doe|Roe, Jane and {Heart \& Lung\_1}}" in card(tmp_path)


def test_documents_leave_the_repository_whole(described):
    assert not check(described).faults


def test_citation_is_of_its_schema(described, unfinished):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(SCHEMA.read_text())
    for folder in (described, unfinished, Path(__file__).parents[2]):
        texts = yaml.load((folder / "CITATION.cff").read_text(), yaml.BaseLoader)  # dates as text
        jsonschema.validate(texts, schema, format_checker=jsonschema.FormatChecker())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(texts | {"authors": []}, schema)


def test_citation_is_valid_to_its_converter(described, unfinished):
    cffconvert = pytest.importorskip("cffconvert")
    for folder in (described, unfinished):
        cffconvert.Citation((folder / "CITATION.cff").read_text()).validate()


def test_citation_names_authors_licence_and_release(described):
    citation = yaml.safe_load((described / "CITATION.cff").read_text())
    person, group = citation["authors"]
    assert (person["family-names"], person["orcid"]) == ("Doe", "https://orcid.org/0000-0002-1825-0097")
    assert group == {"name": "The Heart Group", "website": "https://example.org"}
    assert (citation["license"], citation["version"], citation["type"]) == ("CC-BY-4.0", "1.2.0", "dataset")
    assert citation["date-released"].isoformat() == "2023-11-14"


def test_card_says_what_was_swept_and_of_what_size_it_is(described):
    text = card(described)
    for key, values in SWEEP.items():
        assert re.search(rf"\| `{re.escape(key)}` \| \w* ?\| {', '.join(map(str, values))} \|", text), key
    total = sum(path.stat().st_size for path in (described / "small.zarr").rglob("*") if path.is_file())
    assert f"{total / 1e3:.1f} kB in " in text
    assert sha256((described / "checksums.sha256").read_bytes()).hexdigest() in text
    assert "Hearts: 2 complete." in text and "not finished" not in text


def test_card_has_a_unit_for_every_array(described):
    root = json.loads((described / "small.zarr/zarr.json").read_text())["consolidated_metadata"]["metadata"]
    units = {path: node["attributes"]["units"] for path, node in root.items() if node["node_type"] == "array"}
    for path in ("mechanics/pressure", "mechanics/displacement", "truth/64/strain", "bmode/64/image"):
        assert re.search(
            rf"\| `{path.split('/')[-1]}` \|[^|]*\|[^|]*\| {re.escape(units[path])} \|", card(described)
        ), path


def test_example_of_the_card_reads_a_clip_in_five_lines(tmp_path):
    folder = known_repository.make(tmp_path / "known", known_repository.SETTINGS).folder
    describe(folder)
    (code,) = re.findall(r"```python\n(.*?)```", card(folder), flags=re.S)
    assert len([line for line in code.splitlines() if line]) <= 5
    names: dict = {}
    with chdir(tmp_path):
        exec(code, names)
    assert names["clip"]["image"].shape == (known_repository.FRAMES, 128, 128)
    assert names["repository"].tree["bmode/128"]["image"].shape[2:] == names["clip"]["image"].shape


def test_card_tells_of_hearts_that_failed_or_were_not_finished(unfinished):
    text = card(unfinished)
    assert "1 complete, 1 failed, 1 unfinished." in text and "is not finished: " in text
    assert REASON.replace("|", "\\|") in text
    assert re.search(r"one on \S+ mid, 64 px: it ended with status 3", text)


def test_nothing_is_licensed_unless_it_is_said(unfinished):
    assert "all rights are reserved" in card(unfinished)
    assert not {"license", "license-url"} & yaml.safe_load((unfinished / "CITATION.cff").read_text()).keys()


def test_hearts_from_files_are_told_with_their_sources(finished, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config["loop"]["file"] = "measured_loop.csv"
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    describe(folder)
    assert "- `measured_loop.csv`" in card(folder)
    assert "measured_loop.csv" in json.loads((folder / "croissant.json").read_text())["prov:wasDerivedFrom"]


def test_readme_of_somebody_else_is_spared(finished, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    (folder / "README.md").write_text("mine\n")
    with pytest.raises(DescriptionError, match=r"README\.md: was not made by echotruth describe"):
        describe(folder)
    assert (folder / "README.md").read_text() == "mine\n" and not (folder / "clips.csv").exists()


def damage_record(folder: Path) -> str:
    path = next((folder / "ledger").rglob("mechanics/*.json"))
    path.write_text("{")
    return path.name


def lose_file(folder: Path) -> str:
    record = ledger.read(next((folder / "ledger").rglob("bmode/*/*/*.json")))
    name = next(iter(record["sha256"]))
    (folder / "small.zarr" / name).unlink()
    return name


def damage_root(folder: Path) -> str:
    (folder / "small.zarr/zarr.json").write_text("[]")
    return "zarr.json"


def damage_times(folder: Path) -> str:
    path = next(path for path in (folder / "small.zarr/bmode/64/time/c").rglob("*") if path.is_file())
    path.write_bytes(b"x")
    return "bmode/64/time"


@pytest.mark.parametrize(
    "damage", [damage_record, lose_file, damage_root, damage_times], ids=lambda each: each.__name__
)
def test_damage_is_told_in_one_sentence_and_nothing_is_written(finished, tmp_path, damage):
    folder = copytree(finished, tmp_path / "small")
    name = damage(folder)
    with pytest.raises(DescriptionError, match=rf"{re.escape(name)}: is missing or damaged: echotruth check .* --heal"):
        describe(folder)
    assert not any((folder / document).exists() for document in DOCUMENTS)


def test_repository_without_a_result_is_refused(finished, tmp_path):
    folder = copytree(finished, tmp_path / "small")
    for path in (folder / "ledger").rglob("*/*.json"):
        path.unlink()
    with pytest.raises(DescriptionError, match="has no result yet: run its configuration first"):
        describe(folder)


def test_command_prints_what_it_wrote_or_one_sentence(finished, tmp_path, capsys, monkeypatch):
    from echotruth.cli import main

    for arguments, status in (([finished, "-o", tmp_path / "documents"], 0), ([tmp_path], 2)):
        monkeypatch.setattr("sys.argv", ["echotruth", "describe", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert (ended.value.code or 0) == status
    said = capsys.readouterr()
    assert f"{tmp_path / 'documents' / 'README.md'}\n" in said.out
    assert said.err.count("\n") == 1 and "is not a repository" in said.err


def test_checksums_are_read_by_sha256sum(described):
    command = ["sha256sum", "--check", "--quiet", "checksums.sha256"]
    assert subprocess.run(command, cwd=described, check=False, capture_output=True).returncode == 0
