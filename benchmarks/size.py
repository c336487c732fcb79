"""What a repository takes on disk: bytes and files by stage, of its hearts and of its structure.

    python benchmarks/size.py out/default            # prints the table
    python benchmarks/size.py out/default --write    # and writes it to benchmarks/results/size.md

The bytes are those of the files, not of the blocks of the file system. Figures, logs and scratch, which a repository
does not need, do not count.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from echotruth.config.loading import load
from echotruth.repository import schema
from echotruth.repository.inventory import files_below

RESULTS = Path(__file__).parent / "results"
MB = 1e6
HEARTS = 5000
"""Hearts of the set for which the table says what it would take."""


@dataclass
class Size:
    """Files by what they are, and their bytes.

    Attributes
    ----------
    files, size : Counter
        Number and bytes, by stage or array.
    """

    files: Counter[str] = field(default_factory=Counter)
    size: Counter[str] = field(default_factory=Counter)

    def add(self, name: str, path: Path) -> None:
        """Count a file."""
        self.files[name] += 1
        self.size[name] += path.stat().st_size

    @property
    def total(self) -> tuple[int, int]:
        """Number and bytes of all."""
        return self.files.total(), self.size.total()


def measure(folder: Path) -> tuple[Size, Size, Size, int]:
    """Sizes of the shards by array and by stage with the records, of the structure, and the number of hearts.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    """
    config = load(folder / "config.yaml")
    arrays, stages, structure = Size(), Size(), Size()
    jobs = {f"{group}/{array.name}" for group, of in schema.groups(config).items() for array in of if array.leading}
    store = folder / f"{config.name}.zarr"
    for name in files_below(store):
        array, _, shard = name.partition("/c/")
        if shard and array in jobs and not array.startswith("cases/"):
            arrays.add(array, store / name)
            stages.add(array.partition("/")[0], store / name)
        else:
            structure.add(name.partition("/")[0] if "/" in name else "root", store / name)
    for name in files_below(folder / "ledger"):
        if "/" in name:
            stages.add("records", folder / "ledger" / name)
        else:
            structure.add("records", folder / "ledger" / name)
    return arrays, stages, structure, len(list((folder / "ledger/mechanics").glob("*.json")))


def page(folder: Path) -> str:
    """The tables as Markdown."""
    arrays, stages, structure, hearts = measure(folder)
    files, size = stages.total
    lines = [f"One heart of `{folder.name}` takes {size / hearts / MB:.1f} MB in {files / hearts:.0f} files."]
    lines += ["", "| stage | files a heart | MB a heart |", "|---|---|---|"]
    lines += [
        f"| {name} | {stages.files[name] / hearts:.0f} | {stages.size[name] / hearts / MB:.2f} |"
        for name, _ in stages.size.most_common()
    ]
    lines += ["", "The largest arrays:", "", "| array | MB a heart |", "|---|---|"]
    lines += [f"| {name} | {number / hearts / MB:.2f} |" for name, number in arrays.size.most_common(12)]
    count, bytes_ = structure.total
    lines += ["", f"The structure, once for all hearts, takes {bytes_ / MB:.2f} MB in {count} files:", ""]
    lines += ["| group | files |", "|---|---|"]
    lines += [f"| {name} | {number} |" for name, number in structure.files.most_common()]
    sweep = HEARTS * size / hearts / 1e9, HEARTS * files / hearts / 1e6
    lines += ["", f"{HEARTS} such hearts take {sweep[0]:.0f} GB in {sweep[1]:.2f} million files."]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path)
    parser.add_argument("--write", action="store_true", help="write benchmarks/results/size.md")
    arguments = parser.parse_args()
    text = page(arguments.repository)
    print(text, end="")
    if arguments.write:
        head = f"# What a repository takes on disk\n\n`python benchmarks/size.py {arguments.repository} --write`\n\n"
        (RESULTS / "size.md").write_text(head + text)


if __name__ == "__main__":
    main()
