"""The page of a repository: what it says is what is stored, and it needs nothing but itself."""

import json
import re
import shutil
from base64 import b64decode
from collections import Counter
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from known_repository import FRAMES, SETTINGS, make
from reported_repository import report
from shown_repository import SHIFT

from echotruth.report import page, style
from echotruth.report.figures import OF_TRACKERS, Figures
from echotruth.repository import metadata
from echotruth.repository.reader import Repository

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore"),  # of a store whose text Zarr calls unstable
]


class Elements(HTMLParser):
    """Names, references and words of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids, self.references, self.loaded, self.words = [], [], [], []
        self._hidden = False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self._hidden = tag in ("script", "style")
        self.ids += [values["id"]] if "id" in values else []
        for name in ("href", "xlink:href"):
            if (address := values.get(name) or "").startswith("#"):
                self.references.append(address[1:])
        self.references += re.findall(r"url\(#([^)]+)\)", " ".join(str(value) for value in values.values()))
        self.loaded += [values[name] for name in ("src", "srcset", "data", "poster") if name in values]
        if tag in ("link", "image", "use", "iframe", "object"):
            self.loaded += [values[name] for name in ("href", "xlink:href") if name in values]

    def handle_data(self, data):
        if not self._hidden:
            self.words.append(data)

    @property
    def said(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def elements(text):
    return Elements(text)


def clips(text):
    return json.loads(re.search(r'id="clips">(.*?)</script>', text, re.DOTALL)[1])


def integers(code, kind):
    return np.frombuffer(b64decode(code), kind).astype(float)


def test_page_loads_nothing_from_elsewhere(text, elements):
    assert elements.loaded and all(address.startswith(("data:", "#")) for address in elements.loaded)
    styles = "".join(re.findall(r"<style>(.*?)</style>", text, re.DOTALL))
    assert "url(" not in styles and "@import" not in styles and "fetch(" not in text


def test_every_name_is_given_once_and_every_reference_leads_somewhere(elements):
    assert [name for name, count in Counter(elements.ids).items() if count > 1] == []
    assert set(elements.references) - set(elements.ids) == set()


def sections(text):
    return re.findall(r'<section id="(\w+)">', text)


def test_contents_lead_to_every_section(text):
    assert re.findall(r'<li><a href="#(\w+)">', text) == sections(text) and len(sections(text)) == 10


def test_points_of_the_player_lie_where_the_tissue_is_stored_to_be(text, reported, size):
    clip = clips(text)["mid"]
    path = integers(clip["path"], "<i2").reshape(FRAMES, clip["points"], 2) / clip["steps"]
    assert clip["points"] == len(reported.position) and clip["frames"] == FRAMES
    pixel = 12e-3 / size
    scale = clip["width"] / round(clip["width"] * pixel / (clip["bar_px"] and pixel))
    moved = (path[-1] - path[0]) / scale * pixel
    assert moved == pytest.approx(np.broadcast_to(SHIFT[:2], moved.shape), abs=pixel / 8)


def test_points_of_the_best_tracker_are_those_that_it_found(text, size):
    clip = clips(text)["mid"]
    path = integers(clip["path"], "<i2").reshape(FRAMES, clip["points"], 2)[:, clip["chosen"]]
    found = integers(clip["tracked"], "<i2").reshape(FRAMES, len(clip["chosen"]), 2)
    off = (found - path[0]) / clip["steps"] * 12e-3 / size
    assert off == pytest.approx(np.full(off.shape, off.flat[0]), abs=1e-5)
    assert min(abs(off.flat[0] - 1e-4), abs(off.flat[0] - 2e-4)) < 1e-5


def test_course_under_the_clip_is_the_stored_strain(text):
    course = clips(text)["mid"]["course"]
    assert course["true"] == pytest.approx([-14.0] * FRAMES, abs=0.01)
    assert course["tracked"] == pytest.approx([-12.0] * FRAMES, abs=0.01)


def test_table_has_the_numbers_of_the_leaderboard(elements, reported):
    board = pd.read_csv(reported.folder / "figures/leaderboard.csv")
    first = board[(board["view"] == "all") & (board["size_px"] == board["size_px"].max())].iloc[0]
    last = f" (1–{first['rank_high']:.0f})" if first["rank_high"] > 1 else ""
    assert f"1{last} {first['tracker']} {first['nrmse_all_percent']:.1f}" in elements.said
    assert "It takes 6 hearts to tell trackers apart" in elements.said


def test_the_same_repository_gives_the_same_page(reported, text):
    assert page.write(Repository(reported.folder)).read_text(encoding="utf-8") == text


def test_page_holds_its_figures(text, reported):
    figures = re.findall(r'<figure id="figure-(\w+)">.*?<img src="data:image/svg\+xml;base64,(.*?)"', text, re.DOTALL)
    assert [name for name, _ in figures] == [
        *("leaderboard", "error", "views", "heart", "loop"),
        *("strain", "physiology", "curves", "segments", "bullseye"),
    ]
    for name, drawing in figures:
        assert b64decode(drawing) == (reported.folder / f"figures/{name}.svg").read_bytes()


def test_page_of_a_repository_without_a_complete_heart_says_why(reported, tmp_path):
    folder = shutil.copytree(reported.folder, tmp_path / "known")
    metadata.write(
        folder / "known.zarr/hearts/heart", {"status": "failed", "reason": "no <b>equilibrium</b> in frame 3"}
    )
    said = report(folder)
    assert "no &lt;b&gt;equilibrium&lt;/b&gt; in frame 3" in said and "<b>equilibrium" not in said
    assert sections(said) == ["made", "hearts", "failures", "provenance", "use", "cite"]
    assert re.findall(r'<li><a href="#(\w+)">', said) == sections(said)
    assert (folder / "figures/clip.mp4").stat().st_size > 0
    assert list(pd.read_csv(folder / "figures/leaderboard.csv")["tracker"]) == []


@pytest.mark.slow
def test_many_hearts_are_listed_with_their_number_and_one_view_is_enough(reported, tmp_path, monkeypatch):
    """What depends on views and hearts is drawn; most is not written, which takes long, but another's are shown."""
    monkeypatch.setattr("echotruth.report.hearts.SHOWN", 1)
    views = {"long": SETTINGS["views"]["long"]}
    made = make(tmp_path / "known", SETTINGS | {"views": views, "cases": {"seed": [1, 2]}})
    figures = Figures(Repository(made.folder), shutil.copytree(reported.folder / "figures", made.folder / "figures"))
    drawn = {name: getattr(figures, name)() for name in ("views", "population", *OF_TRACKERS)}
    for name in ("population", "views"):
        style.save(drawn[name], figures.folder / name)
    elements = Elements(page.write(figures.repository).read_text(encoding="utf-8"))
    assert "2 hearts: 2 complete." in elements.said and "1 of those that were imaged are listed" in elements.said
    assert elements.said.count("healthy") >= 1 and "figure-population" in elements.ids
