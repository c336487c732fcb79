import numpy as np
import pytest

from echotruth.aha import BULLSEYE, SEGMENT_NAMES, segment

APEX = -6e-3


def at(degrees, z):
    angle = np.radians(degrees)
    return np.array([2e-3 * np.cos(angle), 2e-3 * np.sin(angle), z])


@pytest.mark.parametrize(
    "degrees, name",
    [
        (90, "anterior"),
        (30, "anteroseptal"),
        (-30, "inferoseptal"),
        (-90, "inferior"),
        (-150, "inferolateral"),
        (150, "anterolateral"),
    ],
)
def test_six_sectors_of_base_and_mid(degrees, name):
    assert SEGMENT_NAMES[segment(at(degrees, -1e-3), APEX) - 1] == f"basal {name}"
    assert SEGMENT_NAMES[segment(at(degrees, -3e-3), APEX) - 1] == f"mid {name}"


@pytest.mark.parametrize("degrees, name", [(90, "anterior"), (0, "septal"), (-90, "inferior"), (180, "lateral")])
def test_four_sectors_of_the_apex(degrees, name):
    assert SEGMENT_NAMES[segment(at(degrees, -5e-3), APEX) - 1] == f"apical {name}"


def test_edges_between_neighbours():
    assert segment(at(90, 0), APEX) == 1
    assert segment(at(1, -1e-3), APEX) == 2 and segment(at(-1, -1e-3), APEX) == 3
    assert segment(at(61, -1e-3), APEX) == 1 and segment(at(119, -1e-3), APEX) == 1
    assert segment(at(90, -1.99e-3), APEX) == 1 and segment(at(90, -2.01e-3), APEX) == 7
    assert segment(at(90, -3.99e-3), APEX) == 7 and segment(at(90, -4.01e-3), APEX) == 13
    assert segment(at(90, -5.99e-3), APEX) == 13 and segment(at(90, -6.01e-3), APEX) == 17
    assert segment(at(90, 1e-9), APEX) == 1


def test_unknown_position_has_no_segment():
    assert segment(np.array([np.nan, 0, -1e-3]), APEX) == 0


def test_apex_above_the_base_is_refused():
    with pytest.raises(ValueError, match="below the base"):
        segment(np.zeros(3), 0.0)


def test_bullseye_fills_the_disc_once():
    inner, outer, start, stop = np.array(BULLSEYE).T
    assert len(BULLSEYE) == len(SEGMENT_NAMES) == 17
    assert np.sum((stop - start) * (outer**2 - inner**2) / 2) == pytest.approx(np.pi)


def test_bullseye_is_that_seen_from_the_apex():
    """Anterior (+y) up and septal (+x) on the left: the page is the short-axis image."""
    degrees = np.arange(0.5, 360)
    for z, ring in ((-1e-3, range(1, 7)), (-3e-3, range(7, 13)), (-5e-3, range(13, 17))):
        for angle in degrees:
            number = int(segment(at(angle, z), APEX))
            page = np.radians(180 - angle)
            _, _, start, stop = BULLSEYE[number - 1]
            assert number in ring and (page - start) % (2 * np.pi) < stop - start


def test_points_on_a_border_belong_to_the_next_segment_whatever_their_last_bits():
    azimuths = np.pi / 2 - np.radians(30 + 60 * np.arange(6))
    on_border = np.stack([np.cos(azimuths), np.sin(azimuths), np.full(6, -0.5)], -1)
    for scale in (1, 1 - 1e-15, 1 + 1e-15):
        for turn in (-1e-15, 0, 1e-15):
            turned = on_border @ np.array([[1, turn, 0], [-turn, 1, 0], [0, 0, scale]])
            assert segment(turned, -3.0).tolist() == [2, 3, 4, 5, 6, 1]
    assert segment(np.array([[0, 1, -1 + 1e-15], [0, 1, -1 - 1e-15], [0, 1, -1.0]]), -3.0).tolist() == [7, 7, 7]
