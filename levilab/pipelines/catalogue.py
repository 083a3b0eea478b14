"""The analyses: a row each.  A new one gets a folder with the same file names, and a row here."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from levilab.errors import unquote
from levilab.pipelines.field.document import FIELD
from levilab.pipelines.hold.document import HOLD
from levilab.pipelines.limit.document import LIMIT
from levilab.pipelines.precession.document import PRECESSION
from levilab.pipelines.spin.document import SPIN
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.sway.document import SWAY
from levilab.pipelines.video.document import VIDEO
from levilab.present.clock import moment
from levilab.present.document.blocks import MOST_ALIKE
from levilab.present.numbers import short_name
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rich.console import Console

    from levilab.pipelines.analyzed import A
    from levilab.pipelines.document import Analysis

#: Starts of runs that the terminal shows; the report has all.
MOST_STARTS = 6


#: In the order in which they are tried.
ANALYSES: Mapping[str, Analysis[Any]] = MappingProxyType(
    {row.name: row for row in (SPINDOWN, SPIN, FIELD, LIMIT, PRECESSION, SWAY, HOLD, VIDEO)}
)


def print_analysis(
    analysis: Analysis[A],
    found: A,
    in_words: Callable[[str], str] = unquote,
    console: Console | None = None,
    *,
    tables: bool = True,
) -> None:
    """Print doubts, what the data say, the tables, and notes.

    Args:
        analysis: the row of the catalogue.
        found: what it found.
        in_words: a message as the person reads it.
        console: where it is printed, by default the terminal.
        tables: whether tables are printed.
    """
    from rich.markup import escape

    from levilab.present.terminal import draw, terminal  # with rich

    console = console or terminal()

    def say(lead: str, text: str, style: str = "bold") -> None:
        console.print(f"[{style}]{in_language(lead)}[/{style}] {escape(in_words(in_language(text)))}")

    for doubt in found.doubts:
        say("Before you use the numbers.", doubt, "bold yellow")
    say("What the data say.", found.text)
    if tables:
        console.print()
        for table in analysis.tables(found):
            console.print(draw(table))
    starts = [f"{short_name(one.name)} {moment(one.start)}" for one in found.sources if one.start]
    if starts:
        more = [Text("and {n} more", n=len(starts) - MOST_STARTS)] * (len(starts) > MOST_STARTS)
        say("Start, local time.", "; ".join([*starts[:MOST_STARTS], *map(in_language, more)]))
    for first, *others in (group for group in found.grouped_warnings if group[0] not in found.doubts):
        many = len(others) >= MOST_ALIKE  # with the first one it is more
        alike = Text("{note} (and {n} more like this one)", note=first, n=len(others))
        for warning in [alike] if many else [first, *others]:
            say("note:", warning, "yellow")
