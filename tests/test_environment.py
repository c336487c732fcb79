"""Requirements of pip and conda agree, and no file depends on a particular machine."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base", "opencv-python-headless": "py-opencv"}
CONDA_ONLY = {"python", "pip", "hatchling"}


def requirements(*extras):
    listed = [
        *PROJECT["dependencies"],
        *(entry for extra in extras for entry in PROJECT["optional-dependencies"][extra]),
    ]
    return [Requirement(entry) for entry in listed]


def conda():
    """Name -> version bounds of every conda package."""
    packages = (entry for entry in conda_entries() if isinstance(entry, str))
    return {name: bounds.strip() for name, _, bounds in (entry.partition(" ") for entry in packages)}


def conda_entries():
    return yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]


def lock():
    """Name -> pinned versions in requirements.lock."""
    text = (ROOT / "requirements.lock").read_text().replace("\\\n", " ")
    found = {}
    for line in filter(str.strip, text.splitlines()):
        entry = re.fullmatch(r"([a-z0-9._-]+)==(\S+) *(?:;(.*?))?((?: +--hash=sha256:[0-9a-f]{64})+) *", line)
        assert entry, f"not pinned and hashed: {line[:80]}"
        found.setdefault(entry[1], []).append(entry[2])
    return found


def tracked():
    """Path -> text of the files that git tracks."""
    try:
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in listed.split("\0") if name]
    return {path.relative_to(ROOT): path.read_text("utf-8", "replace") for path in paths if path.is_file()}


def test_conda_asks_for_what_pip_asks_for():
    expected = {CONDA_NAMES.get(each.name, each.name): str(each.specifier) for each in requirements("make", "test")}
    assert {name: bounds for name, bounds in conda().items() if name not in CONDA_ONLY} == expected


def test_conda_installs_the_checkout_and_nothing_else_by_pip():
    assert [entry for entry in conda_entries() if not isinstance(entry, str)] == [{"pip": ["-e ."]}]


def test_conda_has_the_same_python():
    assert set(conda()["python"].split(",")) == set(PROJECT["requires-python"].split(","))
    assert set(conda()) >= CONDA_ONLY


@pytest.mark.parametrize("requirement", requirements("make", "test", "build"), ids=lambda each: each.name)
def test_lock_pins_and_hashes_a_version_within_bounds(requirement):
    versions = lock()[requirement.name]
    assert versions and all(requirement.specifier.contains(version) for version in versions)


def test_no_tracked_file_names_a_registry_or_a_folder_of_one_machine():
    hosts = ["py" + "pi.org", "python" + "hosted.org", "ana" + "conda.org", "repo.ana" + "conda.com", "index" + "-url"]
    folders = ["/ho" + "me/", "/wo" + "rk/", "/Us" + "ers/", "/ro" + "ot/"]
    absolute = re.compile("|".join(rf"(?<![\w.}}*]){folder}\w" for folder in folders))
    for path, text in tracked().items():
        assert not [host for host in hosts if host in text], path
        assert not absolute.search(text), path


def test_citation_names_the_paper_and_the_version():
    import echotruth

    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    paper = "Synthetic ultrasound images to benchmark echocardiography-based biomechanics"
    assert citation["preferred-citation"]["title"] == paper
    assert citation["version"] == echotruth.__version__ and citation["license"] == PROJECT["license"]
