"""Many writers, a reader and a publisher at the same time: nothing is lost, and nobody sees half a file."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import zarr

from echotruth.config import Config
from echotruth.repository import layout, ledger, schema
from echotruth.repository.checksums import verify, verify_structure
from echotruth.repository.store import Store

FRAMES = 4
START = """
import sys, warnings
from pathlib import Path
import numpy as np
import xarray as xr
from echotruth.repository import ledger, schema
from echotruth.repository.checksums import checksums, verify_structure
from echotruth.repository.store import Store
warnings.simplefilter("error")
store, ledger_folder = Store(Path(sys.argv[1]) / "small.zarr"), Path(sys.argv[1]) / "ledger"
lengths = {"frame": FRAMES} | {name: store._open("physiology", "r")[name].size for name in ("scalar", "course")}
print("ready", flush=True)
sys.stdin.readline()
""".replace("FRAMES", str(FRAMES))

WRITE = (
    START
    + """
for row in range(int(sys.argv[2]), int(sys.argv[3])):
    arrays = schema.SINGLE["physiology"]
    values = {array.name: np.full([lengths[dim] for dim in array.dims[1:]], row) for array in arrays}
    store.write("physiology", values, row)
    sha256 = checksums(store.files("physiology", row), store.path)
    ledger.commit(ledger_folder / f"physiology/{row}.json", {"sha256": sha256})
"""
)

PUBLISH = (
    START
    + """
import select
count = 0
while not select.select([sys.stdin], [], [], 0)[0]:
    count += 1
    rows = len(store.labels("case"))
    done = {int(path.stem) for path in (ledger_folder / "physiology").glob("*.json")}
    verify_structure(store.path, store.record)
    store.write_column("status", ["complete" if row in done else "" for row in range(rows)])
    store.describe({"title": f"publication {count}"})
print(count)
"""
)

READ = (
    START
    + """
import select
count = 0
while not select.select([sys.stdin], [], [], 0)[0]:
    count += 1
    names = [path.name for path in store.path.rglob("*") if path.is_file()]
    with xr.open_datatree(store.path, engine="zarr") as tree:
        status = tree["cases/status"].values
        twist = tree["physiology/courses"].sel(course="twist").values
    written = np.isfinite(twist).all(1)
    assert (twist[written] == np.flatnonzero(written)[:, None]).all() and np.isnan(twist[~written]).all()
    assert written[status == "complete"].all()
print(count)
"""
)


def start(script: str, *arguments: object) -> subprocess.Popen:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", script, *map(str, arguments)], **pipes)


def lay_out(folder: Path, cases: int) -> Store:
    rows = [f"case{row}" for row in range(cases)]
    labels = layout.labels(Config(loop={"frames": FRAMES}), rows, np.zeros((cases, FRAMES)))
    store = Store(folder / "small.zarr")
    store.lay_out({"cases": schema.CASES, "physiology": schema.SINGLE["physiology"]}, {}, labels)
    return store


@pytest.mark.slow
def test_writers_beside_a_reader_and_a_publisher_lose_nothing(tmp_path):
    writers, cases = 12, 240
    store, each = lay_out(tmp_path, cases), cases // writers
    before = {path: path.read_bytes() for path in store.path.rglob("zarr.json") if path.parent != store.path}
    jobs = [start(WRITE, tmp_path, first, first + each) for first in range(0, cases, each)]
    others = [start(READ, tmp_path), start(PUBLISH, tmp_path)]
    for process in (*jobs, *others):
        assert process.stdout.readline() == "ready\n", process.communicate()[1]
    for process in (*jobs, *others):
        process.stdin.write("\n")
        process.stdin.flush()
    assert [process.communicate()[1] for process in jobs] == [""] * writers
    for process in others:
        rounds, errors = process.communicate("\n")
        assert errors == "" and int(rounds) > 0
    verify_structure(store.path, store.record)
    records = sorted((tmp_path / "ledger/physiology").glob("*.json"))
    assert len(records) == cases
    shards = sum(verify(store.path, path, ledger.read(path)) for path in records)
    assert shards == cases * len(schema.SINGLE["physiology"])
    assert {path: path.read_bytes() for path in before} == before
    assert not list(store.path.rglob("*.partial"))
    measured = zarr.open_array(store.path, path="physiology/scalars", mode="r")[...]
    np.testing.assert_array_equal(measured, np.broadcast_to(np.arange(cases)[:, None], measured.shape))
