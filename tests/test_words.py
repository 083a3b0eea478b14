"""The words of the house: code and pages name the thing that acts."""

import re

from support.paths import ROOT

#: Words that hide what acts, in lower case: in sentences and names, also over the end of a line or a comment's sign.
MANNERED = re.compile(
    r"(?<![a-z])(?:somebody|nobody|everybody|whoever|so[\s#:_]+long[\s#:_]+as|of[\s#:_]+old|all[\s#:_]+the[\s#:_]+same)"
    r"(?![a-z])|\b(?:is|was)[\s#:]+told\b|\bwhat[\s#:]+there[\s#:]+is\b"
    r"|(?<![a-z])(?:so[\s#:_]+manieth|what[\s#:_]+came[\s#:_]+of|in[\s#:_]+vain|unasked)(?![a-z])"
    r"|\b(?:anew|so[\s#:_]+many|told[\s#:_]+apart|of[\s#:_]+that[\s#:_]+of)\b|(?<=#: )so (?:much|often|long)\b"
)

#: Where code and pages stand, beside the root itself.
FOLDERS = (
    "levilab", "instruments", "analysis", "pyvisa_levilab", "tests", "benchmarks", "fuzz", "sample_data", "docs",
)  # fmt: skip
ENDINGS = {".py", ".md", ".toml", ".j2"}


def mannered(text):
    """The mannered words of a text, in their order.

    >>> mannered("It waits so long\\n    #: as nobody_listens. # What was\\n# told?  A disbeliever is toldyou.")
    ['so long as', 'nobody', 'was told']
    >>> mannered("#: So many are kept. Every so manieth, in vain; what_came_of_it")
    ['so many', 'so manieth', 'in vain', 'what came of']
    """
    return [" ".join(re.split(r"[\s#:_]+", found)) for found in MANNERED.findall(text.lower())]


def files():
    """All files with code or sentences but this one."""
    found = [*ROOT.iterdir(), *(file for folder in FOLDERS for file in (ROOT / folder).rglob("*"))]
    return [file for file in found if file.suffix in ENDINGS and file.is_file() and file.name != "test_words.py"]


def test_no_file_has_a_word_that_hides_what_acts():
    texts = {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in files()}
    assert {name: words for name, text in texts.items() if (words := mannered(text))} == {}
