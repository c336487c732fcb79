"""The medium: what is stored of its bodies, and what is made of that again."""

from dataclasses import fields

import numpy as np
from scenes import medium, scene

from echotruth.config import Config
from echotruth.imaging.medium.medium import BODIES, Medium, Wall
from echotruth.repository import schema

CONFIG = Config.model_validate(
    {
        "phantom": {"density_per_mm3": 100.0},
        "realism": {"blood": {"level_dB": -20.0}, "decorrelation": {"time_ms": 50.0}},
    }
)


def test_the_schema_has_the_arrays_of_every_body():
    arrays = {f"{body.name}_{field.name}" for body in (Wall, *BODIES) for field in fields(body)[1:]}
    assert arrays <= set(schema.arrays_of("phantom")) and len(arrays) > 15


def test_scatterers_that_never_enter_the_beam_are_not_stored(twisting_heart):
    at = scene(CONFIG, twisting_heart)
    _, all_of_them = medium(at)
    whole, half = medium(at, lambda position: position[:, 0] > 0)
    ever = np.logical_or(*(Wall.restored(at, all_of_them).positions(frame)[:, 0] > 0 for frame in (0, 1)))
    assert 0 < ever.mean() < 1
    assert np.array_equal(half["wall_xi"], all_of_them["wall_xi"][ever])
    assert 0 < len(half["blood_xi"]) < len(all_of_them["blood_xi"])
    for once, again in zip(whole(1), Medium(at, half | {"origin": at.plane.origin})(1), strict=True):
        assert np.array_equal(once, again)
