"""Curves, peaks, twist and their table as they are read from a repository whose numbers are known."""

import numpy as np
import pytest
from finished_repository import finish
from known_repository import FRAMES, SETTINGS, SIZES, Known, overlaid

import echotruth as et

pytestmark = pytest.mark.slow

VIEWS = {
    "apical": {"position": 0.8},
    "mid": {"position": 0.5},
    "basal": {"position": 0.2},
    "long": {"plane": "long_axis"},
}
ES = 1
COURSE = np.array([0, 1.0, 1.1])
"""Of all curves: the peak comes after end-systole."""
TURN = {"apical": 0.16, "mid": 0.08, "basal": -0.04}
FACTOR = {"one": 0.9, "two": 0.5}
"""How much of everything a tracker finds in the largest images."""


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """Two trackers that find nine and five tenths of everything, at two image sizes."""
    folder, config = tmp_path_factory.mktemp("curves") / "known", et.configure(SETTINGS | {"views": VIEWS})
    known = Known(folder, config, et.beat(config, progress=False))
    return finish(folder, config, lambda job: result(job, known))


def result(job, known):
    """Arrays of a job: those of a heart at end-systole in frame `ES`, and curves of the trackers."""
    arrays = overlaid(job, known.arrays(job))
    if job.stage == "mechanics":
        return arrays | {"mechanics": arrays["mechanics"] | {"es_frame": ES}}
    if job.stage == "tracking":
        found = [tracked(job.view_name, job.tracker, 0.5**k) for k in range(len(SIZES))]
        arrays[f"tracking/{job.tracker}"] |= {name: np.stack([one[name] for one in found]) for name in found[0]}
    if job.stage == "points":
        arrays["points"] |= true(job.view_name)
    return arrays


def courses(view):
    """Curves of one view: the magnitude tells contour, region and component apart."""
    contours, component = np.array([-0.3, -0.2, -0.1]), np.array([0.4, -0.2, 0.05])
    regions, segments, measure = 1 + np.arange(7) / 10, 1 + np.arange(17) / 20, np.array([1.0, 1.1])

    def outer(*factors):
        product = COURSE
        for factor in factors:
            product = np.multiply.outer(product, factor)
        return product

    return {
        "region_strain": outer(measure, regions, component),
        "segment_strain": outer(measure, segments, component),
        "line_strain": outer(contours),
        "rotation": TURN.get(view, np.nan) * COURSE,
    }


def true(view):
    """True curves, in which the magnitude tells the references apart: heart, plane, operator."""
    found = {f"true_{name}": values for name, values in courses(view).items()}
    for name in ("true_region_strain", "true_segment_strain"):
        found[name] = np.multiply.outer([3.0, 1.0, 2.0], found[name])
    return found


def tracked(view, name, factor):
    """Curves that a tracker found."""
    return {f"tracked_{course}": factor * FACTOR[name] * values for course, values in courses(view).items()}


def test_curves_of_a_clip_stand_at_their_labels(repository):
    curves = et.Repository(repository).curves(view="mid", tracker="one")
    frame = curves.isel(frame=ES)
    line = frame[["true_line_strain", "tracked_line_strain"]].sel(contour="middle")
    np.testing.assert_allclose([line["true_line_strain"], line["tracked_line_strain"]], [-0.2, -0.18], atol=1e-6)
    place = {"measure": "green_lagrange", "region": 3, "wall_component": "TT"}
    assert float(frame["true_region_strain"].sel(place)) == pytest.approx(-0.2 * 1.1 * 1.3, abs=1e-6)
    place = {"measure": "engineering", "aha": 9, "wall_component": "RR"}
    assert float(frame["tracked_segment_strain"].sel(place)) == pytest.approx(0.9 * 0.4 * 1.4, abs=1e-6)
    assert float(frame["tracked_rotation"]) == pytest.approx(0.9 * 0.08, abs=1e-6)
    assert curves.attrs["es_frame"] == ES and curves.attrs["plane"] == "short_axis"
    np.testing.assert_allclose(curves["time"], 0.12 / FRAMES * np.arange(FRAMES))
    assert curves["true_rotation"].attrs["units"] == "rad" and curves["true_rotation_rate"].attrs["units"] == "rad s-1"


