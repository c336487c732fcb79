"""The page of the repository `shown`."""

import pytest
from served_page import served_page

from echotruth.repository.reader import Repository


@pytest.fixture
def repository(shown) -> Repository:
    return Repository(shown.folder)


@pytest.fixture(scope="module")
def address(shown):
    """Address of the page, as `echotruth show` prints it."""
    with served_page("show", str(shown.folder)) as address:
        yield address


@pytest.fixture(scope="module")
def opened(browser, address):
    """A function that opens the page with a query; a script that fails in it, fails the tests."""
    errors = []

    def open_page(query="", width=1500):
        page = browser.new_page(viewport={"width": width, "height": 900})
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address + query)
        page.wait_for_function("window.echotruth && echotruth.drawn > 0", timeout=120_000)
        return page

    yield open_page
    assert errors == []


@pytest.fixture(scope="module")
def one_page(opened):
    page = opened("?tracker=one&colour=none&frame=0")
    page.evaluate(AS_AT_FIRST)
    page.wait_for_function("location.search.includes('case=')", timeout=60_000)  # what is shown, no more what was asked
    return page


AS_AT_FIRST = """() => {
    const model = name => Bokeh.documents[0].get_model_by_name(name);
    const first = {view: "mid", size: "128", other: "", colour: "none"};
    for (const [name, value] of Object.entries(first)) model(name).value = value;
    model("paths").active = [];
    model("frame").value = 0;
    for (const value of [1, 0]) model("frame").value_throttled = value;  // also where playing has left it
}"""


@pytest.fixture
def page(one_page):
    """A page that is opened once; what a test chose is taken back after it."""
    address = one_page.evaluate("location.search")
    yield one_page
    one_page.evaluate(AS_AT_FIRST)
    as_before = "address => location.search === address && echotruth.frame === 0"
    one_page.wait_for_function(as_before, arg=address, timeout=60_000)
