"""Section `motion`: invalid prescribed motions are refused in one sentence."""

import pytest

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate

TUBE = "geometry: {shape: tube}\n"

BAD = {
    "motion: {kind: tube}": "motion.kind = 'tube': needs geometry.shape = tube",
    "motion: {kind: still}": "motion.kind = 'still': should be 'beat', 'rigid', 'affine' or 'tube'",
    "motion: {kind: rigid, rigid: {lateral_mm: 1}}": "motion.rigid.lateral_mm is not a key: did you mean "
    "motion.rigid.lateral_um?",
    TUBE: "geometry.shape = 'tube': has no closed cavity and cannot beat: set motion.kind to rigid, affine or tube",
    TUBE + "motion: {kind: tube, tube: {contraction: 1}}": "motion.tube.contraction = 1: should be less than 1",
    TUBE + "motion: {kind: tube, tube: {shortening: 1}}": "motion.tube.shortening = 1: should be less than 1",
    TUBE + "motion: {kind: rigid}\nrealism: {blood: {level_dB: -20}}": "realism.blood.level_dB = -20.0: must be null "
    "if geometry.shape is tube",
    TUBE + "motion: {kind: rigid}\nrealism: {surroundings: {level_dB: 0}}": "realism.surroundings.level_dB = 0.0: must "
    "be null if geometry.shape is tube",
    "geometry: {shape: tube, apex_wall_mm: 1}\nmotion: {kind: rigid}": "geometry.apex_wall_mm = 1.0: applies to the "
    "ellipsoid, because a tube has no apex: leave it out",
    "geometry: {shape: tube, file: a.vtu}\nmotion: {kind: rigid}": "geometry.shape = 'tube': applies to the ellipsoid",
    "motion: {kind: affine, affine: {gradient: [[1, 0, 0], [0, 1, 0]]}}": "motion.affine.gradient = ",
    # A mirror image, what is flat, and half a turn, which is a reflection halfway.
    "motion: {affine: {gradient: [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]}}": "has the eigenvalue -1 and would flatten",
    "motion: {affine: {gradient: [[1, 1, 0], [1, 1, 0], [0, 0, 1]]}}": "has the eigenvalue 0 and would flatten",
    "motion: {affine: {gradient: [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]}}": "has the eigenvalue -1 and would flatten",
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
