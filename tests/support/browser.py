"""A headless browser for the tests of pages: fixtures ``browser``, ``page`` and ``watched``.

    def test_a_page(page):
        page.goto(path.as_uri())
        assert page.get_by_role("heading", name="Readings").is_visible()

``page`` is 1280 × 800 in light colours; ``watched(viewport=PHONE, color_scheme="dark")`` opens others.  All ask for
reduced motion, which costs less processor time, unless a test says ``reduced_motion="no-preference"``.  Each
fails the test at its end if the page has written an error to the console, raised one, or asked for anything that is not
on this machine.  A module may share a page in a fixture of its own:

    @pytest.fixture(scope="module")
    def report_page(browser):
        with watch(browser) as page:
            ...
            yield page

One browser serves all tests of a worker; it starts when the first of them asks for it.
"""

import asyncio
import os
import shutil
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

#: Names an executable in place of those that are searched for.
VARIABLE = "LEVILAB_TEST_BROWSER"
COMMANDS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge"
)  # fmt: skip
#: Where Windows and macOS install it, which is not on the path.
PLACES = {
    "win32": (
        "{ProgramFiles}/Google/Chrome/Application/chrome.exe",
        "{ProgramFiles(x86)}/Google/Chrome/Application/chrome.exe",
        "{LocalAppData}/Google/Chrome/Application/chrome.exe",
        "{ProgramFiles(x86)}/Microsoft/Edge/Application/msedge.exe",
        "{ProgramFiles}/Microsoft/Edge/Application/msedge.exe",
    ),
    "darwin": (
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        "/Applications/Chromium.app/Contents/MacOS/Chromium",
        "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    ),
}
FLAGS = (
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
    # three dimensions without a graphics card, the same pixels on each machine
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    # and nothing else by way of the card that is not there: texts and boxes are drawn for a third less
    "--disable-gpu-compositing", "--disable-gpu-rasterization",
    # nothing leaves the machine, and what tries to is seen as a request that failed
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
)  # fmt: skip
HERE = {"127.0.0.1", "localhost"}
DESK = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}
#: Long, because a machine at work on other tests is slow; a test that passes waits for none of it [ms].
PATIENCE_MS = 60_000.0


def executable():
    """The browser: as the variable names it, on the path, or where the system installs it."""
    if named := os.environ.get(VARIABLE):
        return named
    known = {name.lower(): value for name, value in os.environ.items()}
    for place in PLACES.get(sys.platform, ()):
        variable, _, rest = place.removeprefix("{").rpartition("}/")
        path = Path(known.get(variable.lower(), "/"), rest) if variable else Path(place)
        if path.is_file():
            return str(path)
    return next(filter(None, map(shutil.which, COMMANDS)), None)


#: Playwright's event loop, while there is one.
_loops = []


def _enter_loop():
    """Mark Playwright's loop as the running one: what is closed late is closed after another's test, or after all."""
    if _loops:
        asyncio._set_running_loop(_loops[0])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """A test that has the browser among its fixtures runs in Playwright's event loop, other tests in their own.

    Between its calls Playwright leaves its loop marked as the running one, in which no other may be started.
    """
    uses_it = "browser" in getattr(item, "fixturenames", ())
    asyncio._set_running_loop(_loops[0] if _loops and uses_it else None)
    try:
        return (yield)
    finally:
        asyncio._set_running_loop(None)


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium, Chrome or Edge; the test is skipped where there is none."""
    from playwright.sync_api import sync_playwright

    path = executable()
    if path is None:
        pytest.skip(f"no browser: install Chromium, Chrome or Edge, or name one in {VARIABLE} (CONTRIBUTING.md)")
    playwright = sync_playwright().start()
    _loops.append(asyncio.get_running_loop())
    try:
        with playwright.chromium.launch(executable_path=path, args=list(FLAGS), timeout=PATIENCE_MS) as chromium:
            yield chromium
            _enter_loop()
    finally:
        _enter_loop()
        playwright.stop()
        _loops.clear()
        asyncio._set_running_loop(None)


def is_outside(url):
    """Whether a request would leave this machine.

    >>> is_outside("http://127.0.0.1:8080/live"), is_outside("https://example.org/font.woff")
    (False, True)
    """
    parts = urlsplit(url)
    return parts.scheme not in {"file", "data", "blob", "about"} and parts.hostname not in HERE


@contextmanager
def watch(browser, **options):
    """A page in a context of its own; raises AssertionError at its end for errors and for requests to elsewhere.

    Args:
        browser: the fixture.
        options: of Playwright's ``new_context``: viewport, color_scheme, reduced_motion, java_script_enabled, ...
    """
    problems = []
    context = browser.new_context(**{"viewport": DESK, "locale": "en-GB", "reduced_motion": "reduce", **options})
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()

    def report(message):
        if message.type in {"error", "assert"}:
            problems.append(f"console: {message.text} ({message.location.get('url')})")

    def look(address):
        if is_outside(address):
            problems.append(f"a request to elsewhere: {address}")

    page.on("console", report)
    page.on("pageerror", lambda error: problems.append(f"page: {error}"))
    page.on("request", lambda request: look(request.url))
    page.on("websocket", lambda socket: look(socket.url))
    try:
        yield page
    finally:
        _enter_loop()
        context.close()
    assert problems == []


@pytest.fixture
def watched(browser):
    """Opens pages as `watch` does, with its options, until the end of the test."""
    with ExitStack() as pages:
        yield lambda **options: pages.enter_context(watch(browser, **options))


@pytest.fixture
def page(browser):
    """A page of 1280 × 800 in light colours."""
    with watch(browser) as page:
        yield page
