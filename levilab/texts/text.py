"""A text in the language of a person.

English stands in the program where it is used, and is the key: `in_language` looks it up in the table of a language,
and returns it as it is where it is not there.  A sentence with values is a `Text`.
"""

import contextlib
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

FOLDER = Path(__file__).parent
ENGLISH = "en"
#: A value in a template: its name, and how it is written, as in an f-string; ``n``: text of numbers, ``s``: a name.
_FIELD = re.compile(r"\{(\w+)(?::([+,]?[0-9]{0,2}(?:\.[0-9]{1,2})?[a-z%]?))?\}")
_POINT = re.compile(r"(?<![\d.])(\d+)\.(?=\d+(?![\d.]*\.\d))")
#: A head of a column: the quantity, and its unit.
_HEAD = re.compile(r"(.+?)(\s+\[[^\]]+\])")


@dataclass(frozen=True)
class Language:
    """A language.

    Attributes:
        name: in the language itself.
        decimal: its decimal sign.
        page: English text → text of the live view's pages, which they look up themselves.
        texts: English text → text, of all.
    """

    name: str
    decimal: str
    page: Mapping[str, str]
    texts: Mapping[str, str]


def languages() -> tuple[str, ...]:
    """Return the codes of the languages that there are, such as "de"."""
    return tuple(sorted(path.stem for path in FOLDER.iterdir() if path.suffix == ".toml"))  # glob hides an OSError


@cache
def language_of(code: str) -> Language:
    """Return a language."""
    table = tomllib.loads((FOLDER / f"{code}.toml").read_text(encoding="utf-8"))
    parts = [part for part in table.values() if isinstance(part, dict)]
    texts = {english: text for part in parts for english, text in part.items()}
    return Language(table["name"], table["decimal"], table.get("page", {}), texts)


class Text(str):
    """A sentence with values.  It is the English sentence, and `in_language` says it in others.

    >>> said = Text("the top follows the drive at {drive:.2f} Hz", 30)
    >>> said, in_language(said, "de")
    ('the top follows the drive at 30.00 Hz', 'der Kreisel folgt dem Antrieb bei 30,00 Hz')

    Attributes:
        template: with the names of the values in braces.
        values: numbers, texts, or tuples of them.
    """

    __slots__ = ("template", "values")
    template: str
    values: Mapping[str, Any]

    def __new__(cls, template: str, /, *in_order: Any, **values: Any) -> Self:
        """Make the English sentence; the value of an error is its text.

        Args:
            template: of the sentence.
            in_order: its values in the order in which their names first stand in it, but for those given by name.
            values: its values by their names.
        """
        if in_order:
            names = [name for name in dict(fields_of(template)) if name not in values]
            values |= zip(names, in_order, strict=True)
        values = {name: _known(one) for name, one in values.items()}
        self = super().__new__(cls, _fill(template, values, ENGLISH))
        self.template, self.values = template, MappingProxyType(values)
        return self

    def __str__(self) -> str:
        """Return it as it is: what takes a text by ``str``, as matplotlib does, can still say it in a language."""
        return self

    def __reduce__(self) -> Any:
        """Return how it is made again in another process."""
        return text_from, (self.as_table(),)

    def as_table(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"template": self.template, "values": {name: _plain(one) for name, one in self.values.items()}}


class Sentences(Text):
    """Sentences as one text; each that is a Text is said in a language by itself, and an empty one is left out."""

    __slots__ = ()

    def __new__(cls, *texts: str, between: str = " ") -> Self:
        """Put them one after the other."""
        kept = {f"s{k}": text for k, text in enumerate(texts) if text}
        return super().__new__(cls, between.join(f"{{{name}}}" for name in kept), **kept)

    @property
    def each(self) -> tuple[str, ...]:
        """One by one."""
        return tuple(self.values.values())


def verbatim(text: str) -> str:
    """Return a text of a person, such as a name or a title, which stands in each language as it was typed.

    >>> in_language("result", "de"), in_language(verbatim("result"), "de")
    ('Ergebnis', 'result')
    """
    return Text("{text:s}", text)


def how_many(n: int, noun: str) -> str:
    """Return a number of things, which other languages can say.

    >>> how_many(1, "run"), how_many(4, "run")
    ('1 run', '4 runs')
    """
    plural = f"{noun}es" if noun.endswith(("ch", "s")) else f"{noun}s"
    return Text("{n} {things}", n=n, things=noun if n == 1 else plural)


