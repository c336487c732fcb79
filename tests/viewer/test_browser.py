"""The page in a browser, clicked through: what it shows are the stored numbers, at their place."""

import io

import numpy as np
import pytest
from known_repository import FRAMES, SIZES, known_images
from matplotlib.colors import to_rgb
from PIL import Image

from echotruth.viewer.panel import PATHS
from echotruth.viewer.tint import COLOURS

pytestmark = pytest.mark.slow

MODEL = "name => Bokeh.documents[0].get_model_by_name(name)"
PATIENCE = 60_000
"""ms, on a machine that is busy."""


def column(page, source, name):
    """Column of a data source, as numbers."""
    return page.evaluate(f"([source, name]) => Array.from(({MODEL})(source).data[name])", [source, name])


def picture(page, name="picture_first"):
    """Red, green and blue of the picture as it is drawn, (axial, lateral, 3)."""
    words = page.evaluate(f"name => Array.from(({MODEL})(name).data.image[0])", name)
    size = round(len(words) ** 0.5)
    return np.array(words, np.uint32).view(np.uint8).reshape(size, size, 4)[..., :3]


def wait(page, condition):
    page.wait_for_function(condition, timeout=PATIENCE)


def drawn_frame(page, number):
    wait(page, f"echotruth.frame === {number} && !echotruth.pending")


def scrub(page, steps):
    page.locator(".noUi-handle").nth(1).focus()  # the first is that of the opacity
    for _ in range(steps):
        page.keyboard.press("ArrowRight")


def choose(page, label, value):
    """Choose in a list, and wait until what was chosen is drawn."""
    before = page.evaluate("location.search")
    page.get_by_label(label, exact=True).select_option(label=value)
    page.wait_for_function("before => location.search !== before", arg=before, timeout=PATIENCE)
    wait(page, "!echotruth.pending")


def screenshot(page, figure="figure_first"):
    """The figure as it is on the screen, (row, column, 3)."""
    canvas = page.locator(".bk-Canvas").nth({"figure_first": 0, "figure_second": 1}[figure])
    return np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB")).astype(int)


def pixels_of(image, colour):
    """How many pixels have nearly a colour."""
    return int((np.abs(image - 255 * np.array(to_rgb(colour))).max(-1) < 40).sum())


def test_scrubbing_shows_the_stored_frame_and_moves_the_cursor(page):
    for frame in range(FRAMES):
        drawn_frame(page, frame)
        assert (picture(page) == known_images(SIZES[0])[frame][..., None]).all()
        time = column(page, "times", "time")[frame]
        cursors = [
            page.evaluate(f"name => ({MODEL})(name).location", f"cursor_{name}") for name in ("strain", "volume")
        ]
        assert cursors == [time, time]
        scrub(page, 1)


def test_bright_block_near_the_array_is_at_the_top_right_on_the_screen(page):
    image = screenshot(page).mean(-1)
    bright = np.argwhere(np.abs(image - 220) < 4)
    middle = np.median(bright, axis=0) / image.shape
    assert len(bright) > 1000
    assert middle[0] < 0.35 and middle[1] > 0.6


def test_view_and_size_change_by_a_click_and_are_in_the_address(page, opened):
    choose(page, "Size (px)", str(SIZES[1]))
    assert picture(page).shape[0] == SIZES[1]
    assert (picture(page) == known_images(SIZES[1])[0][..., None]).all()
    choose(page, "View", "long")
    assert "view=long" in page.url and f"size={SIZES[1]}" in page.url
    again = opened(page.url.partition("/?")[2].join(["?", ""]))
    assert again.get_by_label("View", exact=True).input_value() == "long"
    assert picture(again).shape[0] == SIZES[1]
    again.close()


def test_paths_appear_and_disappear_by_a_click(page):
    scrub(page, FRAMES - 1)
    drawn_frame(page, FRAMES - 1)
    for kind in ("true", "tracked"):
        for shown in (True, False):
            page.get_by_text(f"{kind} paths", exact=True).click()
            wait(page, f"(({MODEL})('{kind}_first').data.x0.length > 0) === {str(shown).lower()}")
            page.wait_for_timeout(500)
            assert (pixels_of(screenshot(page), PATHS[kind]) > 50) is shown


