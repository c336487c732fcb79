"""README.md of a repository: its data card."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from hashlib import sha256

from echotruth.cases.labels import diagnosis
from echotruth.repository.description import statements
from echotruth.repository.description.attribution import Attribution
from echotruth.repository.description.citation import authors, bibtex, published, title
from echotruth.repository.description.facts import Facts
from echotruth.repository.description.quantities import Quantity
from echotruth.repository.description.tables import CHECKSUMS, CLIPS
from echotruth.section import unit_of

MARK = "<!-- Made by echotruth describe. -->\n"
"""First line, by which the file is known as one that may be replaced."""

LISTED = 20
"""Hearts, failures and values that are listed one by one; the others are in the tables."""


def card(facts: Facts, attribution: Attribution, tables: dict[str, bytes]) -> bytes:
    """Data card of a repository.

    Parameters
    ----------
    facts : Facts
    attribution : Attribution
    tables : dict
        Content of the tables that are written beside the card, by their name.
    """
    parts = [
        f"# {title(facts)}",
        statements.summary(facts),
        _about(facts, attribution),
        *_section("How to read it", [_reading(facts)]),
        *_section("What was swept", [_sweep(facts), *_drawing(facts)]),
        *_section("Labels", [_labels(facts)]),
        *_section("Hearts that are not complete", _incomplete(facts)),
        *_section("Trackers and views that failed", _failures(facts)),
        *_section("What is in it", _quantities(facts)),
        *_section("Files", [_files(facts, tables)]),
        *_section("How it was made", [statements.collection(facts), _making(facts)]),
        *_section("Sources with terms of their own", _sources(facts)),
        *_section("Known limits", [_list(statements.limits(facts))]),
        *_section("Biases", [_list(statements.biases(facts))]),
        *_section("What it is for", [_list(statements.USES)]),
        *_section("What it must not be used for", [_list(statements.MISUSES)]),
        *_section("Personal and sensitive information", [statements.PRIVACY]),
        *_section("Upkeep", [statements.maintenance(facts)]),
        *_section("How to cite", _citing(facts, attribution)),
    ]
    return (MARK + "\n\n".join(parts) + "\n").encode()


def _section(heading: str, paragraphs: Iterable[str]) -> list[str]:
    """A heading and what is below it; nothing if that is empty."""
    texts = [text for text in paragraphs if text]
    return [f"## {heading}", *texts] if texts else []


def _about(facts: Facts, attribution: Attribution) -> str:
    licence = attribution.licence
    size = sum(file.size for file in facts.files)
    people = ", ".join(author.name for author in authors(facts, attribution))
    rows = {
        "authors": people if attribution.authors else "not named",
        "licence": f"[{licence.name}]({licence.url})" if licence.url else f"{licence.name}.",
        "release": f"{attribution.release}, {published(facts, attribution).isoformat()}",
        "published at": attribution.url,
        "size": f"{_bytes(size)} in {len(facts.files)} files ({_bytes(size / max(len(facts.cases), 1))} a heart)",
        "made by": f"echotruth {facts.run.packages.get('echotruth', '(version not recorded)')}",
    }
    return _table(("", ""), [(key, _cell(value)) for key, value in rows.items() if value])


def _reading(facts: Facts) -> str:
    case = next((each.case for each in facts.outcomes if each.status == "complete"), facts.outcomes[0].case)
    view = next(iter(facts.config.views))
    return f"""```python
import echotruth as et

repository = et.Repository("{facts.name}")  # this folder; repository.tree is all of it, as an xarray DataTree
clip = repository.clip("{case}", "{view}")  # one clip with its truth
print(clip["image"].shape, clip["displacement"].isel(frame=-1).mean().values)  # pixels; m
```

