"""Connected components of few items."""

import numpy as np

from echotruth.mechanics.geometry.boundary import component_labels, largest_component


def test_components_are_numbered_from_the_largest():
    label = component_labels(6, np.array([[0, 1], [2, 3], [3, 4]]))
    assert label[2] == label[3] == label[4] == 0 and label[0] == label[1] == 1


def test_largest_component_of_the_selected():
    selected = np.array([True, True, False, True, True, True])
    found = largest_component(selected, np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]]))
    assert found.tolist() == [False, False, False, True, True, True]
