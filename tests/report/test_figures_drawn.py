import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from PIL import Image

from echotruth.config import Geometry
from echotruth.evaluation.leaderboard import best, standings
from echotruth.heart import Heart
from echotruth.mechanics.geometry import left_ventricle
from echotruth.report import (
    bullseye,
    curves,
    error,
    leaderboard,
    loop,
    physiology,
    style,
    views,
)

TIME = np.arange(10) * 3e-3
WAVE = np.sin(np.pi * np.arange(10) / 10) ** 2


def seen(path):
    """The picture as RGB, after checking that something is drawn on it."""
    picture = np.asarray(Image.open(path).convert("RGB"))
    assert picture.shape[0] > 300 and picture.shape[1] > 300 and picture.std() > 5
    return picture


def cycle(pressure, intervals):
    """A heart that twists, shortens and moves its base as a raised cosine."""
    turns = {"rotation_base": -0.05 * WAVE, "rotation_apex": 0.1 * WAVE, "twist": 0.15 * WAVE}
    motion = {"base_motion": -5e-4 * WAVE, "apex_motion": 1e-4 * WAVE}
    strain_mean = WAVE[:, None] * [0.4, -0.17, -0.15, 0.0, 0.02, 0.03]
    loop = {"pressure": pressure, "volume": 50e-9 - 0 * TIME + 0 * pressure, "es_frame": 5, "time": TIME}
    durations = dict(zip(("ivc_time", "ejection_time", "ivr_time"), intervals, strict=True))
    later = np.linspace(1, 0.8, 5)
    levels = {
        "level_strain": strain_mean[:, None] * later[:, None],
        "level_fibre_strain": -0.15 * WAVE[:, None] * later,
    }
    return turns | motion | {"strain_mean": strain_mean} | levels | loop | durations


def coloured(picture, colour):
    """Number of pixels of a colour."""
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return np.count_nonzero((abs(picture.astype(int) - wanted) < 4).all(axis=-1))


@pytest.mark.slow
def test_physiology(tmp_path):
    published = physiology.PUBLISHED["mouse"]
    assert set(published) <= {"twist", *physiology.COMPONENTS}
    drawn = seen(
        style.save(physiology.draw(cycle(500 + 13000 * WAVE, (6e-3, 9e-3, 4e-3)), published), tmp_path / "a.png")
    )
    shades = coloured(drawn, style.SHADE)
    bare = seen(style.save(physiology.draw(cycle(500 + 13000 * WAVE, (np.nan,) * 3), published), tmp_path / "b.png"))
    assert shades > 10000 + coloured(bare, style.SHADE), "isovolumic phases are shaded where there are any"


@pytest.mark.slow
def test_views(tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (64, 64)).astype(np.uint8)
    box = np.array([[[-2.0, 4], [2, 4]], [[2, 4], [2, 7]], [[2, 7], [-2, 7]], [[-2, 7], [-2, 4]]])
    there = views.Where(np.array([[[-1.0, 0], [1, 0]], [[1, 0], [0, 2]]]), np.array([0.0, 1]), np.array([0.0, 0.5]))
    shown, outside = (views.Picture(image, border) for border in (box, box[:0]))
    one = {"mid": [shown] * 2, "long_axis": [outside] * 2}
    places = dict.fromkeys(one, there)
    with_wall = coloured(seen(style.save(views.draw(one, places, 12e-3), tmp_path / "one.png")), style.BORDER)
    without = {view: [outside] * 2 for view in one}
    planes = coloured(seen(style.save(views.draw(without, places, 12e-3), tmp_path / "two.png")), style.BORDER)
    assert with_wall > planes + 100 and planes > 100, "both planes and the wall have their lines"


@pytest.mark.parametrize(
    ("plane", "origin", "normal", "normal_on_page", "point"),
    [
        ("short_axis", (0, 6e-3, -2e-3), (0, 0, 1), (0, -1), (0, -1)),
        ("long_axis", (1e-3, 0, 0), (1, 0, 0), (-1, 0), (-1, 0)),
    ],
)
def test_place_of_a_view_is_a_line_across_a_section_with_the_apex_or_the_anterior_wall_up(
    plane, origin, normal, normal_on_page, point
):
    """A heart from z = -6 to 0 mm, so that its middle is at z = -3 mm."""
    mesh = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))
    nodes = mesh.nodes * 6e-3 / np.ptp(mesh.nodes[:, 2])
    nodes = nodes - [0, 0, nodes[:, 2].max()] - [0, 0, nodes[:, 2].mean() - nodes[:, 2].max() + 3e-3]
    solved = Heart(nodes, mesh.cells, np.zeros((1, *nodes.shape)), mesh.nodes[:, 0], mesh.endo, 1, 0)
    found = views.where(solved, plane, np.array(origin), np.array(normal))
    np.testing.assert_allclose(found.normal, normal_on_page, atol=1e-12)
    np.testing.assert_allclose(found.point, point, atol=1e-6)
    if plane == "short_axis":
        top = found.wall[np.argmax(found.wall[:, 0, 1]), 0]
        widths = [np.ptp(found.wall[found.wall[..., 1] * side > 1, 0]) for side in (1, -1)]
        assert top[0] == pytest.approx(0, abs=0.3) and widths[0] < widths[1], "the narrow end, the apex, is up"


