"""A report's page as the tests read it: its tags, and its text as people see it."""

from html.parser import HTMLParser

#: Elements after which a text goes on as another one.
_APART = {"td", "th", "br", "span", "dd", "dt", "p", "li", "h1", "h2", "h3", "h4", "summary", "code", "figcaption"}
_RAISED = str.maketrans("+−0123456789", "⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Page(HTMLParser):
    """Tags with their attributes, and the text without styles and scripts, powers of ten as ×10⁻³."""

    def __init__(self, html):
        super().__init__()
        self.tags = []
        self.headings = []
        self.raw = ""
        self._open = []
        self.feed(html)
        self.text = " ".join(self.raw.split())

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.raw += " " if tag in _APART else ""
        self._open.append(tag)
        if tag[0] == "h" and tag[1:].isdigit():
            self.headings.append((int(tag[1:]), ""))

    def handle_endtag(self, tag):
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data):
        if {"style", "script"} & set(self._open[-1:]):
            return
        if self._open[-1:] in (["sup"], ["sub"]):
            data = data.translate(_RAISED if self._open[-1] == "sup" else _LOWERED)
        self.raw += data
        if self.headings and any(tag[0] == "h" and tag[1:].isdigit() for tag in self._open):
            level, text = self.headings[-1]
            self.headings[-1] = (level, text + data)

    def of_level(self, level):
        """The headings of a level, in their order."""
        return [text for own, text in self.headings if own == level]

    def names(self):
        """The names of all tags."""
        return {tag for tag, _ in self.tags}
