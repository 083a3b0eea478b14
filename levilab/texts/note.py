"""Notes on data as data: of which kind and weight, and whether their text names the input."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, Self

from levilab.texts.text import Text

#: Of a note: advice says how something was read or counted and puts no number in doubt; where a doubt is right, as of a
#: wrong unit or of loose washers, the numbers are worthless.
Weight = Literal["advice", "warning", "doubt"]


class Note(Text):
    """A note on data.  It is its English text.

    Attributes:
        kind: notes of one kind are alike, whatever their values.
        weight: whether advice, a warning or a doubt.
        names_input: whether its text names the input that it is about.
        paths: of the inputs that it is about, where a program needs them.
        options: of the analysis that follow its advice, by their names.
    """

    __slots__ = ("kind", "names_input", "options", "paths", "weight")
    kind: str
    weight: Weight
    names_input: bool
    paths: tuple[Path, ...]
    options: Mapping[str, Any]

    def __new__(
        cls,
        kind: str,
        text: str,
        *,
        weight: Weight = "warning",
        names_input: bool = False,
        paths: tuple[Path, ...] = (),
        options: Mapping[str, Any] = MappingProxyType({}),
    ) -> Self:
        """Make it of a text."""
        self = super().__new__(cls, "{text}", text=text)
        self.kind, self.weight, self.names_input = kind, weight, names_input
        self.paths, self.options = paths, options
        return self

    def __reduce__(self) -> Any:
        """Return how it is made again in another process."""
        names = ("weight", "names_input", "paths")
        own = {name: getattr(self, name) for name in names} | {"options": dict(self.options)}
        return partial(Note, **own), (self.kind, self.values["text"])


def of_file(kind: str, text: str, weight: Weight = "warning", paths: tuple[Path, ...] = ()) -> Note:
    """Return a note whose text names its file."""
    return Note(kind, text, weight=weight, names_input=True, paths=paths)


def kind_of(text: str) -> str:
    """Return the kind of a note; of another text with values its template, and of any other the text itself."""
    if isinstance(text, Note):
        return text.kind
    return text.template if isinstance(text, Text) else text


def weight_of(text: str) -> Weight:
    """Return the weight of a note; any other text is a warning."""
    return text.weight if isinstance(text, Note) else "warning"


def is_doubt(text: str) -> bool:
    """Return whether a text is a doubt."""
    return weight_of(text) == "doubt"


def reword(note: str, text: str, *, names_input: bool = False) -> Note:
    """Return a note of the same kind with another text."""
    named = names_input or (isinstance(note, Note) and note.names_input)
    return Note(kind_of(note), text, weight=weight_of(note), names_input=named)
