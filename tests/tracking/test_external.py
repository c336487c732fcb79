"""External trackers: what they receive, and one sentence for every way in which they fail."""

import re
import sys
import time
import tracemalloc
import zipfile
from datetime import date
from pathlib import Path

import numpy as np
import pytest
import yaml

from echotruth.config.loading import ConfigError, validate
from echotruth.config.tracking import TRACKER_ARGUMENTS, External
from echotruth.tracking import TrackerFailed
from echotruth.tracking import track as track_any
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers import external as external_module

TIMES, POINTS = 3, 4


def track(frames, points, mask, spacing, frame_time, seed, settings):
    """What the tracker returns, before points without a displacement are marked."""
    return external_module.track(TrackerInput(frames, points, mask, spacing, frame_time, seed), settings)


@pytest.fixture
def arguments():
    """Clip, points, mask, spacing, times and seed."""
    frames = np.random.default_rng(1).integers(0, 256, (TIMES, 20, 24)).astype(np.uint8)
    points = np.array([[3.0, 4.0], [5.5, 4.25], [10.0, 12.0], [20.0, 7.0]])
    return frames, points, frames[0] > 100, 2.3e-5, np.array([0.0, 0.01, 0.03]), 5


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write a module into the current directory, which is a new one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])

    def write(name, body):
        monkeypatch.delitem(sys.modules, name, raising=False)
        Path(f"{name}.py").write_text(f"import numpy as np\n\ndef track(*arguments, **options):\n    {body}\n")
        return f"{name}:track"

    return write


@pytest.fixture
def external(monkeypatch):
    """Settings of an external tracker that is a function of this process."""

    def settings(function, **options):
        monkeypatch.setitem(sys.modules, "tracker_module", type(sys)("tracker_module"))
        sys.modules["tracker_module"].track = function
        return External(track="tracker_module:track", options=options)

    return settings


def program(folder, body, *words, **settings):
    """Settings of an external tracker that is a Python program."""
    path = folder / "program.py"
    path.write_text(f"import sys\nimport numpy as np\ninput, output = sys.argv[1:3]\n{body}\n")
    return External(command=[sys.executable, str(path), "{input}", "{output}", *words], **settings)


def failure(arguments, settings):
    """The sentence with which a tracker fails, without its name."""
    with pytest.raises(TrackerFailed) as raised:
        track(*arguments, settings)
    sentence = str(raised.value)
    assert sentence.startswith(settings.track or " ".join(settings.command))
    assert "\n" not in sentence
    return sentence.removeprefix(settings.track or " ".join(settings.command)).strip()


def test_callable_gets_the_clip_and_its_options_and_nothing_else(arguments, external):
    seen = {}

    def tracker(*received, **options):
        seen.update(zip(TRACKER_ARGUMENTS, received, strict=True), options=options)
        return np.zeros((TIMES, POINTS, 2))

    track(*arguments, external(tracker, window=[3, 4], name="a"))
    assert seen["options"] == {"window": [3, 4], "name": "a"}
    for name, value in zip(TRACKER_ARGUMENTS, arguments, strict=True):
        np.testing.assert_array_equal(seen[name], value)
        assert np.asarray(seen[name]).dtype == np.asarray(value).dtype


def test_tracker_cannot_change_the_arguments_of_others(arguments, external):
    def tracker(*arrays):
        for array in arrays:
            if isinstance(array, np.ndarray):
                array[...] = 0
        return np.zeros((TIMES, POINTS, 2))

    before = [np.copy(each) for each in arguments]
    track(*arguments, external(tracker))
    for array, kept in zip(arguments, before, strict=True):
        np.testing.assert_array_equal(array, kept)


def test_quality_left_out_is_unknown(arguments, external):
    moved = np.zeros((TIMES, POINTS, 2), np.float32)
    moved[1:, 2, 0] = np.nan
    displacement, quality = track(*arguments, external(lambda *_: moved))
    np.testing.assert_array_equal(displacement, moved)
    assert quality.shape == (TIMES, POINTS) and np.isnan(quality).all()


