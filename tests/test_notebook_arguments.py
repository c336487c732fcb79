"""Functions for notebooks say what they take if they are given something else."""

import pytest
import xarray as xr

import echotruth as et


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: et.kinematics("out/demo"),
            "heart = 'out/demo': must be a Heart: a Repository has one",
        ),
        (lambda: et.point_tracks("out/demo", "mid", []), "heart = 'out/demo': must be a Heart"),
        (
            lambda: et.track("out/demo"),
            "clip = 'out/demo': must be a Dataset: a Repository has one",
        ),
        (lambda: et.evaluate("out/demo", None), "tracked = 'out/demo': must be a Dataset: echotruth.track makes one"),
    ],
)
def test_path_in_place_of_a_heart_or_a_clip_is_refused(call, sentence):
    with pytest.raises(TypeError) as error:
        call()
    assert str(error.value).startswith(sentence)


def test_clip_that_was_loaded_without_its_mask_is_refused_by_trackers():
    with pytest.raises(ValueError, match="clip: has no mask: load it with image and mask among its variables"):
        et.track(xr.Dataset({"image": ("frame", [0, 1])}))


def test_configuration_that_is_no_mapping_is_refused():
    with pytest.raises(et.config.loading.ConfigError, match=r"^configuration: 3: must be a mapping of keys to values$"):
        et.configure(3)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("mous", "did you mean mouse"), ("heart.yaml", "did you mean heart"), ("x", "give a YAML file")],
)
def test_configuration_that_does_not_exist_is_told_in_a_sentence(name, remedy):
    with pytest.raises(et.ConfigError, match=rf"^{name}: does not exist: {remedy}.*$"):
        et.configure(name)
