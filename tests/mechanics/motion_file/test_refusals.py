"""Files that hold no heart, or no cycle of it, are refused in one sentence."""

import re
from dataclasses import dataclass, field

import numpy as np
import pytest
from affine_motion import FRAMES

from echotruth.mechanics.geometry import GeometryError
from echotruth.mechanics.motion_file.motion import motion_from_file
from echotruth.mechanics.prescribed import MotionError

PHASES = np.arange(FRAMES) / FRAMES


@dataclass
class Series:
    """A sound series, to be spoiled by a test."""

    positions: np.ndarray
    cells: np.ndarray
    section: dict
    folder: object
    configured: object
    geometry: dict = field(default_factory=dict)

    def refused(self, **section):
        """The sentence by which the series is refused."""
        with pytest.raises((MotionError, GeometryError)) as caught:
            motion_from_file(self.configured(self.section | section, **self.geometry))
        message = str(caught.value)
        assert "\n" not in message and len(message) < 500
        return message.replace(f"{self.folder}/", "")


@pytest.fixture
def series(affine_heart, write_series, configured, tmp_path):
    def make(format_, phases=PHASES, spoil=None):
        cells, positions = affine_heart.of_order[1][1], affine_heart.positions(1, phases)
        if spoil:
            spoil(positions)
        return Series(positions, cells, write_series(format_, positions, cells), tmp_path, configured)

    return make


def save(path, nodes, cells):
    """Write one frame anew."""
    import pyvista

    kind = {3: 5, 4: 10}[cells.shape[1]]
    pyvista.UnstructuredGrid({kind: cells.astype(np.int64)}, nodes).save(path)


def test_inverted_tetrahedra_with_their_frame(series):
    def spoil(positions):
        centre = positions[7].mean(axis=0)
        positions[7, 20] = 2 * centre - positions[7, 20]

    message = series("npy", spoil=spoil).refused()
    assert re.search(r"positions.npy, frame 7: \d+ of \d+ tetrahedra are inverted in frame 7 of motion.file", message)


def test_cells_that_change(series):
    made = series("vtu")
    save(made.folder / "frame_5.vtu", made.positions[5], made.cells[::-1])
    assert "frame_5.vtu: its tetrahedra are not those of frame_0.vtu" in made.refused()


def test_points_that_change_in_number(series):
    made = series("vtu")
    save(made.folder / "frame_5.vtu", np.vstack([made.positions[5], [[0, 0, 0]]]), made.cells)
    n = len(made.positions[0])
    assert f"frame_5.vtu: has {n + 1} points and frame_0.vtu {n}: a motion needs the same" in made.refused()


def test_wrong_unit_with_those_that_may_be_right(series, unit="um"):
    made = series("npy")
    made.geometry = {"unit": unit}
    assert re.search(f"its wall has .* geometry.unit = {unit} .*: set geometry.unit to cm or mm\\.", made.refused())


def test_larger_heart_than_the_view_holds(series):
    """Of a mouse in centimetres the wall has the volume of a man's, which its array cannot image."""
    made = series("npy")
    made.geometry = {"unit": "cm"}
    message = made.refused()
    assert "mm from the middle of the heart, and the array is at rf.focus_mm = 6.5" in message
    assert "geometry.unit = cm" in message


def test_series_that_does_not_close(series):
    message = series("npy", np.arange(7) / FRAMES).refused()
    assert re.search(r"does not close, its last frame is \d+% of the motion away from its first: give one", message)


def test_last_frame_that_is_not_the_first_though_it_is_said_to_be(series):
    assert "does not close" in series("npy").refused(repeats_first=True)


def test_missing_files(series):
    made = series("npy")
    made.geometry = {"file": "none.vtu"}
    assert "geometry.file = 'none.vtu': there is no such file" in made.refused()
    made = series("pvd")
    assert "motion.file.path = 'none_*.vtu': there is no file none_*.vtu" in made.refused(path="none_*.vtu")
    (made.folder / "heart_p0_000003.vtu").unlink()
    assert "heart.pvd: names heart_p0_000003.vtu, which does not exist" in made.refused()


