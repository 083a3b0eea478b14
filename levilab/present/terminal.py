"""The terminal: how wide it is, which characters it has, and what tables look like on it."""

import io
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.markup import escape
from rich.measure import Measurement, measure_renderables
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from levilab.present.characters import for_encoding, printable
from levilab.present.document.blocks import in_language_of_reader
from levilab.present.tables import Table

#: SIMPLE_HEAD in plain ASCII; rich itself would draw a frame.
_ASCII_HEAD = box.Box("    \n    \n -- \n    \n    \n -- \n    \n    \n", ascii=True)
#: Columns below which no text can be read, and more than any table has.
_NARROWEST, _UNLIMITED = 20, 10_000
#: Columns of a text that is no terminal's: all tables fit into 80, and lines of words are still read with ease.
TEXT_WIDTH = 110


class Terminal(Console):
    """A console on which no text steers the terminal, and each is spelled in the characters of the stream.

    That is done before its width is measured.
    """

    def render_str(self, text: str, **options: Any) -> Text:
        """Replace characters in all texts: those printed, a table's cells, its title and its caption."""
        return super().render_str(self.spell(text), **options)

    def spell(self, text: str) -> str:
        """Return a text in the characters of this terminal."""
        return for_encoding(printable(text), self.encoding)


class _Table(RichTable):
    """A table; where the terminal is too narrow for its words, a list: row after row, a line for each column."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Any]:
        """Yield what rich draws."""
        fits = _share_width(self, console, options)
        yield from super().__rich_console__(console, options) if fits else self._rows(console, options)

    def _rows(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        if self.title:
            yield Padding(self.title, (0, 0, 1, 0), style="bold")
        heads = [column.header for column in self.columns]
        for first, *cells in zip(*(column.cells for column in self.columns), strict=True):
            if first:
                yield Padding(first, 0, style="bold")
            row = RichTable.grid("", "", padding=(0, 1))
            for head, cell in zip(heads[1:], cells, strict=True):
                if cell:
                    row.add_row(head, cell)
            if console.measure(Group(*heads[1:])).maximum > options.max_width // 2:
                _share_width(row, console, options.update(width=options.max_width - 1))
            yield Padding(row, (0, 0, 1, 1))


def _share_width(table: RichTable, console: Console, options: ConsoleOptions) -> bool:
    """Share the width among the columns, none of them narrower than its longest word, which rich itself would cut.

    Columns that want little get all of it, and what is left goes in equal parts to those that want more.

    Returns whether there is width enough.
    """
    unlimited = options.update(width=_UNLIMITED)
    whole = Measurement.get(console, unlimited, table)
    free, wanted = options.max_width - whole.minimum, whole.maximum - whole.minimum
    if 0 <= free < wanted:
        needs = [measure_renderables(console, unlimited, [c.header, *c.cells]) for c in table.columns]
        left = free
        for done, k in enumerate(sorted(range(len(needs)), key=lambda k: needs[k].span)):
            more = min(needs[k].span, left // (len(needs) - done))
            table.columns[k].width = needs[k].minimum + more
            left -= more
    return free >= 0


def terminal() -> Terminal:
    """Return a console as wide as the terminal; into a pipe or file, as wide as the tables need."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 160
    return Terminal(width=max(width, _NARROWEST), highlight=False)


def as_text(show: Callable[[Console], object]) -> str:
    """Return what a function prints, as text of at most `TEXT_WIDTH` columns without colours."""
    written = io.StringIO()
    # in a notebook rich would show it at once instead
    show(Terminal(file=written, width=TEXT_WIDTH, highlight=False, color_system=None, force_jupyter=False))
    return "\n".join(line.rstrip() for line in written.getvalue().strip("\n").splitlines())


def new_table(title: str | None, *columns: str, numbers: Sequence[str] = ()) -> RichTable:
    """Return an empty table.

    Args:
        title: above it.
        *columns: heads of its columns.
        numbers: those that are aligned to the right.
    """
    table = _Table(
        box=box.SIMPLE_HEAD if for_encoding("─", sys.stdout.encoding) == "─" else _ASCII_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        title=title,
        title_justify="left",
        title_style="bold",
    )
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    return table


#: From this number of rows on they are laid out here: rich takes 0.1 ms for each cell.
_MANY_ROWS = 200


def print_rows(console: Terminal, heads: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[str]) -> None:
    """Print a table of texts, which are no markup; thousands of rows take no longer than the rest of a command.

    numbers: the heads of columns that are aligned to the right.
    """
    table = new_table(None, *heads, numbers=numbers)
    texts = [[console.spell(cell) for cell in row] for row in rows]
    widths = [max(map(cell_len, column)) for column in zip(heads, *texts, strict=True)]
    to_be_folded = sum(widths) + 2 * len(widths) > console.width
    if len(rows) < _MANY_ROWS or to_be_folded:
        for row in rows:
            table.add_row(*map(escape, row))
        console.print(table)
        return
    for column, width in zip(table.columns, widths, strict=True):
        column.width = width
    to_right = [head in numbers for head in heads]
    with console.capture() as head:
        console.print(table)
    console.file.write(f"{head.get().rstrip()}\n")
    for row in texts:
        cells = (
            " " * (width - cell_len(cell)) + cell if right else cell + " " * (width - cell_len(cell))
            for cell, width, right in zip(row, widths, to_right, strict=True)
        )
        console.file.write(f" {'  '.join(cells)}\n")
    console.file.write("\n")


def draw(table: Table) -> RichTable:
    """Return a table of data as one of rich's, in the language of this process."""
    table = in_language_of_reader(table)
    drawn = new_table(escape(table.title), *map(escape, table.heads))
    drawn.show_header = any(table.heads)
    for k in table.numbers:
        drawn.columns[k].justify = "right"
    before = ""
    for row in table.rows:
        if row.kind == "together" != before:
            drawn.add_section()
        drawn.add_row(*map(escape, row.cells))
        before = row.kind
    return drawn
