"""What every benchmark does with what it found: prints it, or writes it with its figure."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from levilab.files import replace_atomically, writing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path


def tell(what: str) -> None:
    """Say on standard error what is being measured."""
    print(f"measuring {what}", file=sys.stderr)  # noqa: T201


def give(
    name: str,
    document: Mapping[str, Any],
    print_tables: Callable[[], None],
    figures: Mapping[str, Callable[[Path], None]],
    *,
    out: Path | None,
    as_json: bool,
) -> None:
    """Print the tables, or the document as JSON; write name.json and the figures into a folder, if one is given.

    Args:
        name: of the document's file.
        document: for JSON.
        print_tables: for people.
        figures: for each file of a figure what draws and writes it; it imports matplotlib, which takes long.
        out: the folder.
        as_json: whether the document is printed.

    Raises:
        CannotWrite: of the folder.
    """
    text = json.dumps(document, indent=2, allow_nan=False)
    if as_json:
        print(text)  # noqa: T201
    else:
        print_tables()
    if out is not None:
        with writing(f"{out}: the result cannot be written"):
            out.mkdir(parents=True, exist_ok=True)
            replace_atomically(out / f"{name}.json", text + "\n")
            for file, save in figures.items():
                save(out / file)
        print(f"wrote {' and '.join(str(out / file) for file in (f'{name}.json', *figures))}", file=sys.stderr)  # noqa: T201
