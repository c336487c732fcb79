"""The server of the page on which a wall is drawn, without a browser."""

import io
import json
import re
import threading
from http.client import HTTPConnection
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import echotruth as et
from echotruth.echo.drawing import MAX_BODY, Drawing, DrawingServer
from echotruth.echo.wall import write_wall

SHAPE, CENTRE, RADII = (90, 120), np.array([60.0, 45.0]), (20.0, 32.0)
INSERTIONS = {"anterior_insertion": [33.0, 28.0], "inferior_insertion": [33.0, 62.0]}


def circle(radius, points=200):
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    return CENTRE + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def ring(view="mid", **others):
    borders = {name: circle(radius).tolist() for name, radius in zip(("endocardium", "epicardium"), RADII, strict=True)}
    return {"view": view, **borders, **others}


@pytest.fixture(scope="module")
def clip():
    pixels = np.random.default_rng(0).integers(0, 256, (4, *SHAPE), dtype=np.uint8)
    return et.read_clip(pixels, spacing_mm=0.3, frame_time_ms=20)


@pytest.fixture
def serve(clip, tmp_path):
    """A function that serves a drawing, which is saved as `mine.wall.csv`."""
    servers = []

    def start(begin=None):
        server = DrawingServer(Drawing(clip, tmp_path / "mine.wall.csv", begin))
        threading.Thread(target=server.serve_forever, args=[0.01]).start()
        servers.append(server)
        return server

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.fixture
def server(serve):
    return serve()


def ask(server, method, path, body=None, headers=None):
    """Status and content of an answer."""
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.request(method, path, body, headers or {})
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, json.loads(content) if "json" in answer.getheader("Content-Type") else content


def save(server, drawn, **headers):
    return ask(server, "POST", "/save", drawn if isinstance(drawn, str) else json.dumps(drawn), headers)


def test_page_is_told_the_size_and_times_of_the_clip_and_shows_its_frames(server, clip):
    status, said = ask(server, "GET", "/clip.json")
    assert (status, said["width"], said["height"], said["frames"]) == (200, SHAPE[1], SHAPE[0], 4)
    assert said["spacing_mm"] == pytest.approx(0.3) and said["time_ms"] == [0, 20, 40, 60] and said["wall"] is None
    assert not said["replaces"]
    for number in range(4):
        status, content = ask(server, "GET", f"/frame/{number}.png")
        assert status == 200
        np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(content))), clip["image"][number])


def test_page_asks_for_nothing_that_is_not_there(server):
    page = ask(server, "GET", "/")[1].decode()
    scripts = re.findall(r'src="([\w.]+)"', page)
    imported = [
        name
        for script in scripts
        for name in re.findall(r'"\./([\w.]+)"', ask(server, "GET", f"/{script}")[1].decode())
    ]
    assert scripts == ["drawing.js"] and imported == ["curve.js"]
    assert ask(server, "GET", "/curve.js")[0] == 200
    assert "http" not in page


@pytest.mark.parametrize(
    "path", ["/frame/4.png", "/frame/-1.png", "/frame/0.png/..", "/drawing.py", "/../wall.py", "/x"]
)
def test_nothing_else_is_served(server, path):
    assert ask(server, "GET", path) == (404, {"error": f"{path}: is not there"})


def test_what_is_saved_is_the_wall_that_is_read(server, tmp_path):
    status, said = save(server, ring(**INSERTIONS))
    assert (status, said["saved"]) == (200, str(tmp_path / "mine.wall.csv"))
    assert said["thickness_mm"] == pytest.approx(0.3 * 12, rel=1e-3)
    head = ["# view: mid", "# part: cycle 0 4, crop 0 0 120 90", "part,lateral_px,axial_px,clicked"]
    assert Path(said["saved"]).read_text().splitlines()[:4] == [*head, "endocardium,80.00,45.00,0"]
    wall = et.read_wall(said["saved"])
    assert wall.view == "mid"
    np.testing.assert_allclose(wall.endocardium, circle(RADII[0]), atol=0.005)
    np.testing.assert_allclose(wall.epicardium, circle(RADII[1]), atol=0.005)
    np.testing.assert_array_equal(wall.insertions, list(INSERTIONS.values()))
    assert [path.name for path in tmp_path.iterdir()] == ["mine.wall.csv"]