Any reader of Zarr (format 3) opens `{facts.store}`, as `xarray.open_datatree("{facts.store}", engine="zarr")` does.
`{CLIPS}` lists the clips, `cases.csv` the hearts. Lengths are in metres, times in seconds, pressures in pascals."""


def _sweep(facts: Facts) -> str:
    rows = [(f"`{key}`", unit_of(key) or "", _values(values)) for key, values in facts.swept.items()]
    return _table(("key", "unit", "values"), rows) if rows else "Nothing: all keys have one value (config.yaml)."


def _drawing(facts: Facts) -> list[str]:
    draw, conditions = facts.config.cases.draw, facts.config.cases.where
    drawn = f"Values were drawn {draw.number} times: {draw.method}, seed {draw.seed} (config.yaml)." if draw else ""
    return [drawn, f"All hearts meet: {', '.join(f'`{one}`' for one in conditions)}." if conditions else ""]


def _labels(facts: Facts) -> str:
    """Number of hearts of each diagnosis, and the labels that the makers gave."""
    counts = Counter(diagnosis(case.config) for case in facts.cases.values())
    table = _table(("diagnosis", "hearts"), [(name, str(number)) for name, number in sorted(counts.items())])
    names = dict.fromkeys(name for case in facts.cases.values() for name in case.labels)
    others = (
        f"\n\nThe makers also gave {', '.join(f'`label.{name}`' for name in names)} (`cases.csv`)." if names else ""
    )
    return f"The diagnosis follows from the configuration of a heart, and is exact.\n\n{table}{others}"


def _values(values: list[object]) -> str:
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(values) > 8 and len(numbers) == len(values):
        return f"{len(values)} values from {min(numbers):g} to {max(numbers):g}"
    shown = ", ".join("none" if value is None else str(value) for value in values[:LISTED])
    return _cell(shown if len(values) <= LISTED else f"{shown} and {len(values) - LISTED} others")


def _incomplete(facts: Facts) -> list[str]:
    others = [outcome for outcome in facts.outcomes if outcome.status != "complete"]
    rows = [(f"`{one.case}`", one.status, _cell(one.reason)) for one in others[:LISTED]]
    texts = [_table(("heart", "status", "reason"), rows)] if rows else []
    if len(others) > LISTED:
        texts.append(f"And {len(others) - LISTED} others, whose reasons are in `cases/reason` of the store.")
    return texts


def _failures(facts: Facts) -> list[str]:
    texts = [_list([*facts.failures[:LISTED]])] if facts.failures else []
    return [*texts, f"And {len(facts.failures) - LISTED} others."] if len(facts.failures) > LISTED else texts


def _quantities(facts: Facts) -> list[str]:
    sizes = ", ".join(map(str, facts.config.bmode.sizes))
    texts = [
        f"Arrays of `{facts.store}`, by group; SIZE stands for {sizes}. Units are SI; 1 is dimensionless. "
        "The group `cases` also has an array for every key in which the hearts differ, in the unit of the key."
    ]
    groups = dict.fromkeys(quantity.group for quantity in facts.arrays)
    for group in groups:
        rows = [_row(one) for one in facts.arrays if one.group == group]
        texts += [f"### {group}", _table(("array", "dimensions", "type", "unit", "meaning"), rows)]
    return texts


def _row(quantity: Quantity) -> tuple[str, ...]:
    dims = ", ".join(quantity.dims)
    return f"`{quantity.name}`", dims, quantity.dtype, quantity.units, _cell(quantity.long_name)


def _files(facts: Facts, tables: dict[str, bytes]) -> str:
    groups: dict[str, list[int]] = {}
    for file in facts.files:
        groups.setdefault("/".join(file.path.split("/")[:2]), []).append(file.size)
    rows = [(f"`{path}`", str(len(sizes)), _bytes(sum(sizes)), "") for path, sizes in sorted(groups.items())]
    rows += [(f"`{file.path}`", "1", _bytes(file.size), f"`{file.sha256}`") for file in facts.tables]
    rows += [
        (f"`{name}`", "1", _bytes(len(content)), f"`{sha256(content).hexdigest()}`") for name, content in tables.items()
    ]
    text = f"""

`{CHECKSUMS}` has the SHA-256 of every file of the store, as they were taken when the files were written; its own is
that of the whole store. `sha256sum --check --quiet {CHECKSUMS}`, in this folder, compares them. `croissant.json`
describes the tables for machine learning (Croissant with its extension for responsible AI),
`ro-crate-metadata.json` the run (Workflow Run RO-Crate)."""
    return _table(("path", "files", "size", "SHA-256"), rows) + text


def _making(facts: Facts) -> str:
    run = facts.run
    packages = ", ".join(f"{name} {version}" for name, version in run.packages.items()) or "not recorded"
    code = ", ".join(f"{stage} {' and '.join(versions)}" for stage, versions in run.code.items())
    rows = [
        ("settings", "`config.yaml`, with all defaults"),
        ("seed", str(facts.config.seed)),
        ("first and last job", f"{run.started.isoformat()} and {run.ended.isoformat()}"),
        ("jobs", f"{run.jobs}, {run.cpu_seconds / 3600:.2f} hours of one core"),
        ("instructions", ", ".join(run.instructions) or "not recorded"),
        ("packages", packages),
        ("code of the stages", code),
    ]
    return _table(("", ""), rows)


def _sources(facts: Facts) -> list[str]:
    named = statements.sources(facts)
    text = "Hearts were made from files whose terms hold for what was made from them. Look them up before you share it:"
    return [text, _list([f"`{path}`" for path in named])] if named else []


def _citing(facts: Facts, attribution: Attribution) -> list[str]:
    text = f"As in `CITATION.cff`, with the software, echotruth, and the paper it builds on ({statements.PAPER}):"
    return [text, f"```bibtex\n{bibtex(facts, attribution)}\n```"]


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _list(items: list[str]) -> str:
    return "\n".join(f"- {' '.join(item.split())}" for item in items)


def _cell(text: str) -> str:
    """Text that does not break a table."""
    return " ".join(text.split()).replace("|", "\\|")


def _bytes(number: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if number < 1000:
            return f"{number:.3g} {unit}"
        number /= 1000
    return f"{number:.3g} TB"
