"""Notes on data as data: of which kind, whether a doubt, and whether their text names the input."""

from typing import Any, Self

from levilab.texts.text import Text


class Note(Text):
    """A note on data.  It is its English text.

    Attributes:
        kind: notes of one kind are alike, whatever their values.
        is_doubt: whether the numbers are worthless where it is right, as of a wrong unit or of loose washers.
        names_input: whether its text names the input that it is about.
    """

    __slots__ = ("is_doubt", "kind", "names_input")
    kind: str
    is_doubt: bool
    names_input: bool

    def __new__(cls, kind: str, text: str, *, is_doubt: bool = False, names_input: bool = False) -> Self:
        """Make it of a text."""
        self = super().__new__(cls, "{text}", text=text)
        self.kind, self.is_doubt, self.names_input = kind, is_doubt, names_input
        return self

    def __reduce__(self) -> Any:
        """Return how it is made again in another process."""
        return _note, (self.kind, self.values["text"], self.is_doubt, self.names_input)


def _note(kind: str, text: str, is_doubt: bool, names_input: bool) -> Note:  # noqa: FBT001 - of a pickle
    return Note(kind, text, is_doubt=is_doubt, names_input=names_input)


def of_file(kind: str, text: str) -> Note:
    """Return a note whose text names its file."""
    return Note(kind, text, names_input=True)


def kind_of(text: str) -> str:
    """Return the kind of a note; of another text with values its template, and of any other the text itself."""
    if isinstance(text, Note):
        return text.kind
    return text.template if isinstance(text, Text) else text


#: Kinds that say how something was read or counted, or advise, and put no number in doubt.
_ADVICE = frozenset({
    "no u", "overstated", "correlated", "mixed u", "scan overstated", "sweep overstated", "between", "coasts",
    "correction", "falling", "falls", "missed", "rest", "windows", "±",
})  # fmt: skip


def is_advice(text: str) -> bool:
    """Return whether a text is of a kind that puts no number in doubt."""
    return kind_of(text).partition(":")[0] in _ADVICE


def is_doubt(text: str) -> bool:
    """Return whether a text is a doubt."""
    return isinstance(text, Note) and text.is_doubt


def reword(note: str, text: str, *, names_input: bool = False) -> Note:
    """Return a note of the same kind with another text."""
    named = names_input or (isinstance(note, Note) and note.names_input)
    return Note(kind_of(note), text, is_doubt=is_doubt(note), names_input=named)