def test_saved_wall_is_there_when_the_page_is_opened_again(server):
    save(server, ring("apical", **INSERTIONS))
    said = ask(server, "GET", "/clip.json")[1]
    assert said["replaces"] and said["wall"]["view"] == "apical"
    assert said["wall"]["anterior_insertion"] == [INSERTIONS["anterior_insertion"]]
    np.testing.assert_allclose(said["wall"]["endocardium"], circle(RADII[0]), atol=0.005)


def test_cycle_that_is_chosen_is_saved_and_there_when_the_page_is_opened_again(server, tmp_path):
    assert ask(server, "GET", "/clip.json")[1]["cycle"] == [0, 4]
    assert save(server, ring(cycle=[1, 4]))[0] == 200
    assert et.read_wall(tmp_path / "mine.wall.csv").part == "cycle 1 4, crop 0 0 120 90"
    assert ask(server, "GET", "/clip.json")[1]["cycle"] == [1, 4]
    status, said = save(server, ring(cycle=[2, 4]))
    assert (status, said["error"]) == (400, "cycle: frames 2 to 4 are none of 3 or more frames of the clip")


def test_wall_of_a_cycle_that_is_not_in_the_clip_is_refused_and_left_as_it_is(clip, tmp_path):
    wall = et.Wall(circle(RADII[0]), circle(RADII[1]), "mid", None, "cycle 2 6, crop 0 0 120 90")
    write_wall(tmp_path / "a.csv", wall)
    sentence = r"a.csv: was drawn in frames 2 to 6, and the clip shows 0 to 4: give a cycle that holds them"
    with pytest.raises(et.EchoError, match=sentence):
        Drawing(clip, tmp_path / "a.csv")
    assert et.read_wall(tmp_path / "a.csv").part == wall.part


def test_points_that_were_clicked_are_there_when_the_page_is_opened_again(server):
    save(server, ring(endocardium_clicked=[0, 50, 100, 150], epicardium_clicked=[0, -1, 10**9]))
    said = ask(server, "GET", "/clip.json")[1]
    assert said["clicked"] == ["endocardium"]  # three or more
    np.testing.assert_allclose(said["wall"]["endocardium"], circle(RADII[0])[::50], atol=0.005)
    assert len(said["wall"]["epicardium"]) == 200


def test_long_axis_is_saved_without_insertions(server):
    half = {
        name: circle(radius)[:100].tolist() for name, radius in zip(("endocardium", "epicardium"), RADII, strict=True)
    }
    status, said = save(server, {"view": "four_chamber", **half, "anterior_insertion": None})
    assert status == 200
    wall = et.read_wall(said["saved"])
    assert (wall.plane, wall.insertions) == ("long_axis", None)
    assert wall.mask(SHAPE).sum() == pytest.approx(np.pi * (RADII[1] ** 2 - RADII[0] ** 2) / 2, rel=0.03)


def test_mask_is_corrected_and_saved_as_a_table(serve, tmp_path):
    distance = np.hypot(*np.meshgrid(np.arange(SHAPE[1]) - CENTRE[0], np.arange(SHAPE[0]) - CENTRE[1]))
    mask = tmp_path / "segmented.npy"
    np.save(mask, (distance > RADII[0]) & (distance < RADII[1]))
    server = serve(mask)
    wall = ask(server, "GET", "/clip.json")[1]["wall"]
    assert wall["view"] == "short_axis"
    radius = np.linalg.norm(np.array(wall["epicardium"]) - CENTRE, axis=1)
    assert np.abs(radius - RADII[1]).max() < 1
    assert save(server, wall | dict.fromkeys(INSERTIONS))[0] == 200
    assert et.read_wall(tmp_path / "mine.wall.csv").view == "short_axis"


