"""Cost of large sweeps before the first job: laying out their repository, planning a block of hearts, and reading.

    python benchmarks/scale.py                        # 100 and 1 000 hearts, minutes
    python benchmarks/scale.py --hearts 1000 10000

Each measurement is one process in an empty folder: CPU seconds of it and its children, and the memory of the largest of
them. No heart is solved. The results stand in benchmarks/results/scale.md and scale.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from math import ceil
from pathlib import Path

import numpy as np
import psutil
import yaml

from echotruth.cases import expand
from echotruth.config import Config, shipped
from echotruth.config.loading import load, validate
from echotruth.repository.store import Store

RESULTS = Path(__file__).parent / "results"
BLOCK = 50
"""Hearts of a block, as `echotruth run` takes them by default."""
PLAN = (
    *(sys.executable, "-m", "snakemake", "--snakefile", str(shipped.ROOT / "Snakefile"), "--configfile", "scale.yaml"),
    *("--cores", "1", "--dry-run", "--quiet"),
)
"""Builds the graph of jobs, decides what is to be made, and prints nothing."""
LAY_OUT = """\
from pathlib import Path
from echotruth.cases import expand
from echotruth.config.loading import load
from echotruth.repository.layout import lay_out
config = load("scale.yaml")
lay_out(Path("out/scale"), config, expand(config))
"""
HEARTS_PER_SEED = 20
"""Hearts that differ in more than the seed: 4 materials x 5 fibre angles."""


TURNS = 5
"""Number of processes that read a repository."""
READ = """\
import json, resource, sys, time
import echotruth as et, xarray, zarr
et.Repository  # what is imported is not counted
times = [time.perf_counter()]
tree = et.Repository(sys.argv[1]).tree
times.append(time.perf_counter())
table = tree["cases"].to_dataset().to_dataframe()
times.append(time.perf_counter())
frame = tree["bmode/64/image"].sel(case=sys.argv[2], view="mid", frame=2).values
times.append(time.perf_counter())
assert sys.argv[2] in table.index
spent = [end - begin for begin, end in zip(times, times[1:])]
print(json.dumps([*spent, int(frame.sum()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""
"""Opens a repository and reads from it: seconds of the clock of each step, sum of the frame, and memory, MiB."""


@dataclass(frozen=True)
class Measurement:
    """Cost of one process.

    Attributes
    ----------
    name : str
    hearts : int
    seconds : float
        User and system time, of its children too, s; of reading the time of the clock.
    memory_MiB : float
        Largest resident set of the process or one of its children, MiB.
    """

    name: str
    hearts: int
    seconds: float
    memory_MiB: float


def sweep(hearts: int) -> Config:
    """Sweep of small hearts in the four standard views."""
    size = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
    values = {
        "name": "scale",
        "geometry": size,
        "loop": {"frames": 4},
        "bmode": {"size_px": 64, "downsampling": [1]},
        "tracking": {"trackers": {"phase": {"window_px": 16}}},
        "cases": {
            "mechanics.material.stiffness_kPa": [0.8, 1.1, 1.6, 2.4],
            "fibres.endo_deg": [60, 64, 68, 72, 76],
            "seed": list(range(1, hearts // HEARTS_PER_SEED + 1)),
        },
    }
    return validate(values, "scale")


def table(hearts: int) -> str:
    """Table of hearts that differ in all of their keys, and so in their motion; each has a loop of its own."""
    random = np.random.default_rng(1)
    lines = ["case,fibres.endo_deg,fibres.epi_deg,mechanics.material.stiffness_kPa,loop.heart_rate_per_min,label.group"]
    for heart in range(hearts):
        endo, epi, stiffness, rate = random.uniform((60, -46, 0.8, 400), (72, -38, 2.4, 560))
        lines.append(f"m{heart},{endo:.3f},{epi:.3f},{stiffness:.4f},{rate:.2f},{'ab'[heart % 2]}")
    return "\n".join(lines)


def measure(name: str, hearts: int, folder: Path, command: tuple[str, ...]) -> Measurement:
    """Run a command in a folder and measure it; its output is shown only if it fails."""
    with tempfile.TemporaryFile("w+") as output:
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        process = subprocess.Popen(command, cwd=folder, stdout=output, stderr=subprocess.STDOUT, env=environment)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = output.read()
        if process.returncode:
            sys.exit(f"{name}: {' '.join(command)} failed:\n{said[-3000:]}")
    measured = Measurement(name, hearts, round(used.ru_utime + used.ru_stime, 1), round(used.ru_maxrss / 1024))
    print(f"{name}, {hearts} hearts: {measured.seconds:.1f} CPU s, {measured.memory_MiB:.0f} MiB", flush=True)
    return measured


def before(hearts: int) -> list[Measurement]:
    """Lay out the repository of a sweep, lay it out again, plan its first block, and read it."""
    block = ("--config", f"block=1/{ceil(hearts / BLOCK)}", "--", "hearts")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "scale.yaml").write_text(yaml.safe_dump(sweep(hearts).model_dump(mode="json")))
        laid_out = [
            measure(name, hearts, folder, (sys.executable, "-c", LAY_OUT)) for name in ("lay out", "lay out again")
        ]
        planned = measure("plan a block", hearts, folder, (*PLAN, *block))
        return [*laid_out, planned, *read(hearts, folder / "out/scale")]


def of_table(hearts: int) -> Measurement:
    """Check a configuration whose hearts are in a table."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "hearts.csv").write_text(table(hearts))
        values = sweep(hearts).model_dump(mode="json") | {"cases": {"file": "hearts.csv"}}
        (folder / "scale.yaml").write_text(yaml.safe_dump(values))
        return measure("check of a table", hearts, folder, (sys.executable, "-m", "echotruth", "check", "scale.yaml"))


def read(hearts: int, folder: Path) -> list[Measurement]:
    """Open the repository, read its table, and a frame by the labels of case and view; medians of several processes."""
    config = load(folder / "config.yaml")
    row, id = hearts // 2, expand(config)[hearts // 2].id
    noise = np.random.default_rng(1).integers(0, 255, (config.loop.frames, 64, 64), np.uint8)
    Store(folder / "scale.zarr").write("bmode/64", {"image": noise}, row, list(config.views).index("mid"))
    times = []
    for _ in range(TURNS):
        found = subprocess.run([sys.executable, "-c", READ, folder, id], stdout=subprocess.PIPE, text=True, check=True)
        *seconds, total, memory = json.loads(found.stdout)
        if total != int(noise[2].sum()):
            sys.exit(f"the frame of {id} is not what was written")
        times.append((*seconds, memory))
    *spent, memory = np.median(times, axis=0)
    names = ("open", "read the table", "read a frame by its labels")
    for name, seconds in zip(names, spent, strict=True):
        print(f"{name}, {hearts} hearts: {seconds:.4f} s", flush=True)
    return [Measurement(name, hearts, round(float(s), 4), round(memory)) for name, s in zip(names, spent, strict=True)]


def write(measured: list[Measurement]) -> None:
    """Write the table and its numbers; measurements of other sizes stay."""
    file = RESULTS / "scale.json"
    kept = [Measurement(**row) for row in json.loads(file.read_text())["measurements"]] if file.exists() else []
    new = {(item.name, item.hearts) for item in measured}
    rows = sorted([*measured, *(item for item in kept if (item.name, item.hearts) not in new)], key=_order)
    machine = f"{os.cpu_count()} cores, load {psutil.getloadavg()[0]:.0f}"
    values = {"machine": machine, "measurements": [asdict(item) for item in rows]}
    file.write_text(json.dumps(values, indent=1) + "\n")
    lines = [
        "# Large sweeps",
        "",
        "Made by `python benchmarks/scale.py`. Hearts x 4 views; CPU seconds of a process and its children, and the",
        f"memory of the largest of them. Python {sys.version.split()[0]}, {machine} while it was measured.",
        "",
        "| | hearts | s | MiB |",
        "|---|---|---|---|",
        *(f"| {item.name} | {item.hearts} | {_digits(item.seconds)} | {item.memory_MiB:.0f} |" for item in rows),
        "",
        f"*plan a block*: the graph of all jobs of the first {BLOCK} hearts, of which nothing is made; *check of a",
        "table*: of hearts that all differ in motion and loop; *lay out*: arrays, coordinates, and table and",
        "configurations of the cases, before the first job;",
        "*open*, *read the table*, *read a frame by its labels*: seconds of the clock, in this order in a new process.",
    ]
    (RESULTS / "scale.md").write_text("\n".join(lines) + "\n")


def _digits(seconds: float) -> str:
    return f"{seconds:.1f}" if seconds >= 1 else f"{seconds:.2g}"


def _order(item: Measurement) -> tuple[str, int]:
    return item.name, item.hearts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--hearts", type=int, nargs="+", default=[100, 1000], help="multiples of 20")
    for hearts in parser.parse_args().hearts:
        write([of_table(hearts), *before(hearts)])


if __name__ == "__main__":
    main()
