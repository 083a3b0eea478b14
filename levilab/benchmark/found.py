"""What every benchmark does: says on what it ran, prints its document, or writes it with its figure."""

from __future__ import annotations

import json
import platform
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from levilab.files import replace_atomically, writing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from levilab.present.style import Figure


def describe_measurement(*packages: str) -> dict[str, Any]:
    """Return when and on what a benchmark runs, and the versions of these packages, for its document."""
    return {
        "measured_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {"processor": processor(), "system": platform.system(), "python": platform.python_version()},
        "software": {name: version_of(name) for name in packages},
    }


def processor() -> str:
    """Return the processor's name, as far as the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:  # noqa: PTH123 - no file of ours
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def version_of(package: str) -> str | None:
    """Return the version that is installed; None where it is not."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def tell(what: str) -> None:
    """Say on standard error what is being measured."""
    print(f"measuring {what}", file=sys.stderr)  # noqa: T201


def give(
    name: str,
    document: Mapping[str, Any],
    print_tables: Callable[[], None],
    draw: Callable[[], Figure],
    *,
    out: Path | None,
    as_json: bool,
) -> None:
    """Print the tables, or the document as JSON; write name.json and name.png into a folder, if one is given.

    Args:
        name: of the files.
        document: for JSON.
        print_tables: for people.
        draw: the figure; it imports matplotlib, which takes long.
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
    if out is None:
        return
    from levilab.present.style import save_png

    files = out / f"{name}.json", out / f"{name}.png"
    with writing(f"{out}: the result cannot be written"):
        out.mkdir(parents=True, exist_ok=True)
        replace_atomically(files[0], text + "\n")
        save_png(draw(), files[1])
    print(f"wrote {files[0]} and {files[1]}", file=sys.stderr)  # noqa: T201
