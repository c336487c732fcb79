"""Values that no heart can have are found; those that a heart may have are not."""

import finished_repository as finished
import numpy as np
import pytest

from echotruth.config import Motion
from echotruth.repository import values

CONFIG = finished.configured()
FRAMES, POINTS, CELLS, NODES = 3, 4, 5, 6
DIMENSIONS = {
    "frame": FRAMES,
    "axial": POINTS,
    "lateral": POINTS,
    "cell": CELLS,
    "node": NODES,
    "label": 3,
}
"""Lengths of dimensions; 2 where nothing is given, and 3 for axes of space."""

NAN, INFINITE = float("nan"), float("inf")


def heart(group):
    """Arrays of a group for a heart that does not move."""
    arrays = {}
    for array in finished.schema.named(group):
        lengths = DIMENSIONS | {"xyz": 3, "vector": 3, "strain_component": 6, "wall_component": 3}
        shape = [lengths.get(dim, 2) for dim in array.dims[array.leading :]]
        value = finished.VALUES.get(group.partition("/")[0], {}).get(array.name, 0)
        arrays[array.name] = np.broadcast_to(np.asarray(value, array.dtype), shape).copy()
    return arrays


def found(group, arrays, config=CONFIG, first=0):
    return joined(values.faults(group, arrays, first, config))


def joined(faults):
    """Array -> all its problems."""
    problems = {}
    for name, problem in faults:
        problems[name] = f"{problems[name]}; {problem}" if name in problems else problem
    return problems


@pytest.mark.parametrize("group", sorted(set(finished.schema.KINDS) - {"rf"}))
def test_heart_that_does_not_move_has_no_fault(group):
    assert found(group, heart(group)) == {}


@pytest.mark.parametrize(
    "group, name, place, value, problem",
    [
        ("geometry", "node_position", (5, 1), NAN, "not numbers"),
        ("geometry", "cell_node", (3, 1), NODES, "names node 6 of 6"),
        ("geometry", "endo", (1, 1), -1, "below 0"),
        ("fibres", "fibre", (4, 0), 1.1, "length is not 1"),
        ("fibres", "sheet", (4, 0), 1.0, "length is not 1"),
        ("fibres", "segment", (4,), 18, "above 17"),
        ("fibres", "layer", (4,), 9, "fibres.layers is 6"),
        ("fibres", "wall_depth", (4,), 1.01, "above 1"),
        ("pathology", "region", (4,), 4, "above 3"),
        ("mechanics", "volume", (1,), 0.0, "below"),
        ("mechanics", "pressure", (1,), INFINITE, "infinite"),
        ("mechanics", "phase", (1,), 4, "above 3"),
        ("mechanics", "es_frame", (), 40, "loop.frames is 3"),
        ("kinematics", "strain", (1, 4, 1), -0.6, "below -1/2"),
        ("kinematics", "strain", (0, 4, 4), 0.01, "is not 0 at end-diastole"),
        ("kinematics", "volume_ratio_min", (2,), 0.0, "below"),
        ("phantom", "axes", (0, 0), 0.5, "normal to each other"),
        ("phantom", "scatterer_count", (), -1, "below 0"),
        ("truth/64", "displacement", (1, 2, 3, 0), NAN, "in a pixel of the wall"),
        ("truth/64", "displacement", (0, 2, 3, 0), 1e-4, "is not 0 at end-diastole"),
        ("truth/64", "strain", (2, 2, 3, 4), INFINITE, "infinite"),
        ("truth/64", "wall_depth", (2, 2, 3), 1.5, "above 1.05"),
        ("truth/64", "labels", (2, 1, 2, 3), 0, "a pixel of the wall without a segment"),
        ("truth/64", "labels", (2, 1, 2, 3), 18, "has a segment of 18, above 17"),
        ("truth/64", "labels", (2, 0, 2, 3), 7, "has a layer of 7, above 6"),
        ("truth/64", "tissue", (2, 2, 3), 12, "has a value of 12, above 11"),
        ("truth/64", "tissue", (2, 2, 3), 1, "is not the wall in a pixel of the wall"),
        ("truth/64", "flow", (1, 0, 2, 3, 2), NAN, "in a pixel of the wall from which there is a frame"),
        ("truth/64", "flow", (2, 1, 2, 3), 0.0, "or is one elsewhere"),
        ("tracking/64/one", "quality", (1, 2, 2), 1.5, "above 1"),
        ("tracking/64/one", "quality", (1, 2, 2), NAN, "where there is no displacement, or the reverse"),
        ("evaluation/64/one", "coverage", (), NAN, "not numbers"),
        ("evaluation/64/one", "nrmse_all", (), -0.1, "below 0"),
        ("evaluation/64/one", "strain_correlation", (0, 0, 0), 1.1, "above 1"),
        ("evaluation/64", "true_displacement", (1, 2, 2, 0), NAN, "at a point of the wall"),
        ("evaluation/64", "true_displacement", (0, 2, 2, 1), 1e-6, "is not 0 at end-diastole"),
        ("evaluation/64", "wall_axes", (2, 2, 0, 0), 0.5, "length is not 1"),
    ],
)
def test_value_that_no_heart_can_have_is_found(group, name, place, value, problem):
    arrays = heart(group)
    arrays[name][place] = value
    assert problem in found(group, arrays)[name]


