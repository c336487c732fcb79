"""The player of the page, clicked through in a browser."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from echotruth.report import style

pytestmark = pytest.mark.slow


@pytest.fixture
def player(browser, reported):
    """The page, opened from its file without a network; scripts must not fail."""
    errors = []
    page = browser.new_page(viewport={"width": 1300, "height": 900}, offline=True, reduced_motion="reduce")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((reported.folder / "report.html").as_uri())
    page.wait_for_function("document.getElementById('clock').textContent.length > 0")
    yield page
    page.close()
    assert errors == []


def amber(page) -> np.ndarray:
    """Which pixels of the screen have the colour of true motion, (row, column)."""
    picture = np.asarray(Image.open(BytesIO(page.locator("#screen").screenshot())).convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (red > 220) & (abs(green - 176) < 25) & (blue < 60)


def centre(hit: np.ndarray) -> np.ndarray:
    return np.argwhere(hit).mean(axis=0)


def test_points_move_with_the_slider_as_the_tissue_does(player):
    player.locator("#frame").fill("0")
    first = centre(amber(player))
    player.locator("#frame").fill("2")
    last = centre(amber(player))
    # 3 px to the right and 2 px up: rows run downwards.
    assert last[1] - first[1] > 0 > last[0] - first[0]
    assert player.locator("#clock").inner_text().split()[1] == "ms"


def test_motion_can_be_left_out(player):
    player.locator("#frame").fill("2")
    assert amber(player).any()
    player.uncheck("#show-true")
    assert not amber(player).any()


def test_strain_is_drawn_at_first_and_tracked_motion_where_it_is_asked_for(player):
    player.locator("#frame").fill("2")
    shown = [player.evaluate("document.getElementById('screen').toDataURL()")]
    for box, act in (("#show-strain", player.uncheck), ("#show-tracked", player.check)):
        act(box)
        shown.append(player.evaluate("document.getElementById('screen').toDataURL()"))
    assert len(set(shown)) == 3


def test_view_is_chosen_and_curve_and_cursor_follow(player):
    before = player.locator("#course-title").inner_text()
    player.click("[data-view=long]")
    assert player.locator("[data-view=long]").get_attribute("aria-pressed") == "true"
    assert "Longitudinal" in player.locator("#course-title").inner_text() != before
    player.locator("#frame").fill("0")
    start = float(player.locator("#cursor").get_attribute("x1"))
    player.click("#on")
    assert float(player.locator("#cursor").get_attribute("x1")) > start


def test_clip_plays_and_stops(player):
    player.locator("#frame").fill("0")
    player.click("#play")
    player.wait_for_function("document.getElementById('frame').value !== '0'")
    player.click("#play")
    assert player.locator("#play").inner_text() == "Play"


def test_nothing_is_wider_than_the_window(player):
    for width in (390, 1300):
        player.set_viewport_size({"width": width, "height": 900})
        assert player.evaluate("document.documentElement.scrollWidth") <= width


def test_what_goes_on_beyond_the_window_has_a_shade_there_until_it_is_scrolled_to(player):
    player.set_viewport_size({"width": 390, "height": 900})
    table = player.locator("#trackers .scroll")

    def edge():
        """Darkest shade of grey above the headings at the right side."""
        picture = Image.open(BytesIO(table.screenshot())).convert("L")
        return int(np.asarray(picture)[:3, -12:].min())

    assert table.evaluate("table => table.scrollWidth > table.clientWidth")
    assert edge() < 230
    table.evaluate("table => { table.scrollLeft = table.scrollWidth; }")
    assert edge() > 250


def test_tracked_paths_have_the_colour_of_the_curve_of_their_tracker(player, reported):
    path = player.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--tracked')")
    figure = (reported.folder / "figures/curves.svg").read_text(encoding="utf-8")
    assert path.strip() in style.SERIES and path.strip() in figure
    assert 'stroke="var(--tracked)"' in player.locator("#course").inner_html()


def test_text_and_axes_stand_out_from_the_paper():
    others = (style.INK, style.MUTED, style.TARGET, style.RADIAL, style.CIRCUMFERENTIAL, style.LONGITUDINAL)
    colours = [*others, *(colour for colour, _ in style.SIZES[:2]), *style.SERIES[:4]]
    ratios = [(luminance(style.PAPER) + 0.05) / (luminance(colour) + 0.05) for colour in colours]
    assert ratios[0] > 10 and ratios[1] > 4.5  # WCAG 2.2, contrast of text
    assert min(ratios) > 2.5


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.2."""
    channels = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])
