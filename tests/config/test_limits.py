"""Files that are malformed, hostile or absurdly large are refused at once, in one sentence that says the remedy."""

import gzip
import os
import subprocess
import sys
from math import pi

import numpy as np
import pytest

from echotruth import cli
from echotruth.config import Config
from echotruth.config.amounts import ventricle_mm3
from echotruth.config.loading import ConfigError, load, override, validate
from echotruth.config.reading import MAX_BYTES, MAX_DEPTH, MAX_VALUES
from echotruth.config.table import MAX_CASES
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics.geometry import left_ventricle


def bomb(key, aliases=9):
    """YAML of lists of aliases of lists, 9^9 values from a thousand characters."""
    levels = [f"  - &a{n} [{', '.join([f'*a{n - 1}'] * aliases)}]" for n in range(1, 9)]
    return "\n".join([f"{key}:", f"  - &a0 [{', '.join('1' * aliases)}]", *levels])


def indented(text, spaces):
    return "\n".join(" " * spaces + line for line in text.splitlines())


TRACKER = "tracking:\n  trackers:\n    mine:\n      method: external\n      track: a:b\n      options:\n"

BOMBS = {
    "a key that there is not": (bomb("x"), "x holds too much: give at most 100000 values"),
    "a section": (bomb("geometry"), "geometry holds too much"),
    "the values of a case": ("cases:\n" + indented(bomb("seed"), 2), "cases holds too much"),
    "the options of a tracker": (TRACKER + indented(bomb("x"), 8), "tracking holds too much"),
    "merged keys": ("geometry: {<<: {scale: 2}}", "geometry.<< is not a key"),
    "an alias in its anchor": ("geometry: &a\n  file: *a", "found unconstructable recursive node: correct the YAML"),
}

NESTED = {
    "lists": "cases: " + "[" * 3000 + "]" * 3000,
    "mappings": "a: " + "{a: " * 3000 + "}" * 3000,
    "unclosed lists": "[" * 100_000,
    "one level too many": "x: " + "[" * MAX_DEPTH + "]" * MAX_DEPTH,
}

LARGE = {
    "cases in a list": (f"cases: {{seed: [{', '.join(map(str, range(5_000_000 // 50)))}]}}", "the file holds too much"),
    "cases in a product": (
        "cases: {" + ", ".join(f"fibres.{k}_deg: {[0.01 * n for n in range(2000)]}" for k in ("endo", "epi")) + "}",
        "makes 2000 x 2000 cases: list fewer values, because a repository has at most 100000",
    ),
    "keys": ("".join(f"k{n}: 1\n" for n in range(MAX_VALUES)), "the file holds too much: give at most 100000 values"),
    "views": ("views:\n" + "".join(f"  v{n}: {{}}\n" for n in range(20_000)), "should have at most 64 items"),
    "text": ("name: " + "a" * 3_000_000, "should have at most 60 characters"),
    "name of a key": ("? " + "a" * 3_000_000 + "\n: 1", "is not a key: the keys here are"),
    "bytes": ("# " + "x" * MAX_BYTES, "holds 4.0 MiB, and a configuration at most 4 MiB"),
    "integer": ("seed: " + "9" * 5000, "is not YAML (Exceeds the limit"),
}

MALFORMED = {
    "a list as a key": ("? [a, b]\n: 1", "line 1: found unhashable key: correct the YAML"),
    "a number as a key": ("1: 2", "1 = 1: is not a key: keys are text"),
    "a key twice": ("geometry:\n  scale: 1\n  scale: 2", "line 3: key 'scale' is given twice: give it once"),
    "a tab": ("geometry:\n\tscale: 1", "line 2: found character that cannot start any token: correct the YAML"),
    "NUL": ("name: a\0b", "is not YAML (unacceptable character"),
    "a list": ("- 3", "contains a list: write a mapping of keys to values"),
    "two documents": ("seed: 1\n---\nseed: 2", "line 2: but found another document: correct the YAML"),
    "a Python object": (
        "name: !!python/object/apply:os.system [ls]",
        "the tag python/object/apply:os.system is not re",
    ),
    "an unknown tag": ("seed: !mine 1", "line 1: the tag !mine is not read: leave it out"),
    "a date": ("seed: 2020-99-99", "seed = '2020-99-99': must be a whole number"),
    "a number with a tag": ("seed: !!int 3", "line 1: the tag int is not read: leave it out"),
    "an unclosed quote": ("name: 'abc", "found unexpected end of stream: correct the YAML"),
    "a line break in a key": ('"a\\nb": 1', "a\\nb is not a key"),
    "a line break in a name": ('views: {"mid\\n": {}}', "use letters, digits and underscores only"),
    "a section that is a number": ("bmode: 3", "bmode = 3: must be a mapping of keys to values"),
    "gains without ranges": ("bmode: {time_gain: {gain_dB: [1]}}", "must have one gain for each of the 0 ranges"),
    "ranges that decrease": (
        "bmode: {time_gain: {range_mm: [3, 2], gain_dB: [0, 1]}}",
        "bmode.time_gain.range_mm = [3.0, 2.0]: every range must be larger than the one before it",
    ),
    "a gain that leaves no image": ("bmode: {gain_dB: -55}", "must lie within dynamic_range_dB = 55"),
    "persistence without end": (
        "bmode: {persistence: 1}",
        "bmode.persistence = 1: should be less than or equal to 0.95",
    ),
    "a short list": ("motion: {affine: {gradient: [[1]]}}", "gradient.0 = [1]: should have at least 3 items"),
}