@pytest.mark.parametrize(
    ("drawn", "sentence"),
    [
        (
            ring() | {"endocardium": ring()["epicardium"], "epicardium": ring()["endocardium"]},
            "the endocardium is not inside the epicardium",
        ),
        (ring() | {"epicardium": []}, "epicardium: give three points or more"),
        (ring("middle"), "view = 'middle': use one of basal, mid,"),
        (ring(anterior_insertion=[33.0, 28.0]), "inferior_insertion: is missing: click both insertions, or none"),
        (
            ring() | {"epicardium": [[0, 0], [1e300, 0], [0, 1]]},
            "epicardium.1.0: Input should be less than or equal to 100000",
        ),
        (ring() | {"epicardium": [["0", 1], [2, 3], [4, 5]]}, "epicardium.0.0: Input should be a valid number"),
        (ring() | {"path": "/etc/passwd"}, "path: Extra inputs are not permitted"),
        ({"view": "mid"}, "endocardium: Field required"),
        (json.dumps(ring()).replace("80.0,", "NaN,"), "endocardium.0.0: Input should be a finite number"),
        ("{", "what is sent: Invalid JSON"),
    ],
)
def test_what_is_no_wall_is_refused_in_one_sentence_and_not_written(server, tmp_path, drawn, sentence):
    status, said = save(server, drawn)
    assert status == 400 and said["error"].startswith(sentence) and "\n" not in said["error"], said
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_told(serve, clip, tmp_path, monkeypatch):
    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("echotruth.files.write", full)
    status, said = save(serve(), ring())
    assert (status, said["error"]) == (
        400,
        f"{tmp_path / 'mine.wall.csv'}: No space left on device: see that you may write there",
    )


@pytest.mark.parametrize(
    "method, path", [("GET", "/"), ("GET", "/clip.json"), ("GET", "/frame/0.png"), ("POST", "/save")]
)
@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1.evil.example"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
    ],
)
def test_other_hosts_and_pages_are_refused(server, tmp_path, method, path, headers):
    status, said = ask(server, method, path, json.dumps(ring()) if method == "POST" else None, headers)
    assert (status, said["error"]) == (403, f"this page answers at {server.address} alone")
    assert list(tmp_path.iterdir()) == []


def test_page_answers_to_its_own_names(server):
    for name in ("127.0.0.1", "localhost"):
        host = f"{name}:{server.server_port}"
        assert save(server, ring(), Host=host, Origin=f"http://{host}")[0] == 200
    assert server.server_address[0] == "127.0.0.1"


@pytest.mark.parametrize(("length", "status"), [(str(MAX_BODY + 1), 413), ("9" * 5000, 413), ("-1", 411), ("x", 411)])
def test_large_bodies_are_refused_unread(server, length, status):
    assert ask(server, "POST", "/save", None, {"Content-Length": length})[0] == status


def test_port_in_use_is_told(server, clip, tmp_path):
    with pytest.raises(et.EchoError, match=rf"port {server.server_port}: .*: give another with --port"):
        DrawingServer(Drawing(clip, tmp_path / "a.csv"), server.server_port)


def test_wall_without_a_named_view_needs_one(tmp_path):
    wall = et.Wall(circle(RADII[0]), circle(RADII[1]), "basal")
    write_wall(tmp_path / "a.csv", wall)
    assert et.read_wall(tmp_path / "a.csv").view == "basal"
    assert et.read_wall(tmp_path / "a.csv", "mid").view == "mid"
    text = (tmp_path / "a.csv").read_text()
    (tmp_path / "b.csv").write_text(text.partition("\n")[2])
    with pytest.raises(et.EchoError, match=r"b.csv: does not name its view: give view, or let a .csv begin with"):
        et.read_wall(tmp_path / "b.csv")
    (tmp_path / "c.csv").write_text(text.replace("basal", "bsal"))
    with pytest.raises(et.EchoError, match=r"c.csv: view = 'bsal': use one of basal"):
        et.read_wall(tmp_path / "c.csv")
