"""Files: read with every surprise as a ValueError, replaced whole or not at all."""

import contextlib
import errno
import glob
import json
import math
import os
import re
import tempfile
import tomllib
from collections.abc import Iterator
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, BinaryIO

from levilab.computer import computer
from levilab.errors import LevilabError, UsageError
from levilab.texts.text import Text


class CannotWrite(LevilabError):
    """A file cannot be written (any more).

    Attributes:
        problem: what was seen, without what to do.
    """

    def __init__(self, problem: str, advice: str = "") -> None:
        self.problem = problem
        super().__init__("{problem}: {advice}" if advice else "{problem}", problem=problem, advice=advice)


#: No program writes tables within tables deeper than this; Python's recursion bears some hundreds.
DEEPEST = 50
#: Whole numbers beyond it have no float, and beyond 4300 digits Python does not even read them.
LARGEST = 10**300


def parse_json(text: str) -> Any:
    """Return the content of a JSON text.

    Raises:
        ValueError: it is not JSON, or it holds what no program of ours writes and much of Python stumbles over:
            nesting beyond DEEPEST, a whole number beyond LARGEST, NaN, infinity, half a surrogate pair.
    """
    try:
        return _parse_strict_json(text)
    except json.JSONDecodeError as error:
        raise ValueError(Text("from line {line}, column {column} on", error.lineno, error.colno)) from error


def _parse_strict_json(text: str) -> Any:
    _refuse_surrogates(text)
    if "\\u" not in text and text.count("{") + text.count("[") <= DEEPEST:  # nothing to look for afterwards
        return json.loads(text, parse_int=_whole_number, parse_float=_finite_number, parse_constant=_finite_number)
    try:
        value = json.loads(text, parse_int=_whole_number)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    _refuse_oddities(value, finite=True)
    return value


def _finite_number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(_NOT_FINITE)
    return number


def toml_value(value: Any) -> str:
    """Return a value as TOML: JSON's strings, finite numbers and lists but for DEL, or an inline table."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml_value(to)}" for key, to in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")


def parse_toml(text: str) -> dict[str, Any]:
    """Return the content of a TOML text.

    Raises:
        ValueError: it is not TOML, or it holds nesting beyond DEEPEST or a whole number beyond LARGEST.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        error.args = (f"{error}{_hint(text, str(error))}",)
        raise
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    except ValueError:  # Python reads no more than 4300 digits
        raise ValueError(_TOO_LARGE) from None
    _refuse_oddities(table, finite=False)
    return table


def read_toml(file: Path | Traversable, refusal: type[LevilabError], missing: str, expected: str) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises:
        refusal: it cannot be read; it says what is expected, or where there is no such file the text `missing`.
    """
    try:
        return parse_toml(file.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise refusal(missing) from None
    except OSError as error:
        if file.is_dir():
            raise refusal("{path}: is a folder; {expected}", path=file, expected=expected) from None
        what = "{path}: cannot be read ({why}); {expected}"
        raise refusal(what, path=file, why=error.strerror, expected=expected) from error
    except ValueError as error:
        what = "{path}: not readable as TOML: {why}; {expected}"
        raise refusal(what, path=file, why=error, expected=expected) from error


#: Ends of names of files that people give where a folder is expected.
_OF_FILES = frozenset({
    ".png", ".pdf", ".svg", ".jpg", ".gif", ".mp4", ".html", ".md", ".docx", ".json", ".toml", ".csv", ".txt", ".xlsx",
    ".nc", ".h5", ".zip",
})  # fmt: skip


def check_folder(name: str, folder: Path | None) -> None:
    """Raise UsageError where a folder that is to be made has the name of a file.

    Args:
        name: of the argument.
        folder: None is none.
    """
    if folder and folder.suffix.lower() in _OF_FILES and not folder.is_dir():
        how = "a folder is expected, in which the files have names of their own"
        other = "levilab report writes .html and .pdf, levilab export .nc, .h5, .csv, .xlsx and .zip"
        raise UsageError(name, f"{how}; {other}", value=folder)


def _hint(text: str, said: str) -> str:
    """Return the fault of a number at which TOML stopped, as the rest of a sentence; empty for anything else."""
    place = re.search(r"line (\d+)", said)
    line = text.splitlines()[int(place[1]) - 1] if place and int(place[1]) <= len(text.splitlines()) else ""
    if re.search(r"=\s*[+-]?\d+,\d", line):
        return "; write a decimal point, not a comma"
    if re.search(r"=\s*[+-]?\d[\d.]*\s*[A-Za-zµ°%]", line):
        return "; write the number without its unit, which is in the key's name"
    return ""


_TOO_DEEP = Text("it is nested more than {n} levels deep", n=DEEPEST)
_NOT_FINITE = "a number in it is not finite"
_TOO_LARGE = "a whole number in it has more than 300 digits"


def finite(value: Any) -> Any:
    """Return a value for JSON: numbers that are not finite become null, in tables and lists too.

    >>> finite({"mean": 1.0, "spread": [math.inf, math.nan]})
    {'mean': 1.0, 'spread': [None, None]}
    """
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_json(value: Any) -> str:
    """Return the text of a file for people and programs; numbers must be finite."""
    return json.dumps(value, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)


def _whole_number(digits: str) -> int:
    if len(digits) > 302 or abs(number := int(digits)) > LARGEST:
        raise ValueError(_TOO_LARGE)
    return number


def _refuse_oddities(value: Any, *, finite: bool) -> None:
    level, depth = [value], 0
    while level:
        if depth > DEEPEST:
            raise ValueError(_TOO_DEEP)
        for item in level:
            if isinstance(item, str):
                _refuse_surrogates(item)
            elif isinstance(item, int) and abs(item) > LARGEST:
                raise ValueError(_TOO_LARGE)
            elif isinstance(item, float) and finite and not math.isfinite(item):
                raise ValueError(_NOT_FINITE)
        level = [inner for item in level for inner in _parts(item)]
        depth += 1


def _parts(item: Any) -> list[Any]:
    if isinstance(item, dict):
        return [*item, *item.values()]
    return item if isinstance(item, list) else []


def _refuse_surrogates(text: str) -> None:
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError("a text in it holds half a surrogate pair") from None


@contextlib.contextmanager
def writing(what: str | Path, advice: str = "choose another place with `out`") -> Iterator[None]:
    """Raise CannotWrite, in a sentence, for what the operating system refuses.

    Args:
        what: the path, or the beginning of the sentence: what could not be written, and where.
        advice: what to do.
    """
    try:
        yield
    except OSError as error:
        said = Text("{path:s}: could not be written", path=what) if isinstance(what, Path) else what
        raise CannotWrite(Text("{said} ({why})", said=said, why=error.strerror or str(error)), advice) from error


def must_be_folder(path: Path) -> None:
    """Raise CannotWrite for a file in the place of a folder that is to be written into, or of one above it."""
    there = next((place for place in (path, *path.parents) if place.exists()), path)
    if there.is_file():
        raise CannotWrite(f"{there}: is a file, a folder is expected; choose another place with `out`")


def check_writable(path: Path) -> None:
    """Raise OSError where a file of this path cannot be written; nothing is left behind."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    folder = next(place for place in (path.parent, *path.parent.parents) if place.exists())
    with tempfile.TemporaryFile(dir=folder):
        pass


