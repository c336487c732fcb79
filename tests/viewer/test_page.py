"""What can be chosen, what the address says, and what the page says where something is not there."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from urllib.parse import parse_qs

import numpy as np
import pytest
from bokeh.document import Document
from finished_repository import begin, configured
from known_repository import SIZES

from echotruth.report import style
from echotruth.repository.reader import Repository
from echotruth.viewer.choice import TRUTH, Choice, asked, first
from echotruth.viewer.page import Page
from echotruth.viewer.server import ShowError, opened, serve, texts
from echotruth.workflow.added_tracker import prepare

pytestmark = pytest.mark.slow


@pytest.fixture
def page(repository):
    made = Page(repository, replace(first(repository), colour="none"), "", Document())
    made.show()
    return made


def choose(page, **chosen):
    for name, value in chosen.items():
        page.inputs[name].value = value
    page.show()


@pytest.fixture(scope="session")
def unfinished(tmp_path_factory):
    """A repository of which no job is done."""
    folder = tmp_path_factory.mktemp("unfinished") / "small"
    begin(folder, configured())
    return folder


def test_address_leads_back_to_the_choice(repository):
    choice = Choice("heart", "long", SIZES[1], "two", TRUTH, "strain", "LL", "TT", "green_lagrange", "layer 2")
    assert asked(repository, parse_qs(choice.address)) == (choice, "")


def test_address_of_what_is_not_there_is_as_at_first_and_said(repository):
    query = {"case": ["none"], "view": ["../.."], "size": ["7"], "colour": ["<b>"], "frame": ["-1"], "else": ["x"]}
    choice, said = asked(repository, query)
    assert choice == first(repository)
    assert said.startswith("There is no case 'none', no view '../..', no size '7', no colour '<b>', no frame '-1' here")


def test_what_is_not_there_is_said_until_something_is_chosen(repository):
    page = Page(repository, *asked(repository, {"case": ["<i>"]}), Document())
    page.show()
    assert page.message.visible and "no case &#x27;&lt;i&gt;&#x27; here" in page.message.text
    choose(page, view="long")
    assert not page.message.visible


def test_page_shows_the_images_of_what_is_chosen(page):
    assert page.clip.data["grey"][0].shape[-1] == SIZES[0] and not page.message.visible
    choose(page, size=str(SIZES[1]), view="long", colour="strain")
    assert page.clip.data["grey"][0].shape[-1] == SIZES[1]
    assert page.panels[0].colour.data["index"][0].shape[-1] == SIZES[1]
    assert [name for name, _ in page.inputs["component"].options] == ["RR", "CC", "LL", "RC", "RL", "CL"]


def test_what_is_shown_already_is_not_sent_again(page):
    choose(page, colour="layer")
    grey, layers = page.clip.data["grey"][0], page.panels[0].colour.data["index"][0]
    choose(page, other="two", curve="RR")
    assert page.clip.data["grey"][0] is grey and page.panels[0].colour.data["index"][0] is layers


def test_truth_beside_a_tracker_has_its_strain_and_no_error(page):
    choose(page, other=TRUTH, colour="tracked_strain", component="RR")
    assert [panel.bar.title for panel in page.panels] == [
        "Tracked radial strain E_RR (%)",
        "True radial strain E_RR (%)",
    ]
    choose(page, colour="strain_error")
    assert page.panels[0].bar.visible and not page.panels[1].bar.visible


def test_paths_and_curve_of_a_tracker_have_one_colour(page):
    """That of its place in the configuration, whichever is chosen first."""
    trackers = page.repository.trackers
    for tracker, other in (trackers[:2], trackers[1::-1]):
        choose(page, tracker=tracker, other=other)
        paths = [panel._renderers["tracked"][0].glyph.line_color for panel in page.panels]
        curves = [line.glyph.line_color for line in page.graphs["strain"]._lines[1:3]]
        assert paths == curves == [style.series_colour(trackers.index(name)) for name in (tracker, other)]


def test_unfinished_case_is_said_so(unfinished):
    repository = Repository(unfinished)
    page = Page(repository, first(repository), "", Document())
    for colour in ("none", "strain", "tracked_strain", "segment"):
        choose(page, colour=colour, other=TRUTH)
        assert "Not made for this case" in page.message.text and "images" in page.message.text
        assert "<b>unfinished</b>" in page.facts.text
        assert not page.clip.data["grey"][0].any()


def test_damaged_file_is_said_and_nothing_else_is_shown(shown, tmp_path):
    folder = tmp_path / "known"
    shutil.copytree(shown.folder, folder)
    shard = folder / f"known.zarr/clips/heart/mid/bmode/{SIZES[0]}/image/c/0/0/0"
    content = bytearray(shard.read_bytes())
    content[len(content) // 3] ^= 0xFF
    shard.write_bytes(content)
    repository = Repository(folder)
    page = Page(repository, first(repository), "", Document())
    page.show()
    assert "cannot be shown" in page.message.text and f"echotruth check {folder}" in page.message.text
    assert not page.clip.data["grey"][0].any()
    choose(page, size=str(SIZES[1]))
    assert not page.message.visible and page.clip.data["grey"][0].any()


def test_added_tracker_is_shown_where_it_was_evaluated_and_elsewhere_said_to_be_missing(shown, tmp_path, monkeypatch):
    folder = Path(shutil.copytree(shown.folder, tmp_path / "known"))
    (tmp_path / "diagonal.py").write_text(
        "import numpy as np\n"
        "def track(frames, points, mask, spacing, frame_time, seed):\n"
        "    course = np.arange(len(frames))[:, None, None]\n"
        "    return course * np.ones((1, len(points), 2)), np.ones((len(frames), len(points)))\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    run = prepare(Repository(folder), "outside", {"method": "external", "track": "diagonal:track"})
    assert len(list(run.rows(run.case_views([], ["mid"])))) == len(SIZES)
    repository = Repository(folder)
    page = Page(repository, first(repository), "", Document())
    page.paths.active = [1]
    choose(page, tracker="outside", colour="displacement_error")
    assert "outside has no estimate of this strain" in page.message.text  # the contours of this wall are made up
    assert page.graphs["strain"].source.data["y1"].shape == (3,)
    assert page.panels[0].colour.data["index"][0].any()
    lateral = page.panels[0].positions["tracked"].data["x"].reshape(3, -1)
    np.testing.assert_allclose(np.nanmax(lateral[-1] - lateral[0]), 1e3 * 2 * 12e-3 / SIZES[0], rtol=1e-3)
    choose(page, view="long")
    assert "no tracking/outside of heart long" in page.message.text and "not evaluated on this clip" in page.facts.text
    assert not page.panels[0].colour.data["index"][0].any() and not page.panels[0].positions["tracked"].data["x"].size


def test_folder_without_a_repository_is_refused_and_one_that_was_renamed_is_shown(shown, tmp_path):
    with pytest.raises(FileNotFoundError, match="is not a repository"):
        opened(tmp_path)
    shutil.copytree(shown.folder, tmp_path / "renamed")
    assert opened(tmp_path / "renamed").present == ["heart"]
    (tmp_path / "renamed/cases.csv").unlink()
    with pytest.raises(FileNotFoundError, match=r"cases\.csv: is not there: run the configuration again"):
        opened(tmp_path / "renamed")


def test_address_that_is_no_text_shows_the_page_as_at_first(repository):
    """%ff is not UTF-8, and no name of a case."""
    assert asked(repository, texts({"case": [b"\xff"]}))[0] == first(repository)
    assert texts({"view": [b"mid"], "size": []}) == {"view": ["mid"], "size": []}


def test_port_in_use_is_said_in_a_sentence(shown):
    server = serve(shown.folder)
    try:
        with pytest.raises(ShowError, match=f"port {server.port}"):
            serve(shown.folder, server.port)
    finally:
        server.stop()
