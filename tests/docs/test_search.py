"""What people type into the search of the site, and the page that comes first; `make site` runs it on the new site."""

import threading
import tomllib
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from support.browser import watch
from support.messages import QUOTED
from support.paths import ROOT

SITE = ROOT / "build/site"
ROWS = tomllib.loads((ROOT / "docs/building/words.toml").read_text("utf-8"))
#: Page → what is typed, and it is the first.
FIRST = {
    "phone": ("phyphox", "smartphone", "wifi", "Handy", "battery"),
    "open-my-file": ("excel", "xlsx", "labview", "arduino", "logger pro", "csv", "audio", "comma", "rpm", "Drehzahl"),
    "sound-card": ("microphone", "sound card", "speaker", "Mikrofon", "Soundkarte"),
    "install": ("windows", "install", "download", "mac"),
    "class": ("grading", "worksheet", "seed", "teacher", "student", "Lehrer"),
    "glossary": ("lock", "C3/2", "C₃/₂", "c32", "uncertainty", "AICc", "undecided", "gate", "error bars", "Messfehler"),
    "live": ("share", "QR code", "language"), "tutorial-de": ("Präzession", "Luftwiderstand", "Magnetkreisel"),
    "messages": ("warning", "warnings", "error", "crashed", "Absturz"),
    "experiments/washers": ("washers", "weight", "mass", "Gewicht", "Unterlegscheiben"),
    "experiments/spin": ("tape", "lamp", "spin down", "spindown"), "experiments/trace": ("photodiode", "Lichtschranke"),
    "instruments/oscilloscope": ("oscilloscope", "Oszilloskop"), "instruments/counter": ("counter", "Zähler"),
    "pymeasure": ("pymeasure",), "animation": ("animation",), "report": ("pdf", "budget", "printing"),
    "video": ("video", "camera"), "experiments/triggered": ("hold",), "simulator": ("simulate",),
    "practise": ("virtual bench",), "notebook": ("jupyter",),
    "tutorial": ("first experiment",), "index": ("cite", "license"), "physics": ("von karman",),
    "reference/python-simulator": ("simulate_many",),
    "reference/python-analyses": ("spin_at_fall",),
    "reference/python-spin": ("SpinDown",),
    "reference/python-results": ("Quantity", "conf_interval", "redchi", "covar"),
    "reference/commands-simulate": ("levilab stability",),
}  # fmt: skip
#: The same, and one of these pages is among the first two.
AMONG_TWO = {
    "precession phone": ("video", "phone"),
    "wrong unit": ("open-my-file", "messages"),
    **dict.fromkeys(QUOTED, ("messages",)),
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


@pytest.mark.parametrize(("page", "words"), [(page, words) for page in FIRST for words in FIRST[page]])
def test_the_search_finds_what_people_type(search, page, words):
    assert found(search, words)[0] == page


def test_each_word_of_the_table_finds_its_page_first(search):
    first = "words => (history.replaceState(null, '', '?' + new URLSearchParams({q: words})),"
    first += "Search._performSearch(...Search._parseQuery(words)).at(-1)[0])"
    typed = [(word, page) for page, words in ROWS.items() for word in " ".join(words.split()).split(", ")]
    assert [(word, page) for word, page in typed if search.evaluate(first, word) != page] == []


def test_where_no_page_has_all_words_those_with_some_are_found(search):
    assert found(search, "levitron xylophone manufacturer") == found(search, "levitron") != []


@pytest.mark.parametrize("words", AMONG_TWO)
def test_the_search_finds_messages_and_words_together(search, words):
    assert set(found(search, words)[:2]) & set(AMONG_TWO[words])
