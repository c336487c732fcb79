"""A repository of volumes holds what the functions make in memory, and is the same however it was made."""

import re

import numpy as np
import pytest
import yaml
import zarr
from finished_repository import content, finish, remake, solved
from volume_repository import CONFIG, SHIFT
from workspace import Workspace

import echotruth as et
from echotruth.cases import expand
from echotruth.config.loading import ConfigError
from echotruth.repository import schema
from echotruth.repository.check import check
from echotruth.repository.group import part
from echotruth.repository.places import group_of
from echotruth.viewer.server import opened
from echotruth.workflow.added_tracker import EvaluationError, prepare
from echotruth.workflow.concerns import concerns


def half(frames, points, mask, spacing, frame_time, seed, share=0.5):
    """A tracker that sees a share of the motion of `CONFIG` to the middle of the cycle."""
    whole = share * SHIFT[[0, 2, 1]] / spacing  # lateral, elevation, depth
    return np.multiply.outer([0, 1, 0], np.broadcast_to(whole, points.shape))


def failing(frames, points, mask, spacing, frame_time, seed):
    raise ValueError("sees nothing")


def configured(*trackers, **keys):
    names = {name: {"method": "external", "track": f"{__name__}:{name}"} for name in trackers}
    return et.configure(yaml.safe_load(CONFIG), **({"tracking": {"trackers": names}} if names else {}), **keys)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("made") / "tiny", configured("half", "failing"), solved)


def test_data_are_those_of_the_functions_in_memory(made):
    repository = et.Repository(made)
    heart, clip = repository.heart(), repository.clip()
    imaged = et.image(et.beat(repository.config), "whole")
    for name in ("image", "mask"):
        assert clip[name].identical(imaged[name]) and len(np.unique(clip[name])) > 1
    assert clip.attrs == imaged.attrs
    tracked, found = et.track(imaged, half), repository.arrays("tracking/half", "heart", "whole")
    for name in ("displacement", "quality"):
        np.testing.assert_array_equal(found[name], tracked[name])
    scores, rows = et.evaluate(tracked, heart), repository.scores.set_index("tracker")
    assert rows.loc["half", list(scores.index)].astype(float).equals(scores.rename("half"))
    truth = et.voxel_truth(clip, heart, 1)
    labels = repository.read("truth/volume/labels", "heart", "whole", 1)
    for number, name in enumerate(schema.LABELS["label"]):
        np.testing.assert_array_equal(labels[number], truth[name])


def test_points_move_as_the_formula_says_and_who_fails_has_no_estimate(made):
    repository = et.Repository(made)
    points = repository.arrays("points", "heart", "whole")
    step = 0.3e-3 / 256
    np.testing.assert_allclose(points["true_displacement"].max(1) - points["true_displacement"].min(1), 0, atol=step)
    moved = np.abs(points["true_displacement"]).max((0, 1))
    np.testing.assert_allclose(moved / moved[0], np.abs(SHIFT) / SHIFT[0], rtol=0.02)
    rows = repository.scores.set_index("tracker")
    assert rows.loc["failing", ["nrmse_all_percent", "coverage_percent"]].tolist() == [100, 0]
    assert "sees nothing" in rows.loc["failing", "failure"] and rows.loc["half", "failure"] == ""


def test_check_finds_no_fault_and_the_arrays_are_those_of_the_schema(made):
    report = check(made)
    assert not report.faults and not report.notes and report.groups > 6
    store, seen = zarr.open_group(made / "tiny.zarr", mode="r", use_consolidated=False), set()
    for path, group in store.members(max_depth=None):
        if isinstance(group, zarr.Group) and path.count("/") > 2 and path.startswith("clips"):
            name, arrays = group_of(path), dict(group.arrays())
            if arrays:
                known = schema.COORDINATES | schema.arrays_of(name, has_volumes=True)
                dims = {of: array.metadata.dimension_names for of, array in arrays.items() if array.ndim}
                assert dims == {of: known[of].dims for of in dims}
                seen.add(schema.kind(name, has_volumes=True))
    assert {kind for kind in schema.KINDS if "volume" in kind} <= seen
    in_phase, quadrature = np.moveaxis(part(store["clips/heart/whole/rf/volumes"]), -1, 0).astype(float)
    assert np.abs([in_phase, quadrature]).max(initial=0) == 32767 and not np.array_equal(in_phase, quadrature)