def test_frames_without_tetrahedra(series):
    made = series("vtu")
    save(made.folder / "frame_3.vtu", made.positions[3], made.cells[:, :3])
    assert "frame_3.vtu: holds no tetrahedra" in made.refused()


@pytest.mark.parametrize(
    ("name", "content"), [*((f"a.{kind}", b"no mesh at all") for kind in ("vtu", "pvd", "npz")), ("a.npy", b"")]
)
def test_unreadable_files(series, name, content):
    made = series("npy")
    (made.folder / name).write_bytes(content)
    message = made.refused(path=str(made.folder / name))
    assert message.startswith(name) and re.search("cannot be read|holds no frames", message)


def test_points_that_are_no_numbers(series):
    def spoil(positions):
        positions[4, 3, 1] = np.nan

    assert "frame 4: has points that are not finite numbers" in series("npy", spoil=spoil).refused()


def test_displacement_that_is_not_named_and_one_that_is_not_there(series):
    made = series("pvd")
    message = made.refused(displacement=None)
    assert "its points are the same in all 12 frames: name the array of their displacements" in message
    assert "its vectors over the points are u" in message
    assert "motion.file.displacement = 'v' is no array of it (its vectors over the points are u)" in made.refused(
        displacement="v"
    )


def test_displacement_of_points_that_move_themselves(series):
    message = series("vtu").refused(displacement="u")
    assert "its points move, and motion.file.displacement = 'u' would move them again" in message


def test_times_that_do_not_fit(series):
    made = series("npy")
    assert "has 12 frames and motion.file.times 3 entries" in made.refused(times=[0, 1, 2])
    times = [*range(6), 5, *range(7, 12)]
    assert "motion.file.times must increase, and that of frame 6 is 5" in made.refused(times=times)


def test_frames_that_are_not_there(series):
    made = series("npy")
    assert "motion.file.frames = [0, 12]: " in made.refused(frames=[0, 12])
    assert "positions.npy has the frames 0 to 11" in made.refused(ed_frame=12)


def test_mesh_of_other_tetrahedra_than_the_series(series):
    made = series("vtu")
    save(made.folder / "mesh.vtu", made.positions[0], made.cells[::-1])
    made.geometry = {"file": str(made.folder / "mesh.vtu")}
    assert "its tetrahedra are not those of geometry.file = mesh.vtu" in made.refused()


def test_array_that_does_not_fit_the_mesh(series):
    made = series("npy")
    np.save(made.folder / "positions.npy", made.positions[:, :-1])
    n = len(made.positions[0])
    assert f"moves {n - 1} points and geometry.file has {n}" in made.refused()
    np.save(made.folder / "positions.npy", made.positions[0])
    assert "give positions of shape (frame, point, 3)" in made.refused()
    np.savez(made.folder / "positions.npz", u=made.positions)
    path = str(made.folder / "positions.npz")
    assert "holds no array 'positions' (it has u)" in made.refused(path=path)


def test_array_of_no_real_numbers(series):
    made = series("npy")
    np.save(made.folder / "positions.npy", made.positions.astype(complex))
    assert "positions.npy: 'positions' is an array of" in made.refused()


def test_motion_that_is_none(series):
    assert "points are the same in all 12 frames" in series("npy", np.zeros(FRAMES)).refused()


def test_interpolation_that_inverts(affine_heart, write_series, configured):
    """Rigid turns by 180 degrees between frames: the straight way between them passes through a point."""
    cells = affine_heart.of_order[1][1]
    still = affine_heart.positions(1, [0.0])[0]
    middle = still.mean(axis=0)
    turned = (still - middle) @ np.diag([-1.0, -1.0, 1.0]) + middle
    section = write_series("npy", np.stack([still, turned]), cells)
    with pytest.raises(MotionError, match=r"between its frames the interpolation inverts tetrahedra"):
        motion_from_file(configured(section | {"ed_frame": 0}, frames=8))