def test_tracked_curves_are_those_of_the_size_and_the_truth_is_the_same(repository):
    large, small = (et.Repository(repository).curves(view="mid", tracker="two", size=size) for size in (128, 64))
    np.testing.assert_allclose(small["tracked_line_strain"], 0.5 * large["tracked_line_strain"], atol=1e-6)
    np.testing.assert_array_equal(small["true_line_strain"], large["true_line_strain"])


def test_truth_is_that_of_the_reference_asked_for_and_of_the_plane_if_none_is(repository):
    place = {"measure": "engineering", "region": 0, "wall_component": "RR", "frame": ES}
    read = et.Repository(repository)
    found = {
        name: float(read.curves(view="mid", tracker="one", **given)["true_region_strain"].sel(place))
        for name, given in {"": {}, **{name: {"reference": name} for name in ("heart", "plane", "operator")}}.items()
    }
    assert found == pytest.approx({"": 0.4, "heart": 1.2, "plane": 0.4, "operator": 0.8}, abs=1e-6)


def test_peaks_come_after_end_systole_where_the_curve_says_so(repository):
    curves = et.Repository(repository).curves(view="mid", tracker="one")
    middle = et.strain_peaks(curves).sel(contour="middle")
    step = 0.12 / FRAMES
    values = [float(middle[f"true_line_strain_{name}"]) for name in ("es", "peak", "time_to_peak", "systolic_rate")]
    # Shortening is fastest at the start, where the parabola through the three frames has this slope.
    np.testing.assert_allclose(values, [-0.2, -0.22, 2 * step, -0.2 * (4 - 1.1) / (2 * step)], rtol=1e-5)
    assert "frame" not in et.strain_peaks(curves).dims


def test_twist_is_the_rotation_of_the_apex_less_that_of_the_base(repository):
    twist = et.Repository(repository).twist(tracker="one")
    assert (twist.attrs["basal_view"], twist.attrs["apical_view"]) == ("basal", "apical")
    np.testing.assert_allclose(twist["true_twist"], 0.2 * COURSE, atol=1e-6)
    np.testing.assert_allclose(twist["tracked_twist"], 0.18 * COURSE, atol=1e-6)
    peaks = et.strain_peaks(twist)
    assert float(peaks["true_twist_peak"]) == pytest.approx(0.22, abs=1e-6)


def test_table_has_the_numbers_of_the_curves_of_every_view_and_of_the_heart(repository):
    table = et.Repository(repository).summary(trackers=["one"]).set_index(["view", "quantity"])
    np.testing.assert_allclose(table.loc[("long", "gls"), "tracked_es"], -18, atol=1e-4)
    np.testing.assert_allclose(table.loc[("mid", "gcs_endocardial"), "true_peak"], -33, atol=1e-4)
    np.testing.assert_allclose(
        table.loc[("all", "radial"), ["tracked_es", "true_es"]].astype(float), [36, 40], atol=1e-4
    )
    np.testing.assert_allclose(table.loc[("all", "twist"), "true_es"], np.degrees(0.2), atol=1e-4)
    np.testing.assert_allclose(table.loc[("basal", "rotation"), "true_es"], np.degrees(-0.04), atol=1e-4)
    for (view, quantity), curve, place in (
        (("mid", "gcs"), "line_strain", {"contour": "middle"}),
        (("long", "radial"), "region_strain", {"measure": "engineering", "region": 0, "wall_component": "RR"}),
    ):
        peaks = et.strain_peaks(et.Repository(repository).curves(view=view, tracker="one")).sel(place)
        for what in ("tracked", "true"):
            of = f"{what}_{curve}"
            row = table.loc[(view, quantity)]
            assert row[f"{what}_time_to_peak_ms"] == pytest.approx(1e3 * float(peaks[f"{of}_time_to_peak"]))
            assert row[f"{what}_systolic_rate"] == pytest.approx(float(peaks[f"{of}_systolic_rate"]))
    assert ("long", "gcs") not in table.index and ("mid", "gls") not in table.index
    assert set(table.loc[("all", "twist"), ["unit", "rate_unit"]]) == {"degree", "degree s-1"}