@pytest.mark.parametrize("nested", [False, True])
def test_masked_value_is_no_displacement(arguments, external, nested):
    moved = np.ma.array(np.full((TIMES, POINTS, 2), 0.5), mask=False)
    moved[1:, 2] = np.ma.masked
    displacement, _ = track(*arguments, external(lambda *_: list(moved) if nested else moved))
    assert np.isnan(displacement[1:, 2]).all() and np.isnan(displacement).sum() == 4


def test_point_lost_by_a_tracker_has_neither_displacement_nor_quality(arguments, external):
    moved = np.zeros((TIMES, POINTS, 2))
    moved[1, 3, 1] = np.inf
    displacement, quality = track_any(*arguments, external(lambda *_: (moved, np.full((TIMES, POINTS), 0.5))))
    assert np.isnan(displacement[1, 3]).all() and np.isnan(quality[1, 3])
    assert np.isfinite(quality).sum() == TIMES * POINTS - 1


def raising(error):
    def tracker(*_):
        raise error

    return tracker


def filled(value, *shape, dtype=float):
    return lambda *_: np.full(shape or (TIMES, POINTS, 2), value, dtype)


BAD = {
    "exception": (raising(ValueError("no\nwall")), r"^raised ValueError: no wall \(test_external.py, line \d+\)$"),
    "end of the interpreter": (raising(SystemExit(3)), "raised SystemExit: 3"),
    "too few arguments": (lambda frames, points: None, r"raised TypeError: .* positional arguments .* were given$"),
    "nothing": (lambda *_: None, "displacement of NoneType, not of real numbers"),
    "other shape": (filled(0, POINTS, TIMES, 2), r"shape \(4, 3, 2\), not \(3, 4, 2\)"),
    "ragged": (lambda *_: [[1, 2], [3]], "displacement that is not an array of shape"),
    "words": (filled("a", dtype=str), "displacement of <U1, not of real numbers"),
    "nowhere finite": (filled(np.nan), "no finite displacement after frame 0"),
    "positions": (filled(12.0), r"displacement of 17.0 px in frame 0.*not positions"),
    "three parts": (lambda *_: (1, 2, 3), "tuple of 3"),
    "quality of another shape": (
        lambda *_: (np.zeros((TIMES, POINTS, 2)), np.ones(POINTS)),
        r"quality of shape \(4,\)",
    ),
    "quality in percent": (
        lambda *_: (np.zeros((TIMES, POINTS, 2)), np.full((TIMES, POINTS), 90)),
        "quality from 90 to 90, not from 0 to 1",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_invalid_result_is_explained_in_one_sentence(arguments, external, case):
    tracker, expected = BAD[case]
    assert re.search(expected, failure(arguments, external(tracker)))


def test_interrupt_is_not_swallowed(arguments, external):
    with pytest.raises(KeyboardInterrupt):
        track(*arguments, external(raising(KeyboardInterrupt())))


def test_module_of_the_current_directory_is_found(arguments, module):
    settings = External(
        track=module("mypackage", "return np.zeros((3, 4, 2)) + options['shift'] * np.arange(3)[:, None, None]"),
        options={"shift": 2},
    )
    assert (track(*arguments, settings)[0] == 2 * np.arange(3)[:, None, None]).all()


@pytest.mark.parametrize(
    "name, expected",
    [
        ("nowhere_at_all:track", "cannot be imported: ModuleNotFoundError"),
        ("numpy:pi", "raised TypeError: 'float' object is not callable"),
        ("nobody", "not an entry point of the group echotruth.trackers .*write package.module:function"),
    ],
)
def test_unknown_name_is_explained_in_one_sentence(arguments, name, expected):
    assert re.search(expected, failure(arguments, External(track=name)))


def test_installed_package_brings_a_tracker_as_an_entry_point(arguments, module, tmp_path):
    module("mypackage", "return np.zeros((3, 4, 2))")
    metadata = tmp_path / "mypackage-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: mypackage\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[echotruth.trackers]\nat-rest = mypackage:track\n")
    sys.path.insert(0, str(tmp_path))
    assert not track(*arguments, External(track="at-rest"))[0].any()
    assert "(installed: at-rest)" in failure(arguments, External(track="atrest"))


WRITES = "np.savez(output, displacement=np.zeros((3, 4, 2)), quality=np.full((3, 4), 0.25))"


def test_program_reads_the_clip_and_its_options_and_writes_its_result(arguments, tmp_path):
    body = f"""
import shutil
shutil.copy(input, sys.argv[3])
{WRITES}"""
    options = {"window": 7, "scales": [1.0, 0.5], "norm": "l1", "file": True}
    displacement, quality = track(*arguments, program(tmp_path, body, str(tmp_path / "seen.npz"), options=options))
    seen = dict(np.load(tmp_path / "seen.npz"))
    assert set(seen) == {*TRACKER_ARGUMENTS, *options}
    for name, value in (*zip(TRACKER_ARGUMENTS, arguments, strict=True), *options.items()):
        np.testing.assert_array_equal(seen[name], value)
    assert not displacement.any() and (quality == 0.25).all()


def shell(script):
    """Settings of an external tracker that is a shell script, of which the output is $1."""
    return External(command=["sh", "-c", script, "{input}", "{output}"])


@pytest.mark.parametrize(
    "script, expected",
    [
        ("echo first; echo 'ValueError: no wall' >&2; exit 1", "ended with status 1: ValueError: no wall"),
        ("kill -9 $$", "was ended by signal 9"),
        ("true", "wrote no {output}, an .npz file with displacement"),
        ('echo hello > "$1"', "wrote an {output} that cannot be read as .npz"),
    ],
)
def test_failure_of_a_program_is_explained_in_one_sentence(arguments, script, expected):
    assert expected in failure(arguments, shell(script))


def writing(path):
    """Settings of a program that writes a copy of a file."""
    return shell(f"cp {path} $1")


def test_output_that_holds_no_displacement_is_explained_in_one_sentence(arguments, tmp_path):
    path, none = tmp_path / "a.npz", np.zeros((TIMES, POINTS, 2))
    np.savez_compressed(path, displacement=none)
    content = bytearray(path.read_bytes())
    content[66:70] = 4 * [255]  # where the compressed data begin
    path.write_bytes(content)
    assert "wrote an {output} that cannot be read as .npz" in failure(arguments, writing(path))
    for arrays, expected in (
        ({"motion": none}, "wrote an {output} without displacement"),
        ({"displacement": np.array([None])}, "wrote an {output} with a displacement of object, not of"),
        ({"displacement": none[0]}, "displacement of shape (4, 2), not (3, 4, 2)"),
    ):
        np.savez(path, **arrays)
        assert expected in failure(arguments, writing(path))
    np.savez(path, displacement=none)
    assert np.isnan(track(*arguments, writing(path))[1]).all()  # the quality may be left out


def npz(path, name, header, content=b"", method=zipfile.ZIP_DEFLATED):
    """Write an .npz file with one entry, of which the header may be a lie."""
    with zipfile.ZipFile(path, "w", method) as archive, archive.open(f"{name}.npy", "w") as entry:
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False} | header)
        entry.write(content)
    return path


