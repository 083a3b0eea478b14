"""What people type into the search of the site, and the page that comes first; `make site` runs it on the new site."""

import re
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from support.browser import watch
from support.paths import DOCS, ROOT

SITE = ROOT / "build/site"
MESSAGES = re.findall(r"^### (.+)$", (DOCS / "messages.md").read_text(encoding="utf-8"), re.MULTILINE)
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
    "lock": ("glossary",),
    "Präzession": ("tutorial-de", "glossary"),
    "simulate_many": ("reference/python-simulator",),
    "spin_at_fall": ("reference/python-analyses",),
    "SpinDown": ("reference/python-spin",),
    "levilab stability": ("reference/commands-simulate",),
}
#: The same, and one of these pages is among the first two.
AMONG_TWO = {
    "precession phone": ("video", "phone"),
    **dict.fromkeys(MESSAGES, ("messages",)),
    "no answer to counter within 2 s": ("messages",),
    "the top did not follow the drive to 40 Hz": ("messages",),
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
def search(browser):
    """The search of the site, served: it loads its index, which a browser does not allow of files."""
    if not (SITE / "searchindex.js").exists():
        pytest.skip("make site makes it")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=SITE)) as server, watch(browser) as page:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page.goto(f"http://127.0.0.1:{server.server_port}/search.html")
        page.evaluate("DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false")  # it loads each page that is found
        yield page
        server.shutdown()


#: Searches again without loading the page; its scorer reads the words from the address.
SEARCH = """words => {
    history.replaceState(null, "", "?" + new URLSearchParams({q: words}));
    Search.output?.parentElement.replaceChildren();
    Search.performSearch(words);
}"""


def found(search, words):
    """The pages that the search finds, each once, in their order."""
    search.evaluate(SEARCH, words)
    search.wait_for_selector("#search-results .search-summary:has-text('found')")
    links = search.locator("#search-results ul.search li a")
    addresses = links.evaluate_all("links => links.map(link => link.getAttribute('href'))")
    return list(dict.fromkeys(address.partition(".html")[0] for address in addresses))


@pytest.mark.parametrize("words", QUERIES)
def test_the_search_finds_what_people_type(search, words):
    assert found(search, words)[0] in QUERIES[words]


@pytest.mark.parametrize("words", AMONG_TWO)
def test_the_search_finds_messages_and_words_together(search, words):
    assert set(found(search, words)[:2]) & set(AMONG_TWO[words])