def test_mean_of_a_heart_is_over_all_its_views_or_there_is_none(repository):
    table = et.Repository(repository).summary(trackers=["one"], views=["basal", "apical", "long"])
    of_heart = set(table.loc[table["view"] == "all", "quantity"])
    assert of_heart == {"gls", "gls_endocardial", "twist"}


@pytest.mark.parametrize(
    "given, expected",
    [
        ({"tracker": "three"}, r"^tracker = 'three': use one of one, two\.$"),
        ({"size": 512}, r"^size = 512: use one of 128, 64"),
        ({"view": "top"}, r"^view = 'top': use one of apical, mid, basal, long\.$"),
        ({"case": "other"}, r"^case = 'other': use one of heart\.$"),
        ({"reference": "truth"}, r"^reference = 'truth': use one of heart, plane, operator\.$"),
    ],
)
def test_what_there_is_not_is_refused_in_one_sentence(repository, given, expected):
    with pytest.raises(ValueError, match=expected):
        et.Repository(repository).curves(**{"tracker": "one"} | given)


def test_curves_without_their_attributes_have_no_peaks(repository):
    curves = et.Repository(repository).curves(view="mid", tracker="one").drop_attrs()
    with pytest.raises(ValueError, match="lost its attribute es_frame"):
        et.strain_peaks(curves)
    with pytest.raises(ValueError, match=r"^view = 'top': use one of"):
        et.Repository(repository).summary(views=["top"])


def test_clips_have_the_strain_of_the_middle_line_and_its_rate(repository):
    clips = et.Repository(repository).metrics(sizes=[128], trackers=["one"]).clips.set_index("view")
    mid, long = clips.loc["mid"], clips.loc["long"]
    assert list(mid[["tracked_gcs_percent", "true_gcs_percent"]]) == pytest.approx([-18, -20], abs=1e-4)
    assert list(long[["tracked_gls_percent", "true_gls_percent"]]) == pytest.approx([-18, -20], abs=1e-4)
    assert np.isnan(mid["true_gls_percent"]) and np.isnan(long["tracked_gcs_percent"])
    rate = -0.2 * (4 - 1.1) / (2 * 0.12 / FRAMES)
    found = mid[["true_strain_rate_per_s", "tracked_strain_rate_per_s", "strain_rate_error_per_s"]]
    assert list(found) == pytest.approx([rate, 0.9 * rate, 0.1 * -rate], rel=1e-4)


def test_segments_that_a_view_shows_have_their_peaks(repository):
    found = et.Repository(repository).metrics(views=["mid", "long"], sizes=[64], trackers=["two"])
    table = found.segments.set_index(["view", "aha", "component"])
    assert {aha for view, aha, _ in table.index if view == "mid"} == set(range(7, 13))
    assert set(table.loc["long"].index.get_level_values("component")) == {"radial", "longitudinal"}
    row, radial = table.loc["mid", 9, "circumferential"], table.loc["mid", 9, "radial"]
    # The curve is at its peak after end-systole; the truth is that of the plane, and at 64 px half of it is found.
    values = row[["true_es_percent", "true_peak_percent", "tracked_peak_percent"]]
    assert list(values) == pytest.approx([-28, -30.8, -7.7], abs=1e-4)
    assert row["true_time_to_peak_ms"] == pytest.approx(2 * 120 / FRAMES)
    assert radial["true_peak_percent"] == pytest.approx(61.6, abs=1e-4) and radial["true_systolic_rate_per_s"] > 0
    clip = found.clips.set_index("view").loc["mid"]
    of_mid = table.loc["mid"].query("component == 'circumferential'")
    assert of_mid["points"].sum() == clip["points"] and (of_mid["infarct_share"] == 0).all()
    error = 0.75 * -of_mid["true_peak_percent"].mean()
    assert list(clip[["segment_peak_error_pp", "segment_peak_bias_pp"]]) == pytest.approx([error, error], rel=1e-5)
    assert clip["segment_time_to_peak_error_ms"] == 0
