"""Where a command writes: results on standard output, progress and messages on standard error."""

from __future__ import annotations

from typing import Any

import typer


def print_json(document: Any, *, indent: int | None = 2, sort_keys: bool = False) -> None:
    """One JSON document on standard output; NaN has no place in it."""
    import json

    typer.echo(json.dumps(document, indent=indent, sort_keys=sort_keys, allow_nan=False))


def message(text: str) -> None:
    """A line on standard error."""
    typer.echo(text, err=True)
