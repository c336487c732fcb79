"""Meshes and motions of which everything is known, and a browser."""

import asyncio
import os
import shutil
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import cores  # noqa: F401 - before whatever multiplies or compiles
import finished_repository
import known_repository
import learning_repository
import numpy as np
import pytest
import shown_repository
from once import once

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Mesh
from echotruth.heart import Heart
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import left_ventricle


def pytest_terminal_summary(terminalreporter):
    """Where the time went: the modules that took longest."""
    seconds = Counter()
    for report in chain.from_iterable(terminalreporter.stats.values()):
        if isinstance(report, pytest.TestReport):
            seconds[report.nodeid.partition("::")[0]] += report.duration
    if len(seconds) > 10:
        terminalreporter.section("modules that took longest")
        for module, duration in seconds.most_common(10):
            terminalreporter.write_line(f"{duration:6.0f} s  {module}")


LONGEST = (
    *("test_slurm", "test_baselines", "test_states", "test_checks", "test_browser", "test_snakemake"),
    *("test_circulation", "test_notebooks", "test_added_tracker", "test_examples", "test_notebook", "test_estimate"),
    *("test_peers", "test_site", "test_full_matrix", "test_volume_stages"),
)
"""Modules that take half a minute and more, longest first; the first two compile different functions."""


def pytest_collection_modifyitems(items):
    """Modules that take longest go first, so that no worker waits for one at the end."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    rank = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (rank.get(item.path.stem, len(LONGEST)), item.path not in slow))


async def here(function, *arguments, **options):
    """In place of another thread, to which Zarr gives each file: to wait for it takes a third of a small repository."""
    return function(*arguments, **options)


@pytest.fixture(scope="session", autouse=True)
def disk():
    """Nobody waits for it: no test cuts the power, and waiting takes a third of the time of a small repository."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)
        patch.setattr(asyncio, "to_thread", here)
        yield


QUIET = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking")
"""Options of a browser that runs without a screen, as root, and asks nobody."""


@pytest.fixture(scope="session")
def browser():
    """One for all tests of a worker: Playwright refuses a second one beside it."""
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs Chromium")
    with api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium, args=QUIET)
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """Folder of `finished_repository.FINISHED` as the scripts make it."""
    make = partial(finished_repository.finish, config=finished_repository.FINISHED, result=finished_repository.solved)
    return once(tmp_path_factory, "finished", make)


@pytest.fixture(scope="module")
def done(request, tmp_path_factory) -> Path:
    """Folder of the repository of a module's `CONFIG`, made by its `result` if it has one; nobody writes to it."""
    result = getattr(request.module, "result", finished_repository.blank)
    return finished_repository.finish(tmp_path_factory.mktemp("done") / "small", request.module.CONFIG, result)


@pytest.fixture
def folder(done, tmp_path) -> Path:
    """A copy of it."""
    return shutil.copytree(done, tmp_path / "small")


@pytest.fixture(scope="session")
def textured(tmp_path_factory) -> Path:
    """Folder of the repository of `learning_repository.made`."""
    return once(tmp_path_factory, "textured", learning_repository.made)


@pytest.fixture(scope="session")
def known(tmp_path_factory) -> known_repository.Known:
    """The repository of a heart that moves as a rigid body."""
    make = partial(known_repository.make, settings=known_repository.SETTINGS)
    return known_repository.known_at(once(tmp_path_factory, "known", make), known_repository.SETTINGS)


@pytest.fixture(scope="session")
def shown(tmp_path_factory) -> shown_repository.Shown:
    """A ring that moves by whole pixels, as the viewer and the report show it."""
    return shown_repository.shown_at(once(tmp_path_factory, "shown", shown_repository.make_shown))


COARSE = Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1)


@pytest.fixture(scope="session")
def coarse_mesh() -> Mesh:
    """A ventricle of few cells."""
    return left_ventricle(COARSE)


@pytest.fixture(scope="session")
def half_sphere() -> Mesh:
    """Half a sphere with radii of 2 and 3 mm."""
    size = {"endo_radius_mm": 2.0, "endo_length_mm": 2.0, "wall_mm": 1.0, "apex_wall_mm": 1.0, "base_mm": 0.0}
    elements = {"circumferential_elements": 24, "longitudinal_elements": 8, "transmural_elements": 1}
    return left_ventricle(Geometry(**size, **elements))


@pytest.fixture(scope="session")
def affine() -> tuple[np.ndarray, np.ndarray]:
    """A turn by 9 degrees about the long axis, a squeeze, and a lift: deformation gradient and shift (m)."""
    turn = np.radians(9)
    around = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    return around @ np.diag([0.85, 0.85, 0.93]), np.array([0.1e-3, -0.05e-3, 0.2e-3])


@pytest.fixture(scope="session")
def twisting_heart(coarse_mesh, affine) -> Heart:
    """A ventricle that is at rest in frame 0 and moved by an affine map in frame 1."""
    nodes, (matrix, shift) = coarse_mesh.nodes, affine
    motion = np.stack([np.zeros_like(nodes), nodes @ (matrix - np.eye(3)).T + shift])
    return Heart(nodes, coarse_mesh.cells, motion, wall_depth(coarse_mesh), coarse_mesh.endo, layers=6, es=1)


@pytest.fixture(scope="session")
def hemispherical_heart(half_sphere, twisting_heart):
    """Function of the displacements (frame, node, 3), m, of half a sphere: the heart that is one, with its surfaces."""

    def heart(displacement):
        return replace(
            twisting_heart,
            nodes=half_sphere.nodes,
            cells=half_sphere.cells,
            displacement=displacement,
            endo=half_sphere.endo,
            arrays={"geometry": {"endo": half_sphere.endo, "epi": half_sphere.epi}},
        )

    return heart
