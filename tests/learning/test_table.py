"""The table of cases says of each heart what its files say."""

import pytest

from echotruth import learning

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table(repository):
    return learning.cases(repository)


def test_every_case_has_a_row_with_its_status_and_diagnosis(table):
    assert (table["status"] == "complete").all()
    assert table["diagnosis"].tolist().count("infarct") == table["diagnosis"].tolist().count("healthy") == 2
    assert (table["diagnosis"] == "infarct").equals(table.index.to_series().str.contains("7"))


def test_hearts_that_differ_in_speckle_alone_are_one_heart(table):
    assert table.groupby("heart")["seed"].apply(sorted).tolist() == [[1, 2], [1, 2]]
    assert table.groupby("heart")["diagnosis"].nunique().eq(1).all()


def test_scar_of_two_mid_segments_is_a_sixth_to_a_twelfth_of_the_wall(table):
    """Two of six segments of one of three levels are 1/9 of a wall of even thickness without apical cap."""
    scars = table.set_index("diagnosis")["scar_size"]
    assert (scars["healthy"] == 0).all()
    assert ((scars["infarct"] > 1 / 12) & (scars["infarct"] < 1 / 6)).all()
