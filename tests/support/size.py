"""Lines of the program and of its tests: `make lint` prints them, and a test holds the limits in pyproject.toml."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: What counts: Python, and what pages and reports are made from.
SUFFIXES = frozenset({".py", ".js", ".css", ".html", ".j2", ".typ"})
FOLDERS = {"program": ("levilab", "instruments", "analysis", "pyvisa_levilab"), "tests": ("tests",)}


def count_lines() -> dict[str, int]:
    """Return the number of lines of the program and of the tests."""
    return {
        part: sum(
            len(path.read_bytes().splitlines())
            for folder in folders
            for path in (ROOT / folder).rglob("*")
            if path.suffix in SUFFIXES
        )
        for part, folders in FOLDERS.items()
    }


def read_limits() -> dict[str, int]:
    """Return the largest number of lines of each part, from pyproject.toml."""
    limits: dict[str, int] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["levilab"]["lines"]
    return limits


if __name__ == "__main__":
    limits = read_limits()
    for part, lines in count_lines().items():
        print(f"{part}: {lines} lines, at most {limits[part]}")  # noqa: T201
