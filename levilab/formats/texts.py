"""The text of each table in a file: the file's own, the sheets of a spreadsheet, the files of a zip, JSON.

All become lines of text, so that one reader understands them; nothing is written to the disk, no macro is run and no
link to another file is followed.
"""

import codecs
import io
import json
import re
import zipfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, BinaryIO

import python_calamine

from levilab.formats.columns import NoTable, TableError
from levilab.formats.dialect import UNVALUED, value_and_u
from levilab.formats.dress import undress
from levilab.formats.kinds import OTHER, kind_of_bytes
from levilab.texts.text import Text as Said

#: Bytes that a workbook or an archive may unpack to: a spreadsheet of a million rows has some 100 MB, and a reader
#: needs several times as much memory.
MOST_UNPACKED = 1 << 29
#: Cells of a sheet from its first to its last one, empty ones included: one filled cell far down makes billions.
MOST_CELLS = 30_000_000
#: Members of an archive: each costs a look.
MOST_MEMBERS = 10_000
#: Bytes of a text that is written in another form (JSON, log of an Arduino) and read as a whole.
MOST_REWRITTEN = 1 << 26
#: How the names of spreadsheets end, and those of texts in an archive.
SPREADSHEETS = frozenset({".xlsx", ".xlsm", ".xls", ".ods"})
TEXTS = frozenset({".csv", ".txt", ".tsv", ".dat", ".lvm", ".lab"})
#: The record of a run in an archive; of several in one export they are numbered.
_RUN = re.compile(r"(.*[/\\])?run(-\d+)?\.json", re.DOTALL)
_OLE, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"
_BLOCK = 1 << 18
#: Files of a folder that a message names.
_NAMED = 8


@dataclass(frozen=True, eq=False)
class Text:
    """A table as lines of text.

    Attributes:
        path: the file; behind it, as if it were a folder, the name of the sheet or of the file in the archive.
        content: None where it is the file's own.
        titles: of the columns, where each row of the file has them.
        aligned: whether a field stands in its column whatever stands beside it, as in a spreadsheet.
        lies: whether the lines are the columns of the file.
    """

    path: Path
    content: bytes | None = None
    titles: tuple[str, ...] = ()
    aligned: bool = False
    lies: bool = False

    def open(self) -> BinaryIO:
        """Return the stream of its bytes.  Raises OSError."""
        return self.path.open("rb") if self.content is None else io.BytesIO(self.content)

    @property
    def size(self) -> int:
        """Number of its bytes."""
        return self.path.stat().st_size if self.content is None else len(self.content)


def locate(path: Path) -> tuple[Path, str]:
    """Return the file that a path leads to or into, and what it names in the file; the path itself if there is none.

    >>> locate(Path("no/such.xlsx/Sheet1"))[1]
    ''
    """
    for file in (path, *path.parents):
        try:
            if file.is_file():
                return file, path.relative_to(file).as_posix() if file != path else ""
            if file.exists():
                break
        except (OSError, ValueError):  # no name that a file can have
            break
    return path, ""


def name_files(folder: Path, ends: Collection[str] = ()) -> str:
    """Return the names of a folder's files, the first of many, as text; with `ends`, of names that end so."""
    files = sorted(one.name for one in folder.iterdir() if one.is_file() and not one.name.startswith("."))
    files = [name for name in files if not ends or Path(name).suffix.casefold() in ends]
    return ", ".join([*files[:_NAMED], *["…"] * (len(files) > _NAMED)])


def must_be_file(path: Path) -> None:
    """Raise TableError for a folder, a pipe or a device, FileNotFoundError for nothing: reading it would wait."""
    path = locate(path)[0]
    if path.is_dir():
        names = name_files(path, (*TEXTS, *SPREADSHEETS)) or name_files(path)
        advice = Said("name one in it: {names:s}" if names else "there are no files in it", names=names)
        raise TableError(
            path, "is a folder, which levilab analyze, report and class take; here a file is expected: {advice}", advice
        )
    if not path.exists():  # also for a name that no file can have
        raise FileNotFoundError
    if not path.is_file():
        raise TableError(path, "is a device or a pipe; a data file is expected: save it to a file first")


