"""Hostile configurations: shipped YAML files with values, keys and bytes changed, bombs, tags, tables of hearts.

What is accepted must be YAML that PyYAML's safe loader reads, be valid by `config/schema.json`, which jsonschema
checks, hold no number that is not finite, and have been read as the values that stand in it.
"""

from __future__ import annotations

import copy
import json
import math
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import yaml
from hostile_child import ACCEPTED, EXECUTED, SILENT, Answer, Child, Trial

PART = "configurations"
SHIPPED = Path(__file__).parents[1] / "config"
MUTATIONS, SPOILED = 6, 3
"""Values changed, and texts spoiled, of every shipped file."""

VALUES: dict[str, list[Any]] = {
    "wrong type": [None, True, "text", "", [], {}, [[]], {"a": {}}, "12", [1, "a", None]],
    "number that no heart has": [-1, 0, 1e308, -1e308, 1e-308, -0.5, 2**63, 10**12],
    "not a number": [math.nan, math.inf, -math.inf, [math.nan]],
    "hostile text": [
        "../../../etc/passwd",
        "; touch MARKER",
        "$(touch MARKER)",
        "<script>alert(1)</script>",
        "\u202egpj",
    ],
    "strange text": ["a" * 10_000, "é" * 300, "-rf", "nul\\0", "١٢"],
}


UNKNOWN = "unknown key"
HARMLESS = "valid by the schema, and read as it is written; nothing that it names is run by a check"


def tried(folder: Path, child: Child, random: np.random.Generator, marker: Path) -> Iterator[Trial]:
    """Give every configuration to `echotruth check`."""
    judge = _Judge(child, marker)
    shutil.copytree(SHIPPED, folder / "config", ignore=shutil.ignore_patterns("*.yaml"))
    for path in sorted(SHIPPED.glob("*.yaml")):
        text = path.read_text(encoding="utf-8")
        for kind, name, content in (*_mutated(text, random), *_spoiled(text, random)):
            file = folder / path.name
            file.write_bytes(content.replace(b"MARKER", os.fsencode(marker)))
            # Whatever is wrong, the section in which it is must be named.
            section = name.partition(" = ")[0].split(".")[0] if kind in (*VALUES, UNKNOWN) else ""
            # An error in a sweep names the key that is swept.
            section = "" if section == "cases" else section
            yield judge(kind, f"{path.name}: {name}", file, section)
    for kind, texts in _written(marker).items():
        for name, content in texts.items():
            file = folder / "hostile.yaml"
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
            yield judge(kind, name, file)
    for name, content in _tables(marker).items():
        file, table = folder / "hostile.yaml", folder / "hearts.csv"
        file.write_text("name: hostile\ncases: {file: hearts.csv}\n")
        table.unlink(missing_ok=True)
        table.write_bytes(content if isinstance(content, bytes) else content.encode())
        yield judge("wrong table of cases", name, file)
    for name, place in _places(folder).items():
        yield judge("path to nowhere", name, place)


class _Judge:
    """Gives a configuration to the command, and says what became of it."""

    def __init__(self, child: Child, marker: Path) -> None:
        self._child, self._marker = child, marker
        self._schema = jsonschema.Draft202012Validator(json.loads((SHIPPED / "schema.json").read_text()))

    def __call__(self, kind: str, name: str, file: Path, section: str = "") -> Trial:
        answer = self._child("echotruth", arguments=["check", str(file)])
        outcome, said = answer.refusal(file.name[:80], section), " ".join(answer.sentences)[:300]
        if not answer.fault and ": valid; cases: " in answer.text:
            wrong = self._wrongly_accepted(file)
            outcome, said = (SILENT, wrong) if wrong else (ACCEPTED, HARMLESS)
        if self._marker.exists():
            self._marker.unlink()
            outcome = EXECUTED
        return Trial(PART, kind, name, outcome, said or answer.text[-600:])

    def _wrongly_accepted(self, file: Path) -> str:
        """Why a configuration that was accepted should not have been; empty if it is one."""
        try:
            # Numbers such as 1e-6 are text in YAML 1.1.
            given = yaml.load(file.read_bytes(), _Yaml12) or {}
        except (yaml.YAMLError, ValueError) as error:
            return f"PyYAML: {error}"
        if error := next(self._schema.iter_errors(given), None):
            return f"{error.json_path}: {error.message[:200]}"
        if any(isinstance(value, float) and not math.isfinite(value) for _, value in _leaves(given)):
            return "holds a number that is not finite"
        read: Answer = self._child("configuration", path=str(file))
        if read.fault or read.status:
            return read.text[-300:]
        found = dict(_leaves(json.loads(read.text.splitlines()[-1])))
        for key, value in _leaves(given):
            if key in found and found[key] != value:
                return f"{'.'.join(map(str, key))} is {value!r} and was read as {found[key]!r}"
        return ""


