"""Which hearts the figures and scores take in."""

import numpy as np
import pytest
import xarray as xr

from echotruth.config import Config, Physiology
from echotruth.report.figures import Figures

pytestmark = pytest.mark.filterwarnings("ignore")  # of the little store that stands for a repository


def figures(tmp_path, statuses, exclude):
    """Figures of a repository of which nothing but the verdicts is there."""
    xr.DataTree.from_dict({"/cases": xr.Dataset({"status": ("case", np.array(statuses))})}).to_zarr(tmp_path / "a.zarr")
    return Figures(tmp_path / "a.zarr", Config(physiology=Physiology(exclude_implausible=exclude)), tmp_path)


@pytest.mark.parametrize("exclude", [True, False])
def test_only_complete_hearts_are_shown_where_there_are_any(tmp_path, exclude):
    shown = figures(tmp_path, ["implausible", "complete", "failed", "complete", "retired"], exclude)
    assert list(shown.complete) == [1, 3]


def test_implausible_hearts_are_shown_where_there_are_no_others_and_they_were_imaged(tmp_path):
    assert list(figures(tmp_path, ["failed", "implausible"], exclude=False).complete) == [1]


def test_no_heart_to_show_is_said(tmp_path):
    with pytest.raises(ValueError, match="no case is complete: see the reasons in cases/reason"):
        figures(tmp_path, ["failed", "implausible"], exclude=True)
