"""Small valid files, mutated from a seed: each is accepted as it stands, or refused in a sentence, and none is run."""

import io
import math
import os
import pickle
import re
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml
from PIL import Image

import echotruth as et
from echotruth.cases import expand
from echotruth.config.loading import load
from echotruth.config.motion import FileMotion
from echotruth.config.tracking import External
from echotruth.mechanics.geometry import GeometryError, left_ventricle
from echotruth.mechanics.motion_file.series import read_series
from echotruth.mechanics.prescribed import MotionError
from echotruth.sharing.export import Export
from echotruth.tracking import track

SEED, LONGEST_LINE = 38, 900
SHIPPED = Path(__file__).parents[1] / "config"
FILM = np.random.default_rng(1).integers(0, 256, (4, 24, 32), np.uint8)
VALUES = ["-1", "0", "1e308", "-1e-308", "nan", ".inf", "999999999999", "9223372036854775807", "text", "''", "[]", "{}"]
VALUES += [
    "../../etc/passwd",
    "'$(touch marker)'",
    "!!python/object/apply:os.mknod [marker]",
    "&a [*a]",
    "0x7f",
    "1:30",
]


@pytest.fixture(autouse=True)
def nothing_is_run(tmp_path, monkeypatch):
    """Code in an input would make a file."""
    monkeypatch.chdir(tmp_path)
    yield
    assert not Path("marker").exists()


class Touching:
    """What makes a file when it is unpickled."""

    def __reduce__(self):
        return os.mknod, ("marker",)


def spoiled(content, random):
    """Bytes of which some are cut off, changed, left out or put in, most often at the beginning, where sizes are."""
    place, size = int(len(content) * random.random() ** 4), int(random.integers(1, 9))
    head, tail = content[:place], content[place:]
    flipped = bytes([tail[0] ^ 1 << int(random.integers(8))]) + tail[1:]
    filled = bytes([(0, 255, 127, 128)[random.integers(4)]]) * size + tail[size:]
    changed = (b"", flipped, filled, filled, tail[size:], random.bytes(size) + tail)
    return head + changed[random.integers(len(changed))]


def reworded(content, random):
    """A text in which another value stands for a number or a word."""
    text = content.decode()
    found = list(re.finditer(r"(?<=[\s:,\[\"])[-\w.]+(?=[\s,\]}\"])", text))
    chosen = found[int(len(found) * random.random() ** 2)]
    return (text[: chosen.start()] + VALUES[random.integers(len(VALUES))] + text[chosen.end() :]).encode()


def mutants(content, number, *ways):
    random = np.random.default_rng(SEED)
    return [ways[n % len(ways)](content, random) for n in range(number)]


def refusals(path, contents, is_sound, error):
    """How many contents of a file are refused; what is read of the others must be sound, and all else is a fault."""
    refused = 0
    for number, content in enumerate(contents):
        path.write_bytes(content)
        what = f"content {number} of {path.name}"
        with warnings.catch_warnings(action="ignore"):
            warnings.simplefilter("error", RuntimeWarning)
            try:
                assert is_sound(path), f"{what}: was accepted"
            except error as said:
                lines, refused = str(said).splitlines(), refused + 1
                assert lines and max(map(len, lines)) <= LONGEST_LINE, (what, lines)
                assert len(lines) == 1 or error is et.ConfigError, (what, lines)  # which has a line for each key
            except Exception as fault:
                raise AssertionError(f"{what}: {type(fault).__name__}: {fault}") from fault
    return refused