def test_second_tracker_has_a_picture_and_a_curve_of_its_own(page):
    assert not page.evaluate(f"({MODEL})('figure_second').visible")
    choose(page, "Beside it", "two")
    assert page.evaluate(f"({MODEL})('figure_second').visible")
    assert (picture(page, "picture_second") == known_images(SIZES[0])[0][..., None]).all()
    curves = [np.unique(column(page, "curves_strain", name)) for name in ("y0", "y1", "y2")]
    np.testing.assert_allclose(curves, [[-14], [-12], [-22]], atol=1e-4)


def test_colour_is_over_the_wall_and_grey_elsewhere(page, shown):
    choose(page, "Colour", COLOURS["displacement_error"])
    seen = picture(page)
    coloured = np.ptp(seen.astype(int), axis=-1) > 0
    row, col = np.floor(shown.position[:, ::-1] / 12e-3 * SIZES[0] + [0, SIZES[0] / 2]).astype(int).T
    assert coloured[row, col].all()
    assert not coloured[:10].any() and not coloured[60:68, 60:68].any()
    choose(page, "Colour", COLOURS["none"])
    assert (picture(page) == known_images(SIZES[0])[0][..., None]).all()


def test_pointer_says_the_place_and_the_grey_level(page):
    box = page.locator(".bk-Canvas").first.bounding_box()
    for step in range(3):
        page.mouse.move(box["x"] + 300 + step, box["y"] + 300)
    wait(page, f"({MODEL})('pointer').text.includes('mm, depth')")
    assert page.evaluate(f"({MODEL})('pointer').text").endswith("grey level 10")


def test_page_opens_playing_in_colour_with_paths_until_it_is_paused_and_goes_on_when_it_is_told(opened):
    page = opened("?tracker=one")
    before = page.evaluate("echotruth.drawn")
    wait(page, f"echotruth.drawn > {before + 2 * FRAMES} && ({MODEL})('true_first').data.x0.length > 0")
    assert page.evaluate(f"({MODEL})('colour_first').data.index[0].length") == FRAMES * SIZES[0] ** 2
    page.get_by_text("Pause").click()
    wait(page, "location.search.endsWith(`frame=${echotruth.frame}`)")
    page.wait_for_timeout(300)
    stopped = page.evaluate("echotruth.drawn")
    page.wait_for_timeout(300)
    assert page.evaluate("echotruth.drawn") == stopped
    page.get_by_text("▶ Play").click()
    wait(page, f"echotruth.drawn > {stopped + 1}")
    page.close()


def test_path_is_all_steps_up_to_the_frame(page):
    page.get_by_text("true paths", exact=True).click()
    lengths = []
    for frame in range(FRAMES):
        drawn_frame(page, frame)
        wait(page, f"({MODEL})('true_first').data.x0.length > 0")
        lengths.append(len(column(page, "true_first", "x0")))
        scrub(page, 1)
    assert lengths == [lengths[0] * (frame + 1) for frame in range(FRAMES)]


GEOMETRY = """() => {
    const frames = ["figure_first", "figure_second"].map(name => Bokeh.documents[0].get_model_by_name(name))
        .filter(figure => figure.visible).map(figure => Bokeh.index.find_one(figure));
    const graph = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("graph_strain")).el.getBoundingClientRect();
    return {
        right: frames.map(view => view.el.getBoundingClientRect().right),
        sides: frames.map(view => [view.frame.bbox.width, view.frame.bbox.height]),
        graph: [graph.left, graph.right], wide: document.documentElement.scrollWidth,
    };
}"""


@pytest.mark.parametrize(
    ("width", "least", "query"),
    [(390, 120, ""), (1280, 380, "&colour=strain&other=truth")],
)
def test_pictures_are_square_and_fill_the_window_with_the_graphs(opened, width, least, query):
    page = opened(f"?tracker=one&frame=0{query}", width)
    page.wait_for_timeout(1500)
    found = page.evaluate(GEOMETRY)
    for across, along in found["sides"]:
        assert abs(across - along) <= 1 and across >= least
    assert found["wide"] == width and max(found["right"]) <= width
    assert width - found["graph"][1] < 20
    page.close()