def texts_of(file: Path) -> tuple[Text, ...]:
    """Return the texts in a file, at least one.

    Raises:
        NoTable: it is of another kind.
        TableError: it is damaged, locked, or too large when unpacked.
        OSError: it cannot be read.
    """
    must_be_file(file)
    status = file.stat()
    return _texts(file, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=8)  # each analysis looks at each file, and at each sheet of it
def _texts(file: Path, _: int, size: int) -> tuple[Text, ...]:
    with file.open("rb") as stream:
        head = stream.read(1 << 16)
    kind = kind_of_bytes(head, file.suffix)
    if kind.suffixes and not kind.marks and (b"\0" in head or kind_of_bytes(head) is not OTHER):
        raise NoTable(file, "is {kind}: {advice}", kind.name, kind.advice, kind=kind)
    if head.startswith(_OLE):
        return _sheets(file, file)
    if head.startswith(_ZIP):
        return _unpacked(file)
    if head[:200].removeprefix(codecs.BOM_UTF8).lstrip()[:1] in {b"{", b"["} and file.suffix.casefold() != ".csv":
        return (_of_json(file, size),)
    dressed = undress(head, lambda: _read(file, size))
    if dressed is None and file.suffix.casefold() in {".md", ".markdown"}:
        raise NoTable(file, "is a Markdown page without a table of readings")
    return (Text(file, dressed.content, dressed.titles) if dressed else Text(file),)


def _place(file: Path, name: str) -> Path:
    r"""Return the path of a sheet or a member as if the file were a folder: below it, whatever the name says.

    >>> _place(Path("my.zip"), "/../C:\\a/./b.csv").as_posix()
    'my.zip/C-/a/b.csv'
    """
    parts = re.split(r"[/\\]", name.replace(":", "-"))
    return file.joinpath(*([part for part in parts if part not in {"", ".", ".."}] or ["unnamed"]))


def _read(file: Path, size: int) -> bytes:
    if size > MOST_REWRITTEN:
        most = "has {size} MB, up to {most} MB are read in this form: use CSV"
        raise TableError(file, most, size >> 20, MOST_REWRITTEN >> 20)
    return file.read_bytes()


# --- archives ------------------------------------------------------------------------------------------


