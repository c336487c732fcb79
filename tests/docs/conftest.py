"""What the pages speak of, made in seconds."""

import learning_repository
import pytest
from finished_repository import configured

import echotruth as et
from echotruth.config import Bmode, Geometry, Rf, Tracking, View


@pytest.fixture(scope="session")
def demo(tmp_path_factory):
    """Folder, its name with a space, in which `out/demo` is a repository like that of config/demo.yaml."""
    folder = tmp_path_factory.mktemp("first hour")
    planes = {
        "base": View(position=0.2),
        "mid": View(),
        "apex": View(position=0.8),
        "long_axis": View(plane="long_axis"),
    }
    config = configured(
        name="demo",
        views=("mid",),
        cases={},
        bmode=Bmode(size_px=128, downsampling=(1,)),
        rf=Rf(lines=24, focal_zones=1),
        tracking=Tracking(grid=0.03, trackers={"dis": {"method": "dis"}, "bspline_dic": {"method": "bspline_dic"}}),
        geometry=Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
    ).model_copy(update={"views": planes})
    learning_repository.make(folder / "out/demo", config)
    return folder


COARSE = {
    "geometry": {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1},
    **{"loop": {"frames": 4}, "bmode": {"size_px": 128, "downsampling": (1,)}, "rf": {"lines": 24, "focal_zones": 1}},
    "phantom": {"density_per_mm3": 100.0},
}
"""Heart and images that are made in seconds."""


@pytest.fixture
def coarse(monkeypatch):
    """Hearts and images are as coarse as `COARSE`, whatever their configuration says."""
    configure = et.configure
    monkeypatch.setattr(et, "configure", lambda *given, **keys: configure(configure(*given, **keys), **COARSE))