ABSURD = {
    "phantom: {density_per_mm3: 1.0e+30}": "density_per_mm3 = 1e+30: should be less than or equal to 1000000",
    "phantom: {density_per_mm3: 1.0e+6}": "density_per_mm3 = 1000000.0: must be at most ",
    "geometry: {scale: 4}\nphantom: {density_per_mm3: 1.5e+4}\nrf: {focus_mm: 15}\nbmode: {field_of_view_mm: 30}": (
        "phantom.density_per_mm3 = 15000.0: must be at most "
    ),
    "realism: {surroundings: {level_dB: 0, density: 1}}\nphantom: {density_per_mm3: 200000}": "must be at most ",
    "loop: {frames: 1000000}": "loop.frames = 1000000: should be less than or equal to 1000",
    "loop: {frames: 1000}\nbmode: {size_px: 4096}": "size_px = 4096: must be at most 1000 with loop.frames = 1000",
    "loop: {heart_rate_per_min: 1.0e-300}": "heart_rate_per_min = 1e-300: should be greater than or equal to 1",
    "bmode: {field_of_view_mm: 1.0e+12}": "field_of_view_mm = 1000000000000.0: should be less than or equal to 1000",
    "bmode: {field_of_view_mm: 1000}\nprobe: {elements: 512}": "at most 117 with 512 elements sampled at 100 MHz",
    "bmode: {field_of_view_mm: 900}\nloop: {frames: 1000}\nrf: {lines: 2048}": "with 1000 frames of 2048 lines sampled",
    "geometry: {wall_mm: 1.0e+300}": "geometry.wall_mm = 1e+300: should be less than or equal to 1000000000000",
}


SENTENCES = BOMBS | LARGE | MALFORMED
SENTENCES |= {what: (text, "nested too deeply: use at most 30 levels") for what, text in NESTED.items()}
SENTENCES |= {text: (text, sentence) for text, sentence in ABSURD.items()}


@pytest.mark.parametrize("what", SENTENCES)
def test_file_is_refused_in_a_short_sentence(refusal, what):
    text, sentence = SENTENCES[what]
    message = refusal(text)
    assert sentence in message and len(message) < 600


@pytest.mark.parametrize(
    "content",
    [b"name: d\xe9mo", "name: demo".encode("utf-16"), bytes(range(256)) * 50, gzip.compress(b"seed: 1")],
    ids=["latin1", "utf16", "random", "gzip"],
)
def test_bytes_that_are_not_text_are_refused(tmp_path, content):
    file = tmp_path / "bad.yaml"
    file.write_bytes(content)
    with pytest.raises(ConfigError, match=r"bad\.yaml: is not UTF-8 text: give the path of a YAML file"):
        load(file)


def test_pipe_is_refused_without_waiting_for_a_writer(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ConfigError, match="pipe: is not a file: give the path of a YAML file"):
        load(tmp_path / "pipe")


def test_folder_and_device_are_refused(tmp_path):
    for path in (tmp_path, "/dev/zero"):
        with pytest.raises(ConfigError, match="is not a file: give the path of a YAML file"):
            load(path)


def test_byte_order_mark_is_accepted(tmp_path):
    file = tmp_path / "good.yaml"
    file.write_bytes(b"\xef\xbb\xbfseed: 3\n")
    assert load(file).seed == 3


