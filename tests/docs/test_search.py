"""What people type into the search of the site, and the page that comes first; `make site` runs it on the new site."""

import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from support.paths import ROOT

SITE = ROOT / "build/site"
#: What is typed → one of these pages is the first.
QUERIES = {
    "phyphox": ("phone",),
    "smartphone": ("phone",),
    "excel": ("open-my-file",),
    "xlsx": ("open-my-file",),
    "labview": ("open-my-file",),
    "arduino": ("open-my-file",),
    "logger pro": ("open-my-file",),
    "csv": ("open-my-file",),
    "audio": ("open-my-file",),
    "microphone": ("sound-card",),
    "sound card": ("sound-card",),
    "windows": ("install",),
    "install": ("install",),
    "pdf": ("report",),
    "grading": ("class",),
    "worksheet": ("class",),
    "washers": ("experiments/washers",),
    "oscilloscope": ("instruments/oscilloscope",),
    "pymeasure": ("pymeasure",),
    "jupyter": ("notebook",),
    "animation": ("animation",),
    "first experiment": ("tutorial",),
}


class Quiet(SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    def do_GET(self):
        """Send a file; the site has no icon."""
        if self.path == "/favicon.ico":
            self.send_response(204)
            self.end_headers()
        else:
            super().do_GET()

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture(scope="module")
def site():
    """The address of the site: its search loads pages, which a browser does not allow of files."""
    if not (SITE / "searchindex.js").exists():
        pytest.skip("make site makes it")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=SITE)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize("words", QUERIES)
def test_the_search_finds_what_people_type(site, page, words):
    page.goto(f"{site}/search.html?q={words.replace(' ', '+')}")
    page.wait_for_selector("#search-results .search-summary:has-text('found')")
    page.wait_for_selector("#search-results ul.search li a")
    first = page.locator("#search-results ul.search li a").first.get_attribute("href") or ""
    assert first.partition(".html")[0] in QUERIES[words]
