"""Values that no heart can have are found; those that a heart may have are not."""

import finished_repository as finished
import numpy as np
import pytest

from echotruth.cases import expand
from echotruth.config import Motion
from echotruth.repository import schema, scores, values
from echotruth.repository.reader import Repository

CONFIG = finished.configured(views=("mid",), cases={})
FIRST = expand(CONFIG)[0]
NAN, INFINITE = float("nan"), float("inf")
SIZE = f"/{finished.SIZE}"


@pytest.fixture(scope="module")
def groups(tmp_path_factory):
    """Arrays of the groups of a heart that has no fault."""
    folder = finished.finish(tmp_path_factory.mktemp("values") / "small", CONFIG)
    view, repository = "mid", Repository(folder)
    names = [*schema.HEART, "phantom", "rf", f"truth{SIZE}", f"bmode{SIZE}", "points", "tracking/one"]
    return {name: repository.arrays(name, FIRST.id, None if name in schema.HEART else view) for name in names}


@pytest.fixture
def heart(groups):
    """Function from a group to arrays that may be changed."""
    return lambda group: {name: np.array(array) for name, array in groups[group].items()}


def with_value(arrays, name, place, value):
    """Arrays of a group with another value of one of them, or of a score."""
    if name not in schema.SCORES:
        arrays[name][place] = value
        return arrays
    found = scores.unpacked(arrays["scores"], CONFIG)
    found[name][place] = value
    return arrays | {"scores": scores.packed(found)}


def found(group, arrays, config=CONFIG):
    """Array -> all its problems."""
    problems = {}
    for name, problem in values.faults(group, arrays, config):
        problems[name] = f"{problems[name]}; {problem}" if name in problems else problem
    return problems


def test_whole_heart_has_no_fault(groups):
    assert {name: found(name, arrays) for name, arrays in groups.items()} == {name: {} for name in groups}


@pytest.mark.parametrize(
    "group, name, place, value, problem",
    [
        ("geometry", "node_position", (5, 1), NAN, "not numbers"),
        ("geometry", "cell_node", (3, 1), 10**6, "names node 1000000 of"),
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
        ("phantom", "wall_cell", (0,), -1, "below 0"),
        ("truth/64", "displacement", (1, 2, 3, 0), NAN, "in a pixel of the wall"),
        ("truth/64", "displacement", (0, 2, 3, 0), 1e-4, "is not 0 at end-diastole"),
        ("truth/64", "strain", (2, 2, 3, 4), INFINITE, "infinite"),
        ("truth/64", "wall_depth", (2, 2, 3), 1.5, "above 1.05"),
        ("truth/64", "labels", (2, 1, 2, 3), 0, "a pixel of the wall without a segment"),
        ("truth/64", "labels", (2, 1, 2, 3), 18, "has a segment of 18, above 17"),
        ("truth/64", "labels", (2, 0, 2, 3), 7, "has a layer of 7, above 6"),
        ("truth/64", "tissue", (2, 2, 3), 16, "has a value of 16, above 15"),
        ("truth/64", "tissue", (2, 2, 3), 1, "is not the wall in a pixel of the wall"),
        ("truth/64", "flow", (1, 0, 2, 3, 2), NAN, "in a pixel of the wall from which there is a frame"),
        ("truth/64", "flow", (2, 1, 2, 3), 0.0, "or is one elsewhere"),
        ("tracking/one", "quality", (0, 1, 2, 2), 1.5, "above 1"),
        ("tracking/one", "quality", (0, 1, 2, 2), NAN, "where there is no displacement, or the reverse"),
        ("tracking/one", "coverage", (0,), NAN, "not numbers"),
        ("tracking/one", "nrmse_all", (0,), -0.1, "below 0"),
        ("tracking/one", "strain_correlation", (0, 0, 0, 0), 1.1, "above 1"),
        ("points", "true_displacement", (1, 2, 2, 0), NAN, "at a point of the wall"),
        ("points", "true_displacement", (0, 2, 2, 1), 1e-6, "is not 0 at end-diastole"),
        ("points", "wall_axes", (2, 2, 0, 0), 0.5, "length is not 1"),
    ],
)
def test_value_that_no_heart_can_have_is_found(heart, group, name, place, value, problem):
    arrays = with_value(heart(group), name, place, value)
    assert problem in found(group, arrays)[name]


@pytest.mark.parametrize("name", ["displacement", "strain", "wall_depth", "labels", "flow"])
def test_pixel_outside_the_wall_has_no_motion(heart, name):
    arrays = heart("truth/64")
    arrays["labels"][1, 0, 2, 3] = 0
    assert name in found("truth/64", arrays)


@pytest.mark.parametrize(
    "group, name, place",
    [
        ("physiology", "twist_ivc", ()),  # a heart without isovolumic contraction
        ("mechanics", "pressure_target", (1,)),  # a loop that prescribes volume alone
        ("mechanics", "pressure", (1,)),  # a prescribed motion
        ("tracking/one", "quality", ()),  # a tracker that does not say how sure it is
        ("tracking/one", "segment_nrmse", (0, 0, 0)),  # a segment that the view does not show
    ],
)
def test_value_that_does_not_exist_is_no_fault(heart, group, name, place):
    arrays = heart(group)
    arrays = with_value(arrays, name, place, NAN)
    assert found(group, arrays) == {}


def test_solved_heart_has_a_pressure_in_every_frame(heart):
    arrays = heart("mechanics")
    arrays["pressure"][1] = NAN
    assert "pressure" in found("mechanics", arrays, finished.configured(motion=Motion(kind="beat")))