def test_values_that_are_already_read_meet_the_same_limits():
    levels = [1]
    for _ in range(9):
        levels = [levels] * 9
    recursive = []
    recursive.append(recursive)
    for values, sentence in (({"geometry": levels}, "holds too much"), ({"cases": recursive}, "nested too deeply")):
        with pytest.raises(ConfigError, match=f"dict: {next(iter(values))} .*{sentence}"):
            validate(values, "dict")


def test_largest_sweep_is_accepted_and_one_value_more_is_not(tmp_path):
    file = tmp_path / "sweep.yaml"
    angles = [round(0.5 * n, 1) for n in range(100)]
    file.write_text(f"cases: {{fibres.endo_deg: {angles}, seed: {list(range(MAX_CASES // 100))}}}")
    assert len(load(file).cases.grid["seed"]) == MAX_CASES // 100
    file.write_text(f"cases: {{fibres.endo_deg: {angles}, seed: {list(range(MAX_CASES // 100 + 1))}}}")
    with pytest.raises(ConfigError, match="makes 100 x 1001 cases"):
        load(file)


def test_bounds_leave_room_about_all_presets():
    for heart in ("mouse", "rat", "human"):
        config = validate({"geometry": {"preset": heart}}, heart)
        density = config.phantom.density_per_mm3
        # Ten times the scatterers, with blood and surroundings, and clips four times as long and as fine.
        finer = {"phantom.density_per_mm3": 10 * density, "loop.frames": 160, "bmode.size_px": 2048}
        tissue = {"realism.blood.level_dB": -30.0, "realism.surroundings.level_dB": -26.0}
        assert override(config, finer | tissue).loop.frames == 160


def test_every_hostile_file_is_refused_within_two_seconds_and_300_MiB(tmp_path):
    texts = [text for text, _ in (*BOMBS.values(), *LARGE.values(), *MALFORMED.values())]
    for number, text in enumerate([*texts, *NESTED.values(), *ABSURD]):
        (tmp_path / f"{number}.yaml").write_text(text)
    with (tmp_path / "sparse.yaml").open("wb") as file:
        file.truncate(10**10)
    limited = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from echotruth.config.loading import ConfigError, load\n"
        "for path in Path(sys.argv[1]).glob('*.yaml'):\n"
        "    start = time.process_time()\n"
        "    try:\n"
        "        load(path)\n"
        "        print(path, 'accepted')\n"
        "    except ConfigError as error:\n"
        "        len(str(error).splitlines()) > 21 and print(path, 'many lines')\n"
        "    if time.process_time() - start > 2:\n"
        "        print(path, 'slow')\n"
        # Not `ru_maxrss`, which a process inherits from the one that started it.
        "peak = Path('/proc/self/status').read_text().split('VmHWM:')[1].split()[0]\n"
        "if int(peak) > 300 * 1024:\n"
        "    print('memory', peak)\n"
    )
    command = [sys.executable, "-c", limited, str(tmp_path)]
    result = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert (result.stdout, result.stderr, result.returncode) == ("", "", 0)


@pytest.mark.parametrize("command", ["check", "cases", "run"])
@pytest.mark.parametrize("text", [bomb("geometry"), NESTED["lists"], "? [a, b]\n: 1", "seed: !!int a"])
def test_commands_refuse_a_hostile_file_in_one_sentence(tmp_path, monkeypatch, command, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.yaml").write_text(text)
    monkeypatch.setattr(sys, "argv", ["echotruth", command, "bad.yaml"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert str(ended.value).startswith("echotruth: bad.yaml")
    assert os.listdir(tmp_path) == ["bad.yaml"]


def test_volume_of_the_ventricle_is_that_of_its_mesh_and_of_a_half_ellipsoid():
    config = override(Config(), {"geometry.apex_wall_mm": 1.0, "geometry.longitudinal_elements": 24})
    cavity, whole = ventricle_mm3(config.geometry.lengths())
    mesh = left_ventricle(config.geometry)
    np.testing.assert_allclose(1e9 * cell_volumes(mesh.nodes, mesh.cells).sum(), whole - cavity, rtol=0.02)
    half = {"endo_radius_mm": 2.0, "endo_length_mm": 5.0, "wall_mm": 0.0, "apex_wall_mm": 0.0, "base_mm": 0.0}
    np.testing.assert_allclose(ventricle_mm3(half), [2 / 3 * pi * 2**2 * 5] * 2)