@pytest.mark.parametrize("name", ["displacement", "strain", "wall_depth", "labels", "flow"])
def test_pixel_outside_the_wall_has_no_motion(name):
    arrays = heart("truth/64")
    arrays["labels"][1, 0, 2, 3] = 0
    assert name in found("truth/64", arrays)


@pytest.mark.parametrize(
    "group, name, place",
    [
        ("physiology", "twist_ivc", ()),  # a heart without isovolumic contraction
        ("mechanics", "pressure_target", (1,)),  # a loop that prescribes volume alone
        ("mechanics", "pressure", (1,)),  # a prescribed motion
        ("evaluation/64/one", "segment_nrmse", (0, 0)),  # a segment that the view does not show
        ("phantom", "centre", (0,)),  # a plane that cuts no cavity
    ],
)
def test_value_that_does_not_exist_is_no_fault(group, name, place):
    arrays = heart(group)
    arrays[name][place] = NAN
    assert found(group, arrays) == {}


def test_solved_heart_has_a_pressure_in_every_frame():
    arrays = heart("mechanics")
    arrays["pressure"][1] = NAN
    assert "pressure" in found("mechanics", arrays, finished.configured(motion=Motion(kind="beat")))


def test_only_the_first_frame_is_end_diastole():
    arrays = {name: array[2:] for name, array in heart("truth/64").items()}
    arrays["displacement"][0] = 1e-4
    assert found("truth/64", arrays, first=2) == {}


def loop(**changes):
    arrays = {
        name: np.ones(3) for name in ("pressure", "pressure_target", "volume", "volume_target", "volume_ratio_min")
    }
    measured = {"loop_error": np.array(0.0), "volume_ratio_min": np.array(1.0)}
    for name, value in changes.items():
        (measured if name in measured and np.ndim(value) == 0 else arrays)[name] = np.asarray(value, float)
    return joined(values.loop_faults(arrays, measured, finished.configured(motion=Motion(kind="beat"))))


def test_heart_that_follows_its_loop_has_no_fault():
    assert loop() == {}
    assert loop(pressure=[1, 1.004, 1], loop_error=0.004) == {}
    assert loop(pressure=[1, 2, 1], pressure_target=[1, NAN, 1]) == {}


def test_heart_that_leaves_its_loop_is_found():
    assert "above physiology.loop_error_max = 0.005" in loop(volume=[1, 1, 0.98], loop_error=0.02)["loop_error"]
    assert "the curves give 0.02" in loop(volume=[1, 1, 0.98])["loop_error"]
    assert "kinematics has 0.5" in loop(volume_ratio_min=[1, 0.5, 1])["volume_ratio_min"]
