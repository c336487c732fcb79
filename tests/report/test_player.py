"""The player of the page, clicked through in a browser."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

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
