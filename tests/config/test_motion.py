"""Section `motion`: invalid prescribed motions are refused in one sentence."""

import pytest

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate

TUBE = "geometry: {shape: tube}\n"
FILE = "motion: {{kind: file, file: {{path: {}}}}}\n"

BAD = {
    "motion: {kind: tube}": "motion.kind = 'tube': needs geometry.shape = tube",
    "motion: {kind: still}": "motion.kind = 'still': should be 'beat', 'rigid', 'affine', 'tube' or 'file'",
    "motion: {kind: rigid, rigid: {lateral_mm: 1}}": "motion.rigid.lateral_mm is not a key: did you mean "
    "motion.rigid.lateral_um?",
    TUBE: "geometry.shape = 'tube': has no closed cavity and cannot beat: set motion.kind to rigid, affine or tube",
    TUBE + "motion: {kind: tube, tube: {contraction: 1}}": "motion.tube.contraction = 1: should be less than 1",
    TUBE + "motion: {kind: rigid}\nrealism: {blood: {level_dB: -20}}": "realism.blood.level_dB = -20.0: must be null "
    "if geometry.shape is tube",
    "geometry: {shape: tube, apex_wall_mm: 1}\nmotion: {kind: rigid}": "geometry.apex_wall_mm = 1.0: applies to the "
    "ellipsoid, because a tube has no apex: leave it out",
    "geometry: {shape: tube, file: a.vtu}\nmotion: {kind: rigid}": "geometry.shape = 'tube': applies to the ellipsoid",
    "motion: {kind: affine, affine: {gradient: [[1, 0, 0], [0, 1, 0]]}}": "motion.affine.gradient = ",
    "motion: {affine: {gradient: [[1, 1, 0], [1, 1, 0], [0, 0, 1]]}}": "has the eigenvalue 0 and would flatten",
    "motion: {affine: {gradient: [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]}}": "has the eigenvalue -1 and would flatten",
    "motion: {kind: file}": "motion.file.path = null: must be given with motion.kind = file",
    FILE.format("a.npy"): "geometry.file = null: must be given, because a.npy holds positions and no tetrahedra",
    FILE.format("a.pvd"): "loop.heart_rate_per_min = null: must be given with motion.kind = file",
    FILE.format("a.pvd") + "geometry: {remesh: true}": "geometry.remesh = true: must be false with motion.kind = file",
    FILE.format("a.pvd, frames: [5, 5]"): "motion.file.frames = [5, 5]: must be the first and, after it, the last",
    FILE.format("a.pvd, frames: [5, 9], ed_frame: 4"): "motion.file.ed_frame = 4: must be one of the frames 5 to 9",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: text.replace(" ", ""))
def test_refused_in_one_sentence(refusal, text):
    assert BAD[text] in refusal(text)


def test_a_prescribed_motion_needs_no_stiffness_where_a_beat_does():
    values = {"geometry": {"given_state": "end_diastole"}}
    with pytest.raises(ConfigError, match="stiffness_kPa"):
        validate(values, "test")
    assert validate(values | {"motion": {"kind": "rigid"}}, "test").motion.kind == "rigid"


def test_kinds_can_be_swept_and_shapes_cannot():
    config = Config(geometry={"shape": "tube"}, motion={"kind": "rigid"}, cases={"motion.kind": ["rigid", "tube"]})
    assert [case.config.motion.kind for case in expand(config)] == ["rigid", "tube"]
    shapes = Config(motion={"kind": "rigid"}, cases={"geometry.shape": ["ellipsoid", "tube"]})
    with pytest.raises(ConfigError, match=r"geometry.shape cannot be swept"):
        expand(shapes)


def test_mesh_of_a_series_is_its_own_unless_another_is_given():
    motion, loop = {"kind": "file", "file": {"path": "heart.pvd"}}, {"heart_rate_per_min": 500.0}
    assert Config(motion=motion, loop=loop).geometry.file == "heart.pvd"
    assert Config(motion=motion, loop=loop, geometry={"file": "mesh.msh"}).geometry.file == "mesh.msh"
    assert Config(motion=motion | {"kind": "beat"}).geometry.file is None


def test_series_that_is_not_there_is_refused_before_the_run():
    config = Config(motion={"kind": "file", "file": {"path": "no_*.vtu"}}, loop={"heart_rate_per_min": 500.0})
    with pytest.raises(ConfigError, match=r"motion.file.path = 'no_\*.vtu': there is no file .*no_\*.vtu"):
        expand(config)