@pytest.mark.parametrize("name, shape", [("displacement", (TIMES, POINTS, 2)), ("quality", (TIMES, POINTS))])
def test_header_that_claims_terabytes_is_refused_before_its_array_is_read(arguments, tmp_path, name, shape):
    path = npz(tmp_path / "huge.npz", name, {"shape": (10**12,)})
    if name == "quality":
        np.savez(tmp_path / "displacement.npz", displacement=np.zeros((TIMES, POINTS, 2)))
        with zipfile.ZipFile(tmp_path / "displacement.npz") as good, zipfile.ZipFile(path, "a") as archive:
            archive.writestr("displacement.npy", good.read("displacement.npy"))
    expected = f"wrote an {{output}} with a {name} of shape (1000000000000,), not {shape}"
    assert failure(arguments, writing(path)).endswith(expected)


@pytest.mark.parametrize(
    "method, expected", [(zipfile.ZIP_DEFLATED, "of shape"), (zipfile.ZIP_LZMA, "than by deflate")]
)
def test_archive_that_unpacks_to_far_more_is_not_unpacked(arguments, tmp_path, method, expected):
    path = npz(tmp_path / "bomb.npz", "displacement", {"shape": (2**22, 2)}, bytes(2**26), method)
    tracemalloc.start()
    assert expected in failure(arguments, writing(path))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**22


