"""Who is answered by the server of the viewer, and how many."""

import asyncio
import json
import re
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from echotruth.viewer import access
from echotruth.viewer.server import ShowError, opened, serve

OTHERS = [
    {"Host": "evil.example"},
    {"Host": "evil.example:{port}"},
    {"Host": "127.0.0.1.evil.example:{port}"},
    {"Host": "[::2]:{port}"},
    {"Origin": "http://evil.example"},
    {"Origin": "http://localhost:1"},
    {"Origin": "null"},
]
"""Headers of a page that is not ours."""


@pytest.fixture
def server(monkeypatch):
    """Server of the repository that comes with the package, of which the page is left empty to be quick.

    It answers in a thread of its own: where another module has a browser, an event loop runs in that of the tests.
    """
    monkeypatch.setattr("echotruth.viewer.server.Page", lambda *_: None)
    monkeypatch.setattr(access, "UNUSED", 1_500)
    monkeypatch.setattr(access, "CHECKED", 50)
    monkeypatch.setattr(access, "MAX_PAGES", 5)
    with ThreadPoolExecutor(1) as thread:
        server = thread.submit(serve, "sample").result()
        thread.submit(server.io_loop.start)
        yield server
        server.io_loop.add_callback(server.stop)
        server.io_loop.add_callback(server.unlisten)
        server.io_loop.add_callback(server.io_loop.stop)


def request(server, path, headers, scheme="http"):
    headers = {name: value.format(port=server.port) for name, value in headers.items()}
    return HTTPRequest(f"{scheme}://127.0.0.1:{server.port}{path}", headers=headers)


def run(server, coroutine):
    return asyncio.run_coroutine_threadsafe(coroutine, server.io_loop.asyncio_loop).result(30)


def ask(server, path="/", headers=()):
    """Status and text of the answer."""

    async def answered():
        return await AsyncHTTPClient().fetch(request(server, path, dict(headers)), raise_error=False)

    answer = run(server, answered())
    return answer.code, answer.body.decode()


def connect(server, token, **headers):
    """First message of the websocket of a page; the status where it is refused."""

    async def acknowledged():
        asked = request(server, "/ws", headers, scheme="ws")
        socket = await websocket_connect(asked, subprotocols=["bokeh", token])
        message = await socket.read_message()
        socket.close()
        return message

    try:
        return run(server, acknowledged())
    except HTTPClientError as error:
        return error.code


def token(page):
    """What a page has to show to be connected."""
    return re.search(r'"token":"([^"]+)"', page)[1]


@pytest.mark.parametrize("path", ["/", "/ws", "/static/js/bokeh.min.js", "/favicon.ico", "/autoload.js", "/metadata"])
def test_other_hosts_and_pages_are_refused(server, path):
    for headers in OTHERS:
        status, said = ask(server, path, headers)
        assert (status, said) == (403, "This page answers at the names localhost, 127.0.0.1, [::1] alone.\n")
    assert server.get_sessions() == []


def test_page_and_its_websocket_answer_to_their_own_names(server):
    for name in access.HOSTS:
        own = {"Host": f"{name}:{server.port}", "Origin": f"http://{name}:{server.port}"}
        status, page = ask(server, "/?view=mid", own)
        assert status == 200
        assert json.loads(connect(server, token(page), **own))["msgtype"] == "ACK"
        assert ask(server, "/static/js/bokeh.min.js", own)[0] == 200


def test_websocket_of_another_page_is_refused_though_its_token_is_known(server):
    known = token(ask(server)[1])
    assert [connect(server, known, **headers) for headers in OTHERS] == len(OTHERS) * [403]


def test_websocket_alone_makes_no_page(server):
    known = token(ask(server)[1])
    assert connect(server, known[:-1]) == connect(server, "e30") == 410
    assert len(server.get_sessions()) == 1


def test_only_so_many_pages_are_alive_and_those_without_a_connection_are_forgotten(server):
    answers = [ask(server) for _ in range(access.MAX_PAGES + 3)]
    assert [status for status, _ in answers] == access.MAX_PAGES * [200] + 3 * [503]
    assert answers[-1][1].startswith("5 pages are open, which is the most: close one, and load this again")
    assert len(server.get_sessions()) == access.MAX_PAGES
    end = time.monotonic() + 30
    while server.get_sessions() and time.monotonic() < end:
        time.sleep(0.1)
    assert server.get_sessions() == [] and ask(server)[0] == 200


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/?bokeh-token=x", {}, 400),
        ("/?bokeh-session-id=", {}, 400),
        ("/", {"Bokeh-Session-Id": ""}, 400),
        ("/autoload.js?bokeh-autoload-element=x", {}, 404),
        ("/metadata", {}, 404),
        ("/other", {}, 404),
        ("/ws", {}, 410),
    ],
)
def test_what_the_page_does_not_need_is_refused_in_a_sentence(server, path, headers, status, caplog):
    found, said = ask(server, path, headers)
    assert found == status and re.fullmatch(r"[A-Z].*\.\n", said)
    assert server.get_sessions() == [] and not any(record.exc_info for record in caplog.records)


def test_repository_that_was_removed_meanwhile_is_said_so_on_the_page(server, monkeypatch, caplog):
    def removed(repository):
        raise ShowError(f"{repository}: has <no> cases")

    monkeypatch.setattr("echotruth.viewer.server.opened", removed)
    assert ask(server)[0] == 200
    [session] = server.get_sessions()
    assert session.document.roots[0].text == "sample cannot be shown: has &lt;no&gt; cases"
    assert not any(record.exc_info for record in caplog.records)


@pytest.mark.parametrize(("table", "said"), [("case,heart\n", "has no cases"), ("heart\nx\n", "cases.csv is damaged")])
def test_repository_that_is_damaged_is_said_so_in_a_sentence(tmp_path, table, said):
    for name, text in (("config.yaml", "name: small"), ("cases.csv", table)):
        (tmp_path / name).write_text(text)
    with pytest.raises((ShowError, FileNotFoundError), match=f"^{tmp_path}: {said}: run"):
        opened(tmp_path)
