"""What has no estimate says why: in the table, in the report and in the viewer."""

import finished_repository as finished
import numpy as np
import pytest
from bokeh.document import Document

import echotruth as et
from echotruth.config import Bmode, Config, PhaseCorrelation, Tracking
from echotruth.evaluation.no_estimate import LOST, NOT_SHOWN, reason
from echotruth.report.account import failures
from echotruth.repository import scores
from echotruth.viewer.choice import first
from echotruth.viewer.page import Page

UNKNOWN, KNOWN = np.full(3, np.nan), np.zeros(3)
FINE, COARSE = (Config(bmode=Bmode(size_px=512), tracking=Tracking(grid=grid)) for grid in (0.0146, 0.0147))


def test_reasons_in_the_order_in_which_they_hold():
    assert reason(KNOWN, UNKNOWN, COARSE, "lost") == ""
    assert reason(UNKNOWN, UNKNOWN, COARSE, "lost") == NOT_SHOWN
    assert reason(UNKNOWN, KNOWN, COARSE, "no texture") == "the tracker failed: no texture"
    few = "points 8 px apart in an image of 512 px are too few through the wall for strain at its borders"
    assert reason(UNKNOWN, KNOWN, COARSE) == f"tracking.grid = 0.0147: {few}: use 0.01 or less"
    assert reason(UNKNOWN, KNOWN, COARSE, is_strain=False) == LOST
    assert reason(UNKNOWN, KNOWN, FINE) == reason(np.array([0, np.nan, 0]), KNOWN, FINE) == LOST


def unknown_strain(job):
    """All results of a job, in which trackers have found no strain."""
    found = finished.blank(job)
    if job.stage == "tracking":
        arrays = found[f"tracking/{job.tracker}"]
        for name in ("tracked_region_strain", "tracked_segment_strain", "tracked_line_strain"):
            arrays[name] = np.full(arrays[name].shape, np.nan)
        labels = scores.labels(job.config.loop.frames, job.config.fibres.layers)
        arrays["scores"][:, [label.startswith("strain_rms") for label in labels]] = np.nan
    return found


@pytest.fixture(scope="module", params=[(0.01, LOST), (0.16, "tracking.grid = 0.16: points 20 px apart .*")])
def repository(request, tmp_path_factory):
    """A repository of images of 128 px, and the reason why nothing has a strain in it."""
    grid, expected = request.param
    tracking = Tracking(trackers={"one": PhaseCorrelation(window_px=16)}, grid=grid)
    config = finished.configured(seeds=(1,), bmode=Bmode(size_px=128, downsampling=(1,)), tracking=tracking)
    folder = finished.finish(tmp_path_factory.mktemp("unknown") / "small", config, unknown_strain)
    return et.Repository(folder), expected


def test_table_has_the_reason_beside_what_is_not_known(repository):
    found, expected = repository
    table = found.summary()
    strain = table[~table["quantity"].isin(["rotation", "twist"])]
    assert len(strain) and strain["tracked_es"].isna().all() and strain["no_estimate"].str.fullmatch(expected).all()
    others = table[table["quantity"] == "rotation"]
    assert len(others) and others["tracked_es"].notna().all() and (others["no_estimate"] == "").all()


def test_scores_have_the_reason_beside_what_is_not_known(repository):
    found, expected = repository
    clips, segments, _ = found.metrics()
    for table, name in ((found.scores, "e_rr_rms_pp"), (clips, "e_rr_rms_pp"), (segments, "tracked_es_percent")):
        assert len(table) and table[name].isna().all() and table["no_estimate"].str.fullmatch(expected).all()


def test_report_lists_it(repository):
    found, expected = repository
    listed = failures(found)["no_estimate"]
    strains = {"mid": "gcs, gcs_endocardial, radial", "long_axis": "gls, gls_endocardial, radial"}
    assert {one["view"]: one["quantities"] for one in listed} == strains
    assert all(one["trackers"] == "one" for one in listed)
    assert all(one["reason"].startswith(expected.removesuffix(".*")) for one in listed)


def test_viewer_says_it(repository):
    found, expected = repository
    page = Page(found, first(found), "", Document())
    page.show()
    said = page.message.text
    assert f"one has no estimate of this strain: {expected.removesuffix('.*')}" in said