def either(names: Iterable[str]) -> str:
    """Return things of which one is expected, or meant.

    >>> either(["a", "b", "c"]), either([".html"])
    ('a, b or c', '.html')
    """
    *first, last = names
    return Text("{first} or {last}", first=(*first,), last=last) if first else last


def fields_of(template: str) -> list[tuple[str, str]]:
    """Return the names of the values in a template, and how each is written."""
    return _FIELD.findall(template)


def text_from(table: Any, otherwise: str = "") -> str:
    """Return the text of a table that `Text.as_table` made; another text where it is none."""
    try:
        return Text(table["template"], **{name: _from_plain(one) for name, one in table["values"].items()})
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        return otherwise


def text_of(error: BaseException) -> str:
    """Return the message of an error, a Text where it is one."""
    # an AnalysisError, which is not imported: `python -m levilab` may stand beside an analysis.py of a person
    if sentence := getattr(error, "sentence", ""):
        return Text(sentence, **getattr(error, "values", {}))
    said = error.args[0] if error.args else ""
    return said if isinstance(said, Text) else str(error)


def in_language(text: str, code: str | None = None) -> str:
    """Return a text in a language.

    Args:
        text: in English.
        code: of the language; None: that of this process.
    """
    code = code or _of_process
    if code == ENGLISH:  # no file is needed, which may not be opened where everything fails
        return str.__str__(text)
    if isinstance(text, Text):
        return _fill(language_of(code).texts.get(text.template, text.template), text.values, code)
    texts = language_of(code).texts
    if said := texts.get(text):
        return said
    if (head := _HEAD.fullmatch(text)) and head[1] in texts:
        return f"{texts[head[1]]}{head[2]}"
    return text


def numbers_in_language(text: str, code: str | None = None) -> str:
    """Return a text of numbers in a language, with its decimal sign; versions, as 3.11.7, stay."""
    code = code or _of_process
    decimal = "." if code == ENGLISH else language_of(code).decimal
    return _POINT.sub(rf"\g<1>{decimal}", in_language(text, code))


_of_process = ENGLISH


def speak(code: str) -> None:
    """Let this process speak a language."""
    global _of_process  # noqa: PLW0603 - a process speaks to one person
    _of_process = code


@contextlib.contextmanager
def speaking(code: str) -> Iterator[None]:
    """Let this process speak a language meanwhile."""
    before = spoken()
    speak(code)
    try:
        yield
    finally:
        speak(before)


def spoken() -> str:
    """Return the code of the language of this process."""
    return _of_process


def _fill(template: str, values: Mapping[str, Any], code: str) -> str:
    return _FIELD.sub(lambda field: _write(values[field[1]], field[2] or "", code), template)


def _write(value: Any, how: str, code: str) -> str:
    decimal = "." if code == ENGLISH else language_of(code).decimal
    if isinstance(value, tuple):
        texts = [_write(one, how, code) for one in value]
        return ("; " if decimal == "," and any("," in one for one in texts) else ", ").join(texts)
    if how == "s":
        return str(value)
    if isinstance(value, str):
        return numbers_in_language(value, code) if how == "n" else in_language(value, code)
    return format(value, how).translate({ord("."): decimal, ord(decimal): "."})


def _known(value: Any) -> Any:
    """Return a value that a `Text` can have: of an error its text, of a path its name, of a number the plain one."""
    if isinstance(value, BaseException):
        return text_of(value)
    if hasattr(value, "item"):  # a number of NumPy's, which JSON does not take
        return value.item()
    return str(value) if isinstance(value, Path) else value


def _plain(value: Any) -> Any:
    """Return a value as JSON has it."""
    if isinstance(value, Text):
        return value.as_table()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return [_plain(one) for one in value] if isinstance(value, tuple) else value


def as_tables(texts: Iterable[str]) -> list[Any]:
    """Return texts as plain values, which `text_from` reads."""
    return [_plain(text) for text in texts]


def _from_plain(value: Any) -> Any:
    if isinstance(value, dict):
        return Text(value["template"], **{name: _from_plain(one) for name, one in value["values"].items()})
    return tuple(_from_plain(one) for one in value) if isinstance(value, list) else value
