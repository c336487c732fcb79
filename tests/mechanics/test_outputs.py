"""Output arrays of a heart."""

import numpy as np

from echotruth.config import Config
from echotruth.mechanics import outputs
from echotruth.mechanics.prescribed import prescribed_motion


def test_statistics_of_strain_do_not_depend_on_how_much_is_held_at_a_time(monkeypatch):
    mesh = {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1}
    config = Config(geometry=mesh, loop={"frames": 5}, motion={"kind": "affine"})
    whole = prescribed_motion(config)["kinematics"]
    monkeypatch.setattr(outputs, "MAX_VALUES", 1)
    frame_by_frame = prescribed_motion(config)["kinematics"]
    for name in ("strain_mean", "strain_sd", "layer_strain"):
        np.testing.assert_allclose(frame_by_frame[name], whole[name], rtol=0, atol=1e-15)
    assert whole["strain_sd"][2].max() > 0.05
