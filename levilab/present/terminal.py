"""The terminal: how wide it is, and what tables look like on it."""

from __future__ import annotations

import shutil
import sys
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence


def terminal() -> Console:
    """As wide as the terminal; into a pipe or file as wide as the tables need."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 160
    return Console(width=max(width, 80), highlight=False)


def new_table(title: str | None, *columns: str, numbers: Sequence[str] = ()) -> Table:
    """An empty table; numbers: the columns that are aligned to the right."""
    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        title=title,
        title_justify="left",
        title_style="bold",
    )
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    return table
