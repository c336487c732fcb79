"""Wheel and sdist hold what they must, and the package works from the wheel in an empty folder."""

import os
import subprocess
import sys
import tarfile
import zipfile
from email import message_from_string
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]


pytestmark = pytest.mark.slow


def build(target: str, source: Path, folder: Path) -> Path:
    """Build an archive with the installed hatchling, without a network."""
    command = [sys.executable, "-m", "hatchling", "build", "--target", target, "--directory", str(folder)]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    return next(folder.glob("*.whl" if target == "wheel" else "*.tar.gz"))


@pytest.fixture(scope="module")
def sdist(tmp_path_factory) -> Path:
    """The unpacked sdist."""
    folder = tmp_path_factory.mktemp("sdist")
    with tarfile.open(build("sdist", ROOT, folder)) as archive:
        # Python 3.11 has filters from 3.11.4 on.
        archive.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    return next(path for path in folder.iterdir() if path.is_dir())


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory) -> Path:
    """The unpacked wheel that is built from the sdist, as an installer does."""
    folder = tmp_path_factory.mktemp("wheel")
    with zipfile.ZipFile(build("wheel", sdist, folder)) as archive:
        archive.extractall(folder)
    return folder


def files(folder: Path) -> set[str]:
    paths = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return {path.as_posix() for path in paths if "__pycache__" not in path.parts}


def test_wheel_made_from_the_sdist_has_every_file_of_the_package(wheel):
    assert files(ROOT / "src/echotruth") - files(wheel / "echotruth") == set()


def test_wheel_names_the_authors_of_the_citation_and_is_typed(wheel):
    (file,) = wheel.glob("*.dist-info/METADATA")
    metadata = message_from_string(file.read_text())
    people = yaml.safe_load((ROOT / "CITATION.cff").read_text())["authors"]
    assert metadata["Author"] == ", ".join(person["name"] for person in people)
    assert metadata["License-Expression"] == "BSD-3-Clause" and "Typing :: Typed" in metadata.get_all("Classifier")
    assert (wheel / "echotruth/py.typed").is_file()


def test_sdist_has_tests_and_docs_and_no_data_but_the_sample(sdist):
    found = files(sdist)
    assert {"LICENSE", "README.md", "CITATION.cff", "requirements.lock", "docs/schema.md", "config/demo.yaml"} <= found
    assert files(ROOT / "tests") <= {name.removeprefix("tests/") for name in found if name.startswith("tests/")}
    assert {name.split("/")[0] for name in found if name.startswith(".")} <= {".ci", ".dockerignore", ".gitignore"}
    others = found - {"src/echotruth/shipped/sample.zip"}  # it has a bound of its own
    assert not [name for name in others if name.startswith("out/") or ".zarr/" in name]
    assert sum((sdist / name).stat().st_size for name in others) < 20e6


def run(wheel: Path, folder: Path, *arguments: str) -> str:
    """Output of the command `echotruth` of the wheel, which must succeed."""
    environment = os.environ | {"PYTHONPATH": str(wheel), "XDG_CACHE_HOME": str(wheel.with_name("cache"))}
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_sample_is_read_from_the_wheel(wheel, tmp_path):
    output = run(wheel, tmp_path, "info", "sample")
    assert str(wheel.with_name("cache") / "echotruth/sample-") in output and "2 complete" in output
    assert not any(tmp_path.iterdir())


SHIPPED = ["Snakefile", "environment.yml", "CITATION.cff", "rules", "workflow", "profiles", "config"]


@pytest.mark.parametrize("name", SHIPPED)
def test_workflow_travels_in_the_wheel(wheel, name):
    ours, shipped = ROOT / name, wheel / "echotruth/shipped" / name
    assert shipped.exists() and files(ours) == files(shipped)
    for file in files(ours) or {""}:
        assert (shipped / file).read_bytes() == (ours / file).read_bytes()


def test_workflow_is_run_from_the_wheel_with_its_own_files(wheel, tmp_path):
    shipped = wheel / "echotruth/shipped"
    output = run(wheel, tmp_path, "run", "demo", "-n", "--cores", "1")
    assert f"Snakefile: {shipped}/Snakefile" in output
    assert "tracking" in output and not (tmp_path / "out").exists()