class _Yaml12(yaml.SafeLoader):
    """PyYAML's safe loader, which takes 1e-6 for a number too."""


_Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:float", yaml.reader.re.compile(r"[-+]?\d+[eE][-+]?\d+$"), list("-+0123456789")
)


def _leaves(values: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Path of every plain value, and the value."""
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in items:
        if isinstance(value, dict | list):
            yield from _leaves(value, (*path, key))
        else:
            yield (*path, key), value


def _nodes(values: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Path of every value, mappings and lists included; of lists the first entries."""
    items = values.items() if isinstance(values, dict) else enumerate(values[:3]) if isinstance(values, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from _nodes(value, (*path, key))


def _mutated(text: str, random: np.random.Generator) -> Iterator[tuple[str, str, bytes]]:
    """Kind, name and text of a configuration in which one value is another, or one key is not known."""
    whole = yaml.safe_load(text)
    paths = list(_nodes(whole))
    for _ in range(MUTATIONS):
        values, path = copy.deepcopy(whole), paths[random.integers(len(paths))]
        kind = list(VALUES)[random.integers(len(VALUES))]
        value = VALUES[kind][random.integers(len(VALUES[kind]))]
        parent = values
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = value
        yield (
            kind,
            f"{'.'.join(map(str, path))} = {str(value)[:40]!r}",
            yaml.safe_dump(values, sort_keys=False).encode(),
        )
    holders = [(), *(path for path, value in ((path, _at(whole, path)) for path in paths) if isinstance(value, dict))]
    values, path = copy.deepcopy(whole), holders[random.integers(len(holders))]
    _at(values, path)["__class__"] = {"__init__": 1}
    yield UNKNOWN, f"{'.'.join(map(str, path))}.__class__", yaml.safe_dump(values, sort_keys=False).encode()


def _at(values: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        values = values[key]
    return values


def _spoiled(text: str, random: np.random.Generator) -> Iterator[tuple[str, str, bytes]]:
    """Kind, name and text of a configuration whose file was damaged."""
    content = text.encode()
    for _ in range(SPOILED):
        place = int(random.integers(1, len(content)))
        kind = ("truncated", "flipped bit", "line indented")[random.integers(3)]
        if kind == "truncated":
            yield kind, f"at byte {place}", content[:place]
        elif kind == "flipped bit":
            flipped = content[place] ^ 1 << int(random.integers(8))
            yield kind, f"in byte {place}", content[:place] + bytes([flipped]) + content[place + 1 :]
        else:
            lines = text.splitlines(keepends=True)
            line = int(random.integers(len(lines)))
            yield kind, f"line {line + 1}", "".join([*lines[:line], "   " + lines[line], *lines[line + 1 :]]).encode()


def _bomb(key: str, times: int = 9) -> str:
    """Lists of aliases of lists: 9^9 values of a thousand characters."""
    levels = [f"  - &a{n} [{', '.join([f'*a{n - 1}'] * times)}]" for n in range(1, 9)]
    return "\n".join([f"{key}:", f"  - &a0 [{', '.join('1' * times)}]", *levels])


def _written(marker: Path) -> dict[str, dict[str, str | bytes]]:
    """Kind -> name -> configurations that are written for malice."""
    touch = f"touch {marker}"
    tags = {
        "os.system": f"name: !!python/object/apply:os.system ['{touch}']",
        "subprocess": f"seed: !!python/object/apply:subprocess.check_output [['touch', '{marker}']]",
        "new": f"geometry: !!python/object/new:os.system ['{touch}']",
        "module": "views: !!python/module:os",
        "name": "mechanics: !!python/name:os.system",
        "tuple": "cases: {seed: !!python/tuple [1, 2]}",
        "local": f"name: !execute '{touch}'",
        "in a table": f"cases: {{table: !!python/object/apply:os.system ['{touch}']}}",
        "as a key": f"? !!python/object/apply:os.system ['{touch}']\n: 1",
        "binary": "name: !!binary aGVsbG8=",
        "set": "bmode: {downsampling: !!set {1, 2}}",
        "omap": "views: !!omap [mid: {position: 0.5}]",
        "timestamp": "name: !!timestamp 2001-12-14",
        "wrong": "seed: !!int hello",
        "float of text": "seed: !!float .nan",
    }
    bombs = {
        "a section": _bomb("geometry"),
        "values of a sweep": "cases:\n" + "\n".join(f"  {line}" for line in _bomb("seed").splitlines()),
        "merged keys": "a: &a {x: 1}\nb: {<<: [*a, *a]}",
        "an alias in its anchor": "geometry: &a\n  wall_mm: *a",
        "an alias in its list": "cases: {seed: &a [1, *a]}",
        "lists in lists": "cases: " + "[" * 5000 + "]" * 5000,
        "mappings in mappings": "a: " + "{a: " * 5000 + "}" * 5000,
        "unclosed": "{" * 200_000,
        "many keys": "".join(f"k{n}: 1\n" for n in range(200_000)),
        "a long number": "seed: " + "9" * 100_000,
        "a number in base 60": "seed: " + ":".join(["59"] * 5000),
        "a product of cases": f"cases: {{seed: {list(range(2000))}, fibres.endo_deg: {[n / 99 for n in range(2000)]}}}",
        "10 MB of a comment": "#" + "x" * 10_000_000,
        "a long name": "name: " + "a" * 1_000_000,
        "many views": "views:\n" + "".join(f"  v{n}: {{}}\n" for n in range(10_000)),
    }
    bytes_ = {
        "empty lines and a NUL": b"\0" * 100,
        "all bytes": bytes(range(256)),
        "UTF-16": "name: demo\n".encode("utf-16"),
        "latin-1": "name: Herz-\xe4\n".encode("latin-1"),
        "escape codes": b"name: \x1b[2Jdemo\n",
        "a ZIP archive": b"PK\x03\x04" + bytes(200),
        "a pickle": b"\x80\x04\x95\x1a\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94\x8c\x06system\x94\x93\x94.",
        "three documents": b"---\nname: a\n---\nname: b\n---\n",
        "only a scalar": b"42",
        "only a list": b"- 1\n- 2\n",
        "a key twice": b"seed: 1\nseed: 2\n",
        "a directive": b"%YAML 9.9\n---\nname: a\n",
        "tabs": b"geometry:\n\twall_mm: 1\n",
        "lone surrogate": b'name: "\\ud800"\n',
    }
    names = {
        "a path": "name: ../../tmp/evil",
        "a path of root": "name: /etc/passwd",
        "shell": f"name: 'a; {touch}'",
        "shell in a substitution": f"name: 'a$({touch})'",
        "an option": "name: --help",
        "a dot": "name: '.'",
        "dots": "name: '..'",
        "a store": "name: x.zarr",
        "a line end": 'name: "a\\nb"',
        "a NUL": 'name: "a\\0b"',
        "blank": "name: ' '",
        "of a view": "views: {'../x': {position: 0.5}}",
        "of a view, shell": f"views: {{'a`{touch}`': {{position: 0.5}}}}",
        "of a tracker": "tracking: {trackers: {'../../x': {window_px: 32}}}",
        "of a tracker, reserved": "tracking: {trackers: {__init__: {window_px: 32}}}",
        "of a braced wildcard": "name: '{case}'",
        "of a glob": "name: '*'",
        "homoglyph": "name: dеmo",
    }
    elsewhere = {
        "a mesh that is not there": "geometry: {file: nowhere.vtu}",
        "a mesh that is a folder": "geometry: {file: /tmp}",
        "a mesh that never ends": "geometry: {file: /dev/zero}",
        "a mesh by address": "geometry: {file: 'http://127.0.0.1:1/x.vtu'}",
        "a loop that is not there": "loop: {file: nowhere.csv}",
        "a loop that never ends": "loop: {file: /dev/zero}",
        "a loop that is a folder": "loop: {file: /tmp}",
        "a loop that is no text": "loop: {file: /bin/sh}",
        "a table that never ends": "cases: {file: /dev/zero}",
        "a table that is a folder": "cases: {file: /tmp}",
        "a motion that is not there": "motion: {kind: file, file: {path: 'nowhere_*.vtu'}}",
        "a motion that never ends": "motion: {kind: file, file: {path: /dev/zero}}",
        "a tracker of a module": "tracking: {trackers: {a: {method: external, track: 'os:system'}}}",
        "a tracker of no module": "tracking: {trackers: {a: {method: external, track: 'nowhere.at.all:track'}}}",
        "a tracker by path": "tracking: {trackers: {a: {method: external, track: '../evil.py'}}}",
    }
    return {
        "tag": tags,
        "bomb": bombs,
        "not a text of YAML": bytes_,
        "hostile name": names,
        "path to nowhere in a key": elsewhere,
    }


def _tables(marker: Path) -> dict[str, str | bytes]:
    """Name -> table of hearts."""
    key = "fibres.endo_deg"
    return {
        "empty": "",
        "a header alone": f"case,{key}\n",
        "no column": "\n1\n",
        "a column that is no key": "case,fibres.endo\na,60\n",
        "a column of no section": "case,__class__\na,60\n",
        "a column twice": f"{key},{key}\n60,50\n",
        "an id twice": f"case,{key}\na,60\na,50\n",
        "two rows the same": f"{key}\n60\n60\n",
        "an id that is a path": f"case,{key}\n../../x,60\n",
        "an id of a shell": f"case,{key}\n$(touch {marker}),60\n",
        "an id of a wildcard": f"case,{key}\n{{case}},60\n",
        "an id of a long name": f"case,{key}\n{'a' * 300},60\n",
        "a formula": f"case,{key}\n=cmd|'/c calc'!A1,60\n",
        "NaN": f"{key}\nnan\n",
        "infinity": f"{key}\n1e999\n",
        "a text for a number": f"{key}\nsixty\n",
        "a comma for a point": f'{key}\n"60,5"\n',
        "semicolons": f"case;{key}\na;60\n",
        "tabs": f"case\t{key}\na\t60\n",
        "a cell too few": f"case,{key}\na\n",
        "a cell too many": f"case,{key}\na,60,70\n",
        "a quote without end": f'case,{key}\n"a,60\n',
        "a NUL": f"case,{key}\na\0b,60\n",
        "latin-1": f"case,{key},note\na,60,\xe4\n".encode("latin-1"),
        "UTF-16": f"case,{key}\na,60\n".encode("utf-16"),
        "binary": bytes(range(256)) * 20,
        "a cell of a megabyte": f"case,{key},note\na,60,{'x' * 1_000_000}\n",
        "too many rows": f"{key}\n" + "".join(f"{n / 2000}\n" for n in range(110_000)),
        "too many columns": ",".join(f"label.l{n}" for n in range(20_000)) + "\n",
        "YAML in a cell": f"case,geometry\na,!!python/object/apply:os.system ['touch {marker}']\n",
        "a key of paths": "case,geometry.file\na,/dev/zero\n",
    }


def _places(folder: Path) -> dict[str, Path]:
    """Name -> what is no file of YAML."""
    made = {name: folder / f"{name}.yaml" for name in ("missing", "folder", "pipe", "loop", "dangling", "zero")}
    made["folder"].mkdir()
    (made["folder"] / "note.txt").write_text("no repository")
    os.mkfifo(made["pipe"])
    made["loop"].symlink_to(made["loop"])
    made["dangling"].symlink_to("nowhere")
    made["zero"].symlink_to("/dev/zero")
    return made | {"a long path": folder / ("a" * 3000 + ".yaml")}