def array_file(content=b"", **header):
    """A .npy file whose header says what it likes."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False} | header)
    return file.getvalue() + content


def archive(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


TOUCHING = pickle.dumps(Touching())
BAD_ARRAYS = [array_file(shape=(10**6, 10**4, 11368)), array_file(TOUCHING, shape=(4, 2, 2), descr="|O"), TOUCHING]
BAD_ARRAYS += [b"PK\x03\x04" + bytes(30), b"\x93NUMPY\x01\x00\x10\x00{'descr': (((    \n"]


@pytest.mark.parametrize("name", ["demo", "human", "sweep", "hearts"])
def test_configuration_is_refused_or_read_as_it_is_written(name, tmp_path):
    path = tmp_path / f"{name}.yaml"

    def leaves(values, key=()):
        if not isinstance(values, dict | list):
            return {key: values}
        items = values.items() if isinstance(values, dict) else enumerate(values)
        return {place: leaf for part, value in items for place, leaf in leaves(value, (*key, part)).items()}

    def is_as_written(path):
        expand(config := load(path))
        found = leaves(config.model_dump(mode="json"))
        given = leaves(yaml.safe_load(path.read_bytes()) or {})
        same = all(found[key] == value or isinstance(value, str) for key, value in given.items() if key in found)
        return same and all(math.isfinite(value) for value in found.values() if isinstance(value, float))

    without_comments = re.sub(rb"(?m)(^| +)#.*$", b"", (SHIPPED / path.name).read_bytes())
    contents = mutants(without_comments, 24, reworded, reworded, spoiled)
    assert refusals(path, contents, is_as_written, et.ConfigError) > 5


@pytest.mark.parametrize(("suffix", "number"), [("msh", 30), ("vtu", 2), ("vtk", 2)])
def test_mesh_is_refused_or_whole(suffix, number, coarse_mesh, tmp_path):
    path, options = tmp_path / f"wall.{suffix}", {"file_format": "gmsh22"} if suffix == "msh" else {}
    used, cells = np.unique(coarse_mesh.cells[:, :4], return_inverse=True)
    mesh = meshio.Mesh(1e3 * coarse_mesh.nodes[used], [("tetra", cells.reshape(-1, 4))])
    meshio.write(path, mesh, binary=False, **options)

    def is_whole(path):
        mesh = left_ventricle(et.configure(geometry={"file": str(path), "unit": "mm"}).geometry)
        corner = mesh.nodes[mesh.cells[:, :4]]
        return np.isfinite(mesh.nodes).all() and np.linalg.det(corner[:, 1:] - corner[:, :1]).min() > 0

    contents = mutants(path.read_bytes(), number, reworded, spoiled)
    assert refusals(path, contents, is_whole, GeometryError) > number / 3


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
def test_motion_is_refused_or_of_the_points(suffix, tmp_path):
    positions = np.random.default_rng(2).random((4, 9, 3))
    sound = array_file(positions.tobytes(), shape=positions.shape) if suffix == ".npy" else archive(positions=positions)
    contents = [*BAD_ARRAYS, *mutants(sound, 40, spoiled)]

    def is_of_points(path):
        return read_series(FileMotion(path=str(path)), positions[0]).positions.shape[1:] == (9, 3)

    assert refusals(tmp_path / f"a{suffix}", contents, is_of_points, MotionError) > 9


def test_result_of_a_tracker_is_refused_or_of_the_points(tmp_path):
    moved = np.zeros((4, 2, 2))
    far = np.array([0, 1e308, 0, 0])[:, None, None] + moved
    wrong = (moved[:3], moved.astype(str), moved + 1j, moved + np.inf, moved + 1e308, far, moved[0, 0, 0])
    contents = [*BAD_ARRAYS, *(archive(displacement=values) for values in wrong)]
    contents += mutants(archive(displacement=moved, quality=moved[..., 0]), 40, spoiled)

    def is_near(path):
        settings = External(command=["sh", "-c", f"cp {path} {{output}}  # {{input}}"])
        found = track(FILM, np.array([[10.0, 8.0], [12.0, 9.0]]), FILM[0] > 9, 1e-4, np.arange(4.0), 1, settings)[0]
        return np.nanmax(abs(found)) < 1e7

    assert refusals(tmp_path / "a.npz", contents, is_near, et.TrackerFailed) > 20


def test_clip_is_refused_or_an_echo(tmp_path):
    pytest.importorskip("nibabel").Nifti1Image(FILM.T, np.eye(4)).to_filename("clip.nii")
    pytest.importorskip("pydicom")
    work = Export(et.sample(), "dicom", cases=["healthy"], views=["mid"], output=tmp_path / "clip.dcm")
    list(work.write(work.clips()[0]))
    np.save("clip.npy", FILM.astype(np.float32))
    first, *others = map(Image.fromarray, FILM)
    for suffix in ("gif", "tif"):
        first.save(f"clip.{suffix}", save_all=True, append_images=others)

    def is_echo(path):
        clip = et.read_clip(path, **({} if path.suffix == ".dcm" else {"spacing_mm": 0.1, "frame_time_ms": 10}))
        return (
            clip["image"].dtype == np.uint8 and (np.diff(clip["time"]) > 9e-6).all() and clip.attrs["spacing"] < 0.011
        )

    for path in map(Path, ("clip.npy", "clip.gif", "clip.tif", "clip.nii", "clip.dcm")):
        contents = mutants(path.read_bytes(), 60, spoiled) + (BAD_ARRAYS if path.suffix == ".npy" else [])
        assert refusals(path, contents, is_echo, et.EchoError) > 5