def test_border_in_a_view_is_the_section_of_the_wall_in_that_frame(half_sphere, hemispherical_heart):
    """Half a sphere with radii of 2 and 3 mm, cut 1 mm from its centre, at rest and shrunk to nine tenths."""
    heart = hemispherical_heart(np.stack([0 * half_sphere.nodes, -0.1 * half_sphere.nodes]))
    for frame, scale in enumerate((1.0, 0.9)):
        ends = views.border(heart, frame, np.array([1e-3, 0, -1e-3]), np.eye(3)[:2]).reshape(-1, 2) + [1, 0]
        expected = np.sqrt((scale * np.array([2, 3])) ** 2 - 1)
        radii = np.hypot(*ends.T)
        assert np.abs(radii[:, None] - expected).min(1).max() < 0.01
        np.testing.assert_allclose([radii.min(), radii.max()], expected, atol=0.01)


@pytest.mark.slow
def test_leaderboard(tmp_path):
    random = np.random.default_rng(0)
    keys = [(f"h{k}", view, size, name) for k in range(5) for view in ("mid", "apex") for size in (64, 32)
              for name in ("one", "two", "failing")]  # fmt: skip
    table = pd.DataFrame(keys, columns=["case", "view", "size_px", "tracker"])
    for figure in ("nrmse_all_percent", "e_cc_rms_pp", "e_ll_rms_pp", "e_rr_rms_pp"):
        table[figure] = random.uniform(1, 30, len(table))
    failing = table["tracker"] == "failing"
    table.loc[failing, "nrmse_all_percent"] = 100.0
    table.loc[failing, ["e_cc_rms_pp", "e_rr_rms_pp"]] = np.nan
    ranked = standings(table.assign(failure=np.where(failing, "no motion", "")), 1)
    assert best(ranked)[-1] == "failing"
    whole = seen(style.save(leaderboard.draw(ranked, best(ranked)), tmp_path / "leaderboard.png"))
    without_radial = ranked.assign(e_rr_rms_pp=np.nan)
    assert (
        seen(style.save(leaderboard.draw(without_radial, best(ranked)), tmp_path / "two.png")).shape[1] < whole.shape[1]
    )


def test_bullseye_without_data_is_hatched_throughout(tmp_path):
    nothing = np.full(17, np.nan)
    seen(style.save(bullseye.draw([bullseye.Segments("Strain", nothing, nothing)], "none"), tmp_path / "bullseye.png"))
    figure = Figure()
    axes = figure.subplots()
    bullseye.disc(axes, nothing, bullseye.TwoSlopeNorm(0, -1, 1))
    assert all(wedge.get_hatch() for wedge in axes.patches) and len(axes.texts) == 4, "the names of four walls alone"


@pytest.mark.parametrize("number, position", [(1, (0, 0.85)), (2, (-0.74, 0.43)), (10, (0, -0.6)), (16, (0.38, 0.1))])
def test_segments_lie_where_they_should(number, position):
    """One segment red, the others blue: anterior at the top, septum on the left, base outermost."""
    figure = Figure()
    axes = figure.subplots()
    values = np.full(17, -1.0)
    values[number - 1] = 1.0
    bullseye.disc(axes, values, bullseye.TwoSlopeNorm(0, -1, 1))
    hit = [wedge for wedge in axes.patches if wedge.get_path().contains_point(position)]
    assert len(hit) == 1
    red, _, blue, _ = hit[0].get_facecolor()
    assert red > blue


def test_a_bad_tracker_does_not_flatten_a_good_one():
    """Errors of 5 and 10 um are told apart beside one of 900 um."""
    errors = {"bad": {64: np.full(6, 9e-4)}, "good": {64: np.linspace(5e-6, 1e-5, 6)}}
    figure = error.draw({"mid": errors})
    axes = figure.axes[0]
    figure.canvas.draw()
    heights = axes.transAxes.inverted().transform(axes.transData.transform([(1, 5), (1, 10), (1, 900)]))[:, 1]
    assert heights[1] - heights[0] > 0.08 and heights[0] > 0 and heights[2] < 1


def panel(tracked):
    return curves.Panel("GCS", "%", 1e3 * TIME, 15.0, -18 * WAVE, tracked)


def test_a_tracker_has_the_same_colour_whatever_its_rank():
    """The colour of its place in the configuration."""

    def colours(*ranked):
        panels = [[panel({name: WAVE for name in ranked})]]
        (legend,) = curves.draw(panels, ["first", "second"]).legends
        words = [text.get_text() for text in legend.get_texts()]
        return dict(zip(words, (line.get_color() for line in legend.get_lines()), strict=True))

    assert colours("first", "second") == colours("second", "first")
    assert colours("second")["second"] == style.series_colour(1)


def test_figure_without_a_suffix_is_also_an_svg_without_paper(tmp_path):
    path = style.save(
        loop.draw(TIME, 5, 4e4 * WAVE, np.stack([WAVE, 1 + WAVE]), np.stack([WAVE, 1 + WAVE])), tmp_path / "loop"
    )
    assert path == tmp_path / "loop.png" and seen(path)[0, 0].tolist() == [255, 255, 255]
    drawing = (tmp_path / "loop.svg").read_text(encoding="utf-8")
    assert style.INK in drawing and 'id="figure_1"' in drawing and "#ffffff" not in drawing.partition("axes_1")[0]


def test_same_figure_same_bytes(tmp_path):
    errors = {"mid": {"as_published": {64: np.full(6, 3e-5)}}}
    first, second = (style.save(error.draw(errors), tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert first == second