def stamp(path: Path) -> tuple[int, int, int] | None:
    """Return a stamp that changes when a file is written or replaced: time [ns], size, inode; None without one."""
    try:
        found = os.stat(path)  # noqa: PTH116 - some 20 times a second
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, all of them on the disk.  Raises OSError."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        with contextlib.suppress(FileExistsError):
            computer().make_folder(path)
        computer().sync_folder(path.parent)


def replace_atomically(path: Path, content: str | bytes) -> None:
    """Write a file so that a reader sees the old one or the new one, whole, whatever happens meanwhile.

    Text is written as UTF-8 with line feeds; what UTF-8 has no place for, as the name of a file that is none, becomes a
    question mark.  Raises OSError.
    """
    with replacing(path) as file:
        file.write(content.encode(errors="replace") if isinstance(content, str) else content)


@contextlib.contextmanager
def replacing(path: Path, *, among_many: bool = False) -> Iterator[BinaryIO]:
    """Yield a file that replaces another one as a whole when the context ends without an error.  Raises OSError.

    among_many: whether its folder may have thousands of files: parts of killed processes are not searched there.
    """
    part = path.with_name(f".{path.name}.{computer().process}.part")
    if not among_many:
        _remove_parts_of_the_dead(path)
    try:
        computer().remove(part)  # of an earlier process of this number
        with computer().open(part, "xb") as file:  # never through a link that stands there
            yield file
            file.flush()
            computer().sync(file)
        computer().move(part, path)
        computer().sync_folder(path.parent)
    except BaseException:
        with contextlib.suppress(OSError):
            computer().remove(part)
        raise


def _remove_parts_of_the_dead(path: Path) -> None:
    """Remove the parts of a file that killed processes have left."""
    for part in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        number = part.name.removesuffix(".part").rpartition(".")[2]
        if number.isdecimal() and not computer().is_alive(int(number)):
            with contextlib.suppress(OSError):  # Windows: its process has it open
                computer().remove(part)


@contextlib.contextmanager
def locked(path: Path, busy: str) -> Iterator[None]:
    """Keep other processes that do the same from writing a file or a folder meanwhile.

    Args:
        path: of the file or folder; the lock lies beside it.
        busy: what to say if another process holds the lock, behind the path.

    Raises:
        CannotWrite: another process holds it.
        OSError: the lock cannot be made.
    """
    from filelock import Timeout

    lock = computer().lock(path.with_name(f".{path.name}.lock"))
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise CannotWrite(f"{path}: {busy}") from None
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # while it is held, so that no file is removed that another one holds
            os.unlink(lock.lock_file)  # noqa: PTH108 - the path is text
        lock.release()