def test_repository_that_grew_is_one_that_was_made_at_once(made, tmp_path):
    finish(tmp_path / "tiny", configured("failing", volume={"size": [24, 24, 20]}), solved)
    remake(tmp_path / "tiny", configured("failing"), solved)
    done = remake(tmp_path / "tiny", configured("half", "failing"), solved)
    assert done == ["tracking heart whole half", "repository"]
    assert content(tmp_path / "tiny") == content(made)


@pytest.mark.slow
def test_run_on_two_cores_makes_the_bytes_of_jobs_in_one_process_and_a_report(tmp_path):
    workspace = Workspace(tmp_path, CONFIG)
    workspace.echotruth("run", "tiny.yaml", "--cores", "2")
    assert content(workspace.out) == content(finish(tmp_path / "tiny", et.configure(yaml.safe_load(CONFIG)), solved))
    page = (workspace.out / "report.html").read_text()
    assert page.count('src="data:image/svg') == 5 and '"sheet": "data:image/jpeg' in page


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"views": {"whole": {"plane": "volume"}, "mid": {}}}, r"views\.mid\.plane.*must be volume"),
        ({"inference": {"tracker": "half"}}, r"inference\.tracker.*needs slices"),
        ({"cases": {"volume.size": [[24, 20, 18], [24, 20, 20]]}}, r"volume\.size.*cannot be swept"),
    ],
)
def test_mixture_of_slices_and_volumes_and_what_needs_slices_is_refused(keys, said):
    with pytest.raises(ConfigError, match=said):
        expand(configured("half", **keys))


def test_what_reads_slices_refuses_volumes_in_one_sentence(made):
    repository = et.Repository(made)
    for read in (repository.curves, repository.tracks, repository.summary, repository.metrics, repository.twist):
        with pytest.raises(ValueError, match=r"^\w+: needs slices, and tiny has volumes: .*\.$"):
            read()
    with pytest.raises(ValueError, match=r"^the viewer: needs slices"):
        opened(made)


def test_volume_without_wall_ends_the_run_in_a_sentence(tmp_path):
    inside = configured("half", volume={"size": [8, 8, 8], "field_mm": [1, 1, 1]})
    with pytest.raises(SystemExit, match=r"^phantom: There is no wall in the volume: volume\.field_mm = .*\.$"):
        finish(tmp_path / "tiny", inside, solved)


@pytest.mark.parametrize("method", ["dis", "bspline_cnn"])
def test_tracker_of_slices_is_refused_before_a_run_and_beside_it(made, method):
    config = et.configure(configured(), tracking={"trackers": {"flow": {"method": method}}})
    (concern,) = concerns(config)
    assert concern.is_absurd and concern.text.startswith("tracking.trackers.flow.method tracks slices")
    assert list(configured().tracking.trackers) == ["bspline_dic"]
    with pytest.raises(EvaluationError, match=r"^flow tracks slices: volumes need bspline_dic"):
        prepare(et.Repository(made), "flow", {"method": method})


def test_volume_that_does_not_hold_the_heart_is_told_before_a_run():
    def told(offset):
        views = {"whole": {"plane": "volume", "offset": {"lateral_mm": offset}}}
        return [concern.is_absurd for concern in concerns(configured(views=views))]

    assert (told(0.5), told(1.5), told(-7.0)) == ([], [False], [True])
    (concern,) = concerns(configured(volume={"field_mm": [4.0, 8.6, 6.9]}))
    (needed,) = re.findall(r"use (\S+) or more for the axial side$", concern.text)
    assert not list(concerns(configured(volume={"field_mm": [float(needed), 8.6, 6.9]})))
