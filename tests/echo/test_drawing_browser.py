"""The page on which a wall is drawn, in a browser: a ring that is clicked is the ring that is saved."""

import numpy as np
import pytest
from served_page import served_page

import echotruth as et
from echotruth.echo.wall import clicked_points, write_wall

pytestmark = pytest.mark.slow

SHAPE, CENTRE, RADII, POINTS = (240, 320), np.array([160.0, 120.0]), {"endocardium": 50.0, "epicardium": 80.0}, 12
PATIENCE = 60_000
"""ms, on a machine that is busy."""


def circle(radius, points=POINTS):
    angle = 2 * np.pi * np.arange(points) / points
    return CENTRE + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def area(outline):
    """Area inside a closed outline (n, 2), px2."""
    x, y = outline.T
    return abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with a clip of a ring that grows thicker."""
    folder = tmp_path_factory.mktemp("drawn")
    distance = np.hypot(*np.meshgrid(np.arange(SHAPE[1]) - CENTRE[0], np.arange(SHAPE[0]) - CENTRE[1]))
    frames = [np.where((distance > 50 - 2 * frame) & (distance < 80), 200, 20) for frame in range(5)]
    np.save(folder / "clip.npy", np.array(frames, np.uint8))
    return folder


@pytest.fixture(scope="module")
def address(folder):
    options = ["--spacing-mm", "0.3", "--frame-time-ms", "20", "--crop", "0", "0", "320", "240"]
    with served_page("draw", str(folder / "clip.npy"), *options) as address:
        yield address


@pytest.fixture
def page(browser, address, folder):
    """The page, without a wall; a script that fails in it, fails the test."""
    (folder / "clip.wall.csv").unlink(missing_ok=True)
    errors = []
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.on("pageerror", lambda error: errors.append(str(error)))
    load(page, address)
    yield page
    page.close()
    assert errors == []


def load(page, address):
    page.goto(address)
    page.wait_for_function("() => echotruth.drawn > 0", timeout=PATIENCE)


def at(page, place):
    """Place in the window of a point of the clip."""
    box = page.locator("#canvas").bounding_box()
    lateral, axial = page.evaluate("point => echotruth.toScreen(point)", list(map(float, place)))
    return box["x"] + lateral, box["y"] + axial


def click(page, *places, button="left"):
    for place in places:
        page.mouse.click(*at(page, place), button=button)


def drag(page, start, end):
    page.mouse.move(*at(page, start))
    page.mouse.down()
    page.mouse.move(*at(page, end), steps=3)
    page.mouse.up()


def said(page, beginning):
    """Wait for a message that begins so, and return it."""
    page.wait_for_function(
        "text => document.getElementById('message').textContent.startsWith(text)", arg=beginning, timeout=PATIENCE
    )
    return page.locator("#message").inner_text()


def save(page):
    page.locator("#save").click()
    said(page, "Saved")


def draw_ring(page, view="mid"):
    page.select_option("#view", view)
    for part, radius in RADII.items():
        page.locator(f"#{part}").click()
        click(page, *circle(radius))


def test_ring_that_is_clicked_is_saved_with_its_area_and_insertions(page, folder):
    draw_ring(page)
    for part, axial in (("anterior", 62), ("inferior", 178)):
        page.locator(f"#{part}_insertion").click()
        click(page, (105, axial))
    save(page)
    wall = et.read_wall(folder / "clip.wall.csv")
    assert wall.view == "mid"
    for part, radius in RADII.items():
        outline = getattr(wall, part)
        assert area(outline) == pytest.approx(np.pi * radius**2, rel=0.01)
        steps = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        assert np.all((steps > 0.7) & (steps < 1.1))
    np.testing.assert_allclose(wall.insertions, [[105, 62], [105, 178]], atol=0.5)


def test_saved_wall_is_loaded_and_saved_again_as_it_was(page, folder, address):
    draw_ring(page)
    save(page)
    file = folder / "clip.wall.csv"
    before, clicked = et.read_wall(file), clicked_points(file)
    load(page, address)
    assert page.locator("#view").input_value() == "mid"
    save(page)
    after = et.read_wall(file)
    for part, points in clicked_points(file).items():
        assert len(points) == POINTS
        np.testing.assert_allclose(points, clicked[part], atol=0.011)
        assert area(getattr(after, part)) == pytest.approx(area(getattr(before, part)), rel=1e-3)


def test_wall_of_another_program_is_corrected_at_few_points(page, folder, address):
    wall = et.Wall(circle(RADII["endocardium"], 300), circle(RADII["epicardium"], 500), "apical")
    write_wall(folder / "clip.wall.csv", wall)
    load(page, address)
    save(page)
    assert all(8 <= len(points) < 15 for points in clicked_points(folder / "clip.wall.csv").values())
    corrected = et.read_wall(folder / "clip.wall.csv")
    for part, radius in RADII.items():
        assert np.abs(np.linalg.norm(getattr(corrected, part) - CENTRE, axis=1) - radius).max() < 0.6


def test_points_are_dragged_put_in_between_deleted_and_undone(page, folder):
    draw_ring(page)
    save(page)
    drawn = (folder / "clip.wall.csv").read_text()
    points = circle(RADII["epicardium"])

    def saved():
        save(page)
        return et.read_wall(folder / "clip.wall.csv").epicardium

    drag(page, points[0], (260, 120))
    assert saved()[:, 0].max() == pytest.approx(260, abs=1)
    page.keyboard.press("Control+z")
    between = circle(RADII["epicardium"], 2 * POINTS)[1]
    click(page, between + [-1.0, 0.0])  # near the curve
    outline = saved()
    assert area(outline) == pytest.approx(np.pi * RADII["epicardium"] ** 2, rel=0.01)
    page.keyboard.press("Delete")  # the point that was put in
    assert len(saved()) == drawn.count("epicardium")
    click(page, points[3], button="right")
    assert np.linalg.norm(saved() - points[3], axis=1).min() > 1
    page.locator("#undo").click()
    save(page)
    assert (folder / "clip.wall.csv").read_text() == drawn


def test_long_axis_is_open_and_has_no_insertions(page, folder):
    page.select_option("#view", "four_chamber")
    assert not page.locator("#anterior_insertion").is_visible()
    for part, radius in RADII.items():
        page.locator(f"#{part}").click()
        click(page, *circle(radius)[: POINTS // 2 + 1])
    save(page)
    wall = et.read_wall(folder / "clip.wall.csv")
    assert wall.plane == "long_axis"
    np.testing.assert_allclose(wall.endocardium[[0, -1]], [[210, 120], [110, 120]], atol=0.5)
    ring_area = np.pi * (RADII["epicardium"] ** 2 - RADII["endocardium"] ** 2)
    assert wall.mask(SHAPE).sum() == pytest.approx(ring_area / 2, rel=0.02)


def test_what_is_wrong_is_said_in_the_page(page, folder):
    page.locator("#save").click()
    assert (
        said(page, "Not saved") == "Not saved. endocardium: give three points or more, (n, 2) lateral and axial in px"
    )
    for part, radius in zip(RADII, reversed(RADII.values()), strict=True):
        page.locator(f"#{part}").click()
        click(page, *circle(radius))
    page.locator("#save").click()
    assert said(page, "Not saved. the endocardium is not inside the epicardium")
    assert not (folder / "clip.wall.csv").exists()


def test_end_diastole_is_chosen_saved_and_drawn_in(page, folder, address):
    for frame, button in ((1, "#first"), (4, "#next")):
        page.locator("#frame").fill(str(frame))
        page.locator(button).click()
    page.locator("#frame").fill("2")
    page.locator("#next").click()
    said(page, "Choose a frame 3 or more after end-diastole, 1.")
    click(page, CENTRE)  # back to end-diastole
    page.wait_for_function("() => echotruth.frame === 1", timeout=PATIENCE)
    draw_ring(page)
    save(page)
    assert et.read_wall(folder / "clip.wall.csv").part == "cycle 1 4, crop 0 0 320 240"
    load(page, address)
    assert page.evaluate("echotruth.frame") == 1 and "1 / 4" in page.locator("#time").inner_text()