def _unpacked(file: Path) -> tuple[Text, ...]:
    """Return the texts of a spreadsheet or of an archive with tables, after a look at how large it gets."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            if runs := [member.filename for member in members if _RUN.fullmatch(member.filename)]:
                raise TableError(file, "holds a run of levilab ({run:s}): unpack it, and name its folder", runs[0])
            workbook = bool({"xl/workbook.xml", "content.xml"} & {member.filename for member in members})
            taken = members if workbook else [member for member in members if _may_be_table(member.filename)]
            seen = sum(member.file_size for member in taken)
            if len(taken) > MOST_MEMBERS or seen > MOST_UNPACKED:
                raise _too_large(file, "{n} files of {size:.1f} GB", len(taken), seen / 2**30)
            if workbook:
                return _sheets(file, _marked(file, archive, taken) if _check(file, archive, taken) else file)
            found = list(_members(file, archive, taken))
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, zipfile.zlib.error) as error:  # type: ignore[attr-defined]
        what = "is locked by a password" if "encrypted" in str(error) else "is a damaged ZIP or Excel file"
        raise TableError(file, "{what}: open it with its own program and save it again, unlocked", what) from error
    if not found:
        raise NoTable(file, "is a ZIP file without a table: CSV, TXT or a spreadsheet is expected in it: unpack it")
    return tuple(found)


def _may_be_table(name: str) -> bool:
    parts = name.split("/")
    hidden = any(part.startswith((".", "__")) or part == "meta" for part in parts)  # of phyphox: when, with what
    return not hidden and Path(name).suffix.casefold() in TEXTS


def _too_large(file: Path, what: str, *values: float) -> TableError:
    most = "unpacks to {what}, up to {size} MB and {cells:,} cells are read: export it as CSV"
    return TableError(file, most, Said(what, *values), MOST_UNPACKED >> 20, MOST_CELLS)


def _members(file: Path, archive: zipfile.ZipFile, members: Iterable[zipfile.ZipInfo]) -> Iterator[Text]:
    left = MOST_UNPACKED
    for member in members:
        blocks = list(_blocks(file, archive, member, left))
        content = b"".join(blocks)
        left -= len(content)
        dressed = undress(content[: 1 << 16], partial(bytes, content))
        inside = _place(file, member.filename)
        yield Text(inside, dressed.content, dressed.titles) if dressed else Text(inside, content)


def _blocks(file: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, most: int) -> Iterator[bytes]:
    """Yield what a member unpacks to, whatever length its entry says.  Raises TableError beyond `most` bytes."""
    free = copy(member)
    free.file_size = 1 << 60
    with archive.open(free) as stream:
        while block := stream.read(_BLOCK):
            most -= len(block)
            if most < 0:
                raise _too_large(file, "more than its directory says")
            yield block


# --- spreadsheets --------------------------------------------------------------------------------------


_CELLS_OF = "{rows:,} rows of {columns:,} columns"
_ADDRESS = re.compile(rb"r=[\"']([A-Z]{1,3})(\d{1,7})")
#: The address of a cell right of column Z or below row 999 999; without any such a sheet is of an allowed size.
_FAR = re.compile(rb"r=[\"'](?:[A-Z]{2}|[A-Z]\d{7})")
#: A formula of Excel whose number was never worked out, its address; a text may be empty.
_WITHOUT_VALUE = re.compile(
    rb"""<c (?![^<>]*t="str")(?:[^<>]*?(r="\w+"))?[^<>]*>\s*<f[^<>]*(?:/>|>[^<]*</f>)\s*(?:<v ?/>|<v></v>)?\s*</c>"""
)
_OPENED = re.compile(rb"<table:(table|table-row|table-cell|covered-table-cell)(?![\w-])([^<>]*)>")
_REPEATED = re.compile(rb"number-(?:rows|columns)-repeated=[\"'](\d+)")


def _check(file: Path, archive: zipfile.ZipFile, members: Sequence[zipfile.ZipInfo]) -> bool:
    """Refuse a workbook that is too large: its bytes, cells, repeated texts.  Return whether a formula has no value."""
    left, longest, texts, unvalued = MOST_UNPACKED, 0, 0, False
    for member in members:
        far, ods, rest = False, _OdsCells(), b""
        for block in _blocks(file, archive, member, left):
            left -= len(block)
            rest += block
            if member.filename == "content.xml":
                ods.feed(rest)
            if b"</si>" in rest:
                longest = max(longest, *map(len, rest.split(b"</si>")))
            far = far or _FAR.search(rest) is not None
            unvalued = unvalued or (b"<f" in rest and _WITHOUT_VALUE.search(rest) is not None)
            texts += rest.count(b't="s"') + rest.count(b"t='s'")
            rest = rest[max(rest.rfind(b"<"), 0) :]
        rows, columns = ods.rows, ods.columns
        if far:
            rows, columns = _extent(_blocks(file, archive, member, MOST_UNPACKED))
        if rows * columns > MOST_CELLS:
            raise _too_large(file, _CELLS_OF, rows, columns)
    if longest * texts > 4 * MOST_UNPACKED:
        raise _too_large(file, "{cells:,} cells with texts of up to {letters:,} letters", texts, longest)
    return unvalued


def _marked(file: Path, archive: zipfile.ZipFile, members: Sequence[zipfile.ZipInfo]) -> BinaryIO:
    """Return a workbook with a text in each cell whose formula has no value: empty it would pass for a missed one."""
    marked, cell = io.BytesIO(), rf'<c \1 t="str"><v>{UNVALUED}</v></c>'.encode()
    with zipfile.ZipFile(marked, "w") as out:
        for member in members:
            content = b"".join(_blocks(file, archive, member, MOST_UNPACKED))
            out.writestr(member.filename, _WITHOUT_VALUE.sub(cell, content))
    marked.seek(0)
    return marked


def _extent(blocks: Iterable[bytes]) -> tuple[int, int]:
    """Return the last row and the last column of a sheet of Excel."""
    rows, columns, rest = 0, 0, b""
    for block in blocks:
        found = _ADDRESS.findall(rest + block)
        rows = max([rows, *(int(row) for _, row in found)])
        columns = max([columns, *(_column(letters) for letters in {letters for letters, _ in found})])
        rest = block[-20:]  # an address may lie across two blocks
    return rows, columns


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - 64
    return number


class _OdsCells:
    """Last row and column of an OpenDocument sheet with something in them, as its elements come."""

    def __init__(self) -> None:
        self.rows = self.columns = 0
        self._row = self._repeated = self._column = 0

    def feed(self, text: bytes) -> None:
        """Count the elements of a piece that ends before an element."""
        for kind, attributes in _OPENED.findall(text):
            repeated = int(found[1]) if (found := _REPEATED.search(attributes)) else 1
            if kind == b"table":
                self._row = self._repeated = 0
            elif kind == b"table-row":
                self._row += self._repeated
                self._repeated, self._column = repeated, 0
            else:
                self._column += repeated
                if b"value-type=" in attributes:
                    self.rows = max(self.rows, self._row + self._repeated)
                    self.columns = max(self.columns, self._column)


_DAMAGED = "is a damaged spreadsheet: open it and save it again as .xlsx"
_VISIBLE = python_calamine.SheetVisibleEnum.Visible


def _sheets(file: Path, source: Path | BinaryIO) -> tuple[Text, ...]:
    """Return the sheets of a spreadsheet that are shown and hold cells, from the file or from its bytes."""
    try:
        with python_calamine.load_workbook(source) as book:
            shown = [k for k, one in enumerate(book.sheets_metadata) if one.visible is _VISIBLE]
            sheets = [book.get_sheet_by_index(k) for k in shown]
            _must_be_of_a_size(file, sheets)
            found = [(sheet.name, sheet.to_python(skip_empty_area=False)) for sheet in sheets if sheet.height]
    except python_calamine.PasswordError as error:
        raise TableError(file, "is locked by a password: save it without one") from error
    except (python_calamine.CalamineError, OSError, ValueError) as error:
        raise TableError(file, _DAMAGED) from error
    except BaseException as error:  # a defect of the library in a damaged file; it is written in Rust
        if type(error).__name__ != "PanicException":
            raise
        raise TableError(file, _DAMAGED) from error
    if not found:
        raise NoTable(file, "is an empty spreadsheet")
    return tuple(Text(_place(file, name.replace("/", "-")), _lines(rows), aligned=True) for name, rows in found)


def _must_be_of_a_size(file: Path, sheets: Sequence[Any]) -> None:
    for sheet in sheets:
        if sheet.total_height * sheet.total_width > MOST_CELLS:
            raise _too_large(file, _CELLS_OF, sheet.total_height, sheet.total_width)


def _lines(rows: Sequence[Sequence[Any]]) -> bytes:
    """Return a sheet as lines with tabs and decimal points, each number to its last bit."""
    texts = [cell for row in rows for cell in row if cell.__class__ is str and cell]
    comma = not any(map(_POINTED.fullmatch, texts))
    write = {**_CELLS, str: _with_points if comma else _plain}
    clocks = {k for row in rows for k, cell in enumerate(row) if cell.__class__ is datetime}

    def line(row: Sequence[Any]) -> str:
        if _NUMBERS.issuperset(map(type, row)):
            return "\t".join(map(repr, row))
        at = [" 00:00:00" if k in clocks and cell.__class__ is date else "" for k, cell in enumerate(row)]  # midnight
        return "\t".join([write[type(cell)](cell) + end for cell, end in zip(row, at, strict=True)])

    return "".join([f"{line(row)}\n" for row in rows]).encode()


_NUMBERS = frozenset({float, int})


#: Numbers typed as text, with a decimal point, with a decimal comma and perhaps a unit.
_POINTED = re.compile(r"[+-]?[\d,]*\.\d+\b.*", re.DOTALL)
_COMMA = re.compile(r"([+-]?\d+),(\d+(?:[eE][+-]?\d+)?(?:\s*[^\d\s,].*)?)")


def _plain(text: str) -> str:
    return " ".join(text.replace('"', "″").split())


def _with_points(text: str) -> str:
    if value_and_u(text.strip()):
        return _plain(text).replace(",", ".")
    return _COMMA.sub(r"\1.\2", _plain(text)) if _COMMA.fullmatch(text.strip()) else _plain(text)


def _clock(cell: timedelta) -> str:
    """Return a time that was passed as a stopwatch shows it."""
    seconds = cell.total_seconds()
    return f"{int(seconds // 3600)}:{int(seconds % 3600 // 60):02d}:{seconds % 60:09.6f}"


_CELLS: Mapping[type, Callable[[Any], str]] = {
    int: repr,
    float: repr,
    bool: str,
    datetime: lambda cell: cell.isoformat(" "),
    date: date.isoformat,
    time: time.isoformat,
    timedelta: _clock,
}


# --- JSON ----------------------------------------------------------------------------------------------


def _of_json(file: Path, size: int) -> Text:
    """Return a table in JSON: columns of values, a list of objects, a list of rows; as pandas and browsers write it."""
    content = _read(file, size)
    try:
        data = json.loads(content)
    except ValueError:
        try:  # an object a line
            data = [json.loads(line) for line in content.splitlines() if line.strip()]
        except ValueError:
            if file.suffix.casefold() not in {".json", ".jsonl"}:
                return Text(file)
            raise NoTable(file, "is cut off or no JSON: export it again, or as CSV") from None
    except RecursionError:
        raise NoTable(file, "is JSON in too many levels: export the table alone, or as CSV") from None
    if isinstance(data, dict) and "schema" in data:
        raise NoTable(file, "is a JSON file of a run or a result: name the folder of the run instead")
    rows = _rows_of(data)
    if rows is None:
        expected = '{"t": [0, 1, …], "f": [38, 37.9, …]} or [{"t": 0, "f": 38}, …] is expected'
        raise NoTable(file, "is a JSON file without a table: {expected}", expected)
    return Text(file, _lines([["" if cell is None else cell for cell in row] for row in rows]), aligned=True)


def _rows_of(data: Any) -> list[Sequence[Any]] | None:
    """Return the rows of the first table in parsed JSON, titles first."""
    if isinstance(data, list) and data:
        if all(isinstance(row, dict) for row in data):
            names = list(dict.fromkeys(name for row in data for name in row))
            return [names, *([row.get(name) for name in names] for row in data)]
        if all(isinstance(row, list) for row in data):
            return data
    if isinstance(data, dict):
        columns = {
            name: list(column.values()) if isinstance(column, dict) else column
            for name, column in data.items()
            if isinstance(column, dict | list)
        }
        flat = {
            name: column
            for name, column in columns.items()
            if not any(isinstance(cell, dict | list) for cell in column)
        }
        longest = max(map(len, flat.values()), default=0)
        table = {name: column for name, column in flat.items() if len(column) == longest}
        if len(table) > 1 and longest > 1:
            return [list(table), *zip(*table.values(), strict=True)]
        return next((rows for one in data.values() if (rows := _rows_of(one))), None)
    return None
