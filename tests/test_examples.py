"""Every example runs, and comes to its physical number."""

import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import echotruth as et
from echotruth.config import Config
from echotruth.loop.cycle import read_loop

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name):
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


@pytest.fixture
def with_keys(monkeypatch):
    """A function after which hearts have other keys than an example gives them."""
    beat = et.beat
    return lambda **keys: monkeypatch.setattr(et, "beat", lambda config: beat(et.configure(config, **keys)))


COARSE = {"circumferential_elements": 6, "longitudinal_elements": 4}


def test_heart_ejects_what_its_loop_prescribes(with_keys):
    with_keys(geometry=COARSE)
    volume = read_loop(Config(loop={"frames": 10}).loop).volume
    found = run("ejection_fraction")["ejection_fraction"]
    assert found == pytest.approx(1 - volume.min() / volume[0], abs=2e-3)
    assert 0.5 < found < 0.7  # mice: 0.55 to 0.70 (Vinhas 2013)


def test_infarct_is_stretched_while_the_rest_shortens(with_keys):
    with_keys(geometry=COARSE)
    found = run("infarct")
    assert found["infarct"] > 0.01
    assert found["remote"] < -0.05


def test_cross_section_of_a_tube_that_keeps_its_volume_grows_as_it_shortens(with_keys):
    with_keys(phantom={"density_per_mm3": 30.0}, probe={"elements": 16}, rf={"lines": 16})
    assert run("incompressible_tube")["area_ratio"] == pytest.approx(1 / 0.85, rel=0.01)


def test_echo_of_a_point_is_as_long_as_the_pulse():
    found = run("point_spread")
    assert found["length"] == pytest.approx(found["due"], rel=0.03)


def test_speckle_is_rayleigh_distributed():
    assert run("speckle")["snr"] == pytest.approx(np.sqrt(np.pi / (4 - np.pi)), rel=0.05)


@pytest.mark.slow
def test_tracker_finds_the_motion_that_one_at_rest_misses():
    rest, dis = sorted(run("own_tracker")["errors"].values(), reverse=True)
    assert rest == pytest.approx(100, abs=0.1)
    assert dis < 25


def test_example_of_a_repository_shows_that_an_infarct_lowers_strain_and_ejection_fraction(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["global_strain.py"])
    healthy, infarct = run("global_strain")["table"].to_numpy()
    assert (np.abs(healthy) > np.abs(infarct)).all()


def with_fewer_scatterers(monkeypatch):
    configure, sparse = et.configure, {"density_per_mm3": 100.0}
    monkeypatch.setattr(et, "configure", lambda *given, **keys: configure(configure(*given, **keys), phantom=sparse))


@pytest.mark.slow
def test_blocks_of_the_page_about_python_run_one_after_the_other(monkeypatch):
    with_fewer_scatterers(monkeypatch)
    page, names = (EXAMPLES.parent / "docs/python.md").read_text(), {}
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 5
    assert names["clip"]["image"].shape == (5, 128, 128)
    assert float(names["mechanics"]["volume"][0]) == pytest.approx(50e-9, rel=1e-3)


@pytest.mark.slow
def test_block_of_the_page_about_motion_from_files_runs_on_a_series(tmp_path, monkeypatch, coarse_mesh):
    import pyvista

    monkeypatch.chdir(tmp_path)
    with_fewer_scatterers(monkeypatch)
    for frame, a in enumerate(np.sin(np.pi * np.arange(8) / 8) ** 2):
        nodes = 1e3 * coarse_mesh.nodes * (1 - a * np.array([0.2, 0.2, 0.1]))
        pyvista.UnstructuredGrid({24: coarse_mesh.cells.astype(np.int64)}, nodes).save(f"heart_{frame}.vtu")
    page, names = (EXAMPLES.parent / "docs/motion.md").read_text(), {}
    block, _ = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(block, names)
    volume = names["heart"].arrays["mechanics"]["volume"]
    assert volume[4] / volume[0] == pytest.approx(0.8 * 0.8 * 0.9, rel=1e-6)
    assert 0 < names["et"].evaluate(names["tracked"], names["heart"])["nrmse_percent"] < 40
