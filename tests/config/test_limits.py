"""Files that are malformed or too large are refused at once, in one sentence that says the remedy."""

import gzip
import os
import sys

import pytest

from echotruth import cli
from echotruth.config.limits import MAX_CASES
from echotruth.config.loading import ConfigError, load
from echotruth.config.reading import MAX_BYTES

LARGE = {
    "cases in a product": (
        "cases: {" + ", ".join(f"fibres.{k}_deg: {[0.01 * n for n in range(2000)]}" for k in ("endo", "epi")) + "}",
        "makes 2000 x 2000 cases: list fewer values, because a repository has at most 100000",
    ),
    "views": ("views:\n" + "".join(f"  v{n}: {{}}\n" for n in range(20_000)), "must have at most 64 entries"),
    "trackers": (
        "tracking:\n  trackers:\n" + "".join(f"    t{n}: {{}}\n" for n in range(20_000)),
        "at most 64 entries",
    ),
    "text": ("name: " + "a" * 3_000_000, "should have at most 60 characters"),
    "name of a key": ("? " + "a" * 3_000_000 + "\n: 1", "is not a key: the keys here are"),
    "bytes": ("# " + "x" * MAX_BYTES, "holds 4.0 MiB: a configuration has at most 4 MiB"),
}

MALFORMED = {
    "a list as a key": ("? [a, b]\n: 1", "line 1: found unhashable key: correct the YAML"),
    "a mapping as a key": ("geometry:\n  ? {a: b}\n  : 1", "line 2: found unhashable key: correct the YAML"),
    "a number as a key": ("1: 2", "1 = 1: is not a key: keys are text"),
    "null as a key": ("~: 2", "is not a key: keys are text"),
    "a key twice": ("geometry:\n  scale: 1\n  scale: 2", "line 3: key 'scale' is given twice: give it once"),
    "a tab": ("geometry:\n\tscale: 1", "line 2: found character that cannot start any token: indent by spaces"),
    "NUL": ("name: a\0b", "holds a control character, which is not text: write plain UTF-8 text"),
    "a list": ("- 3", "contains a list: write a mapping of keys to values"),
    "text": ("hello", "contains text: write a mapping of keys to values"),
    "a number": ("3", "contains a single value: write a mapping of keys to values"),
    "two documents": ("seed: 1\n---\nseed: 2", "write one document, without a second line of ---"),
    "an unknown tag": ("seed: !mine 1", "line 1: could not determine a constructor for the tag '!mine'"),
    "a date": ("seed: 2020-99-99", "seed = '2020-99-99': must be a whole number"),
    "not an integer": ("seed: !!int hello", "cannot be read (invalid literal for int() with base 10: 'hello')"),
    "not a truth value": ("seed: !!bool hello", "cannot be read ('hello'): correct the YAML"),
    "an unknown alias": ("seed: *nope", "line 1: found undefined alias: correct the YAML"),
    "an unclosed quote": ("name: 'abc", "found unexpected end of stream: correct the YAML"),
    "a reserved character": ("name: @a", "put text that begins with a special character in quotes"),
    "a line break in a key": ('"a\\nb": 1', "a\\nb is not a key"),
    "a line break in a name": ('views: {"mid\\n": {}}', "use letters, digits and underscores only"),
    "a section that is a number": ("bmode: 3", "bmode = 3: must be a mapping of keys to values"),
    "a short list": ("motion: {affine: {gradient: [[1]]}}", "gradient.0 = [1]: must have 3 entries or more"),
}

ABSURD = {
    "phantom: {density_per_mm3: 1.0e+30}": "density_per_mm3 = 1e+30: should be less than or equal to 1000000",
    "loop: {frames: 1000000}": "loop.frames = 1000000: should be less than or equal to 1000",
    "loop: {heart_rate_per_min: 1.0e-300}": "heart_rate_per_min = 1e-300: should be greater than or equal to 1",
    "loop: {edv_uL: 1.0e+300}": "loop.edv_uL = 1e+300: should be less than or equal to 100000000",
    "bmode: {size_px: 1000000}": "bmode.size_px = 1000000: should be less than or equal to 4096",
    "bmode: {field_of_view_mm: 1.0e+12}": "field_of_view_mm = 1000000000000.0: should be less than or equal to 1000",
    "probe: {elements: 100000}": "probe.elements = 100000: should be less than or equal to 512",
    "probe: {frequency_MHz: 1.0e+12}": "frequency_MHz = 1000000000000.0: should be less than or equal to 1000",
    "probe: {sampling_MHz: 1.0e+12}": "sampling_MHz = 1000000000000.0: should be less than or equal to 10000",
    "rf: {lines: 100000}": "rf.lines = 100000: should be less than or equal to 2048",
    "geometry: {circumferential_elements: 600000}": "should be less than or equal to 120",
    "geometry: {wall_mm: 1.0e+300}": "geometry.wall_mm = 1e+300: should be less than or equal to 1000000000000",
    "fibres: {layers: 1000000}": "fibres.layers = 1000000: should be less than or equal to 24",
}


@pytest.mark.parametrize("what", LARGE)
def test_too_much_is_refused(refusal, what):
    text, sentence = LARGE[what]
    message = refusal(text)
    assert sentence in message
    assert len(message) < 600


@pytest.mark.parametrize("what", MALFORMED)
def test_malformed_yaml_is_refused_with_what_would_be_right(refusal, what):
    text, sentence = MALFORMED[what]
    assert sentence in refusal(text)


@pytest.mark.parametrize("text", ABSURD)
def test_absurd_value_is_refused_by_its_own_bound(refusal, text):
    assert ABSURD[text] in refusal(text)


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


def test_largest_sweep_is_accepted_and_one_value_more_is_not(tmp_path):
    file = tmp_path / "sweep.yaml"
    angles = [round(0.5 * n, 1) for n in range(100)]
    file.write_text(f"cases: {{fibres.endo_deg: {angles}, seed: {list(range(MAX_CASES // 100))}}}")
    assert len(load(file).cases.grid["seed"]) == MAX_CASES // 100
    file.write_text(f"cases: {{fibres.endo_deg: {angles}, seed: {list(range(MAX_CASES // 100 + 1))}}}")
    with pytest.raises(ConfigError, match="makes 100 x 1001 cases"):
        load(file)


@pytest.mark.parametrize("command", ["check", "cases", "run"])
@pytest.mark.parametrize("text", ["? [a, b]\n: 1", "seed: !!int a"])
def test_commands_refuse_a_malformed_file_in_one_sentence(tmp_path, monkeypatch, command, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.yaml").write_text(text)
    monkeypatch.setattr(sys, "argv", ["echotruth", command, "bad.yaml"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert str(ended.value).startswith("echotruth: bad.yaml")
    assert os.listdir(tmp_path) == ["bad.yaml"]