def test_process_that_holds_stderr_open_is_not_waited_for(arguments):
    start = time.monotonic()
    script = "setsid sleep 20 & echo no wall >&2; exit 1"
    assert failure(arguments, shell(script)) == "ended with status 1: no wall"
    assert time.monotonic() - start < 10


def test_missing_program_is_explained_in_one_sentence(arguments):
    settings = External(command=["no_such_program", "{input}", "{output}"])
    assert failure(arguments, settings) == "did not start: no_such_program: No such file or directory"


def test_program_that_takes_too_long_is_ended_with_all_it_started(arguments, tmp_path):
    beat = tmp_path / "beat"
    settings = shell(f"while true; do echo . >> {beat}; sleep 0.02; done & sleep 60")
    settings = settings.model_copy(update={"timeout_s": 0.5})
    assert failure(arguments, settings) == "took longer than timeout_s = 0.5"
    beats = beat.stat().st_size
    time.sleep(0.2)
    assert beats and beat.stat().st_size == beats


PROGRAM = {"command": ["prog", "{input}", "{output}"]}


@pytest.mark.parametrize(
    "settings, expected",
    [
        ({}, "track = null: give either track or command"),
        ({"command": ["prog", "{input}"]}, "must contain {output} where the path of that file belongs"),
        ({"track": "a:b", "options": {"frames": 3}}, "options.frames = 3: must have another name"),
        (PROGRAM | {"options": {"a": {"b": 1}}}, "options.a = {'b': 1}: must be a number"),
        (PROGRAM | {"options": {"a": 2**63}}, "options.a = 9223372036854775808: must be a number of 64 bits"),
        ({"track": "./own.py:track"}, "'./own.py:track': write package.module:function (dots, no path, no .py)"),
        ({"track": "a:b", "options": {"a": [1, "1e999"]}}, "options.a = [1, inf]: must be finite numbers, text"),
        ({"track": "a:b", "options": {"a": date(2026, 1, 1)}}, "options.a = datetime.date(2026, 1, 1): must be finite"),
        ({"track": "a:b", "timeout_s": 0}, "timeout_s = 0: should be greater than 0"),
    ],
)
def test_invalid_settings_are_refused_in_one_sentence(settings, expected):
    with pytest.raises(ConfigError) as refusal:
        validate({"tracking": {"trackers": {"mine": {"method": "external"} | settings}}}, "a.yaml")
    assert str(refusal.value).startswith("a.yaml: tracking.trackers.mine.") and expected in str(refusal.value)


def test_callable_takes_options_that_are_not_arrays():
    options = {"weights": None, "layers": {"first": [1, "a"]}}
    config = validate(
        {"tracking": {"trackers": {"mine": {"method": "external", "track": "a:b", "options": options}}}}, ""
    )
    assert config.tracking.trackers["mine"].options == options


def test_option_without_a_dot_is_a_number_in_a_configuration_too():
    options = yaml.safe_load("{rate: 1e-3, steps: [2e2, .5E+1], name: e-3, word: 0x1e5g}")
    assert options["rate"] == "1e-3"
    assert External(track="a:b", options=options).options == {
        "rate": 0.001,
        "steps": [200.0, 5.0],
        "name": "e-3",
        "word": "0x1e5g",
    }


def test_output_of_a_tracker_goes_to_stderr(arguments, external, tmp_path, capfd):
    def tracker(*_):
        print("chatter")
        return np.zeros((TIMES, POINTS, 2))

    track(*arguments, external(tracker))
    np.savez(tmp_path / "a.npz", displacement=np.zeros((TIMES, POINTS, 2)))
    track(*arguments, shell(f"echo prattle; cp {tmp_path}/a.npz $1"))
    stdout, stderr = capfd.readouterr()
    assert stdout == "" and "chatter" in stderr and "prattle" in stderr
