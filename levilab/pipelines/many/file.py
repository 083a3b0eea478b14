"""The table's files: rows are appended to a CSV as they come, and published in the order of the inputs at the end.

Beside the table FILE lies FILE.json: what it was made with, and what its columns mean.  Until it is complete the
rows are in FILE.part.csv, in the order in which they came, so that a process that is killed loses at most the last row.
"""

import csv
import io
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any, Self

from levilab.errors import DataError, UsageError, check_ending
from levilab.files import locked, parse_json, replace_atomically, replacing, writing
from levilab.pipelines.row import Cell, Column, text_of, value_of_text
from levilab.present.units import split
from levilab.software import how_to_install

SCHEMA = "levilab-table/1"
CSV, PARQUET = ".csv", ".parquet"
#: Rows in memory while a Parquet file is written: those of one row group.
GROUP = 1000
_ELSEWHERE = "choose another place with `table`"


def check_name(table: Path) -> None:
    """Raise UsageError for a table that cannot be written, before hours of work."""
    check_ending(table, (CSV, PARQUET), "table")
    if table.suffix.casefold() == PARQUET and find_spec("pyarrow") is None:
        what = "Parquet needs the extra parquet (pyarrow, which is not installed): {how}, or name a table in .csv"
        raise UsageError("table", what, how_to_install("parquet"), value=table)
    if table.is_dir():
        raise UsageError("table", "is a folder; the name of a file is expected", value=table)


class TableFile:
    """A table that is being written.

    Args:
        table: the file that it becomes.
        columns: of the table; the first one is the path.
        made_with: analysis, options and versions: rows that were made with others do not belong into it.
    """

    def __init__(self, table: Path, columns: Sequence[Column], made_with: dict[str, Any]) -> None:
        self.table = table
        self.part = table.with_name(f"{table.name}.part.csv")
        self._about_part = table.with_name(f"{table.name}.part.json")
        self._about = table.with_name(f"{table.name}.json")
        self._columns = tuple(columns)
        self._made_with = made_with
        self._places: dict[str, int] = {}
        self._lock = ExitStack()

    def __len__(self) -> int:
        return len(self._places)

    def __contains__(self, path: str) -> bool:
        return path in self._places

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):  # what could not be written was said
            self._file.close()
        self._lock.close()

    def open(self, *, resume: bool) -> Self:
        """Begin a table, or continue that of an earlier call.

        Args:
            resume: whether rows of an earlier call that was interrupted, or of the whole table, are kept.

        Raises:
            UsageError: rows of an earlier call were not asked for, or were made with other options.
            CannotWrite: the place cannot be written to, or another process writes there.
        """
        with writing(self.table, _ELSEWHERE), ExitStack() as until_failure:
            self.table.parent.mkdir(parents=True, exist_ok=True)
            until_failure.enter_context(locked(self.table, "another process is writing it; wait for its end"))
            if not self.part.exists():
                self._begin(self._earlier_rows() if resume and self.table.exists() else iter(()))
            elif resume:
                self._must_be_alike(self._about_part, self.part)
                self._cut_torn_line()
                self._file = self.part.open("r+b")
                self._find_rows()
            else:
                left = "{file:s} holds runs of an analysis that was interrupted: go on with it (`resume`), or remove it"
                raise UsageError("table", left, self.part, value=self.table)
            self._lock = until_failure.pop_all()
        return self

    def _begin(self, earlier: Iterable[Sequence[Cell]]) -> None:
        replace_atomically(self._about_part, self._description())
        self._file = self.part.open("x+b")
        self._file.write(_line([column.name for column in self._columns]))
        try:
            for cells in earlier:
                self.add(cells)
        except (ValueError, csv.Error) as error:  # those of Arrow are ValueErrors, too
            self._file.close()
            self._remove_part()
            raise DataError("{file:s}: is damaged: begin again, without `resume`", self.table) from error

    def add(self, cells: Sequence[Cell]) -> None:
        """Append a row and hand it to the operating system.  Raises CannotWrite."""
        with writing(self.part, "make room, and go on with `resume`"):
            place = self._file.tell()
            self._file.write(_line([text_of(cell) for cell in cells]))
            self._file.flush()
        self._places[str(cells[0])] = place

    def sha256(self, path: str) -> str:
        """Return the hash of the readings that the row of a path was made of; empty for a path without a row."""
        if (place := self._places.get(path)) is None:
            return ""
        self._file.seek(place)
        found = self._values(self._file.readline())[self._index("readings_sha256")]
        self._file.seek(0, os.SEEK_END)
        return str(found)

    def forget(self, path: str) -> None:
        """Leave the row of a path out of the table, unless another one is added."""
        del self._places[path]

    def publish(self, paths: Iterable[str]) -> None:
        """Write the table, its rows in the order of the paths, those without a row passed over.  Raises CannotWrite."""
        with writing(f"{self.table}: could not be written, the rows are in {self.part}", _ELSEWHERE):
            rows = self._rows(paths)
            with replacing(self.table) as file:
                if self.table.suffix.casefold() == PARQUET:
                    self._write_parquet(file, rows)
                else:
                    file.write(_line([column.name for column in self._columns]))
                    file.writelines(rows)
            replace_atomically(self._about, self._description())
            self._file.close()
            self._remove_part()

    def _remove_part(self) -> None:
        self.part.unlink()  # first: rows without their description cannot be gone on with
        self._about_part.unlink()

    def _rows(self, paths: Iterable[str]) -> Iterator[bytes]:
        for path in paths:
            if (place := self._places.get(path)) is not None:
                self._file.seek(place)
                yield self._file.readline()

    def _write_parquet(self, file: Any, rows: Iterator[bytes]) -> None:
        """Write a Parquet file in groups of rows, so that memory does not grow with the table."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        types = {"number": pa.float64(), "count": pa.int64(), "truth": pa.bool_(), "text": pa.string()}
        fields = [
            pa.field(column.name, types[column.kind], metadata={"meaning": column.meaning, **_unit_of(column)})
            for column in self._columns
        ]
        schema = pa.schema(fields, metadata={"levilab": self._description()})
        with pq.ParquetWriter(file, schema) as writer:
            while group := list(islice(rows, GROUP)):
                values = [self._values(line) for line in group]
                arrays = [
                    pa.array(column, field.type)
                    for column, field in zip(zip(*values, strict=True), fields, strict=True)
                ]
                writer.write_table(pa.Table.from_arrays(arrays, schema=schema))

    def _values(self, line: bytes) -> list[Cell]:
        texts = next(csv.reader([line.decode("utf-8")]))
        return [value_of_text(text, column.kind) for text, column in zip(texts, self._columns, strict=True)]

    # --- rows of an earlier call ---

    def _description(self) -> str:
        columns = [
            {"name": column.name, "kind": column.kind, "meaning": column.meaning, **_unit_of(column)}
            for column in self._columns
        ]
        about = {"schema": SCHEMA, **self._made_with, "columns": columns}
        return json.dumps(about, indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def _must_be_alike(self, about: Path, rows: Path) -> None:
        """Raise UsageError unless rows were made with the same options and versions."""
        try:
            theirs = parse_json(about.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            what = "{file:s} says what {rows:s} was made with, and cannot be read: begin again, without `resume`"
            raise UsageError("resume", what, about, rows) from error
        ours = parse_json(self._description())
        other = [key for key in ours if not isinstance(theirs, dict) or theirs.get(key) != ours[key]]
        if other:
            what = "{rows:s} was made with other {names:s}: give the same, or another `table`"
            raise UsageError("resume", what, rows, ", ".join(other))

    def _cut_torn_line(self) -> None:
        """Remove an incomplete last row, which a killed process left."""
        with self.part.open("r+b") as file:
            whole = 0
            for line in file:
                whole += len(line) if line.endswith(b"\n") else 0
            if not whole:
                file.seek(0)
                whole = file.write(_line([column.name for column in self._columns]))
            file.truncate(whole)

    def _find_rows(self) -> None:
        """Note where the row of each path begins, if it stands, and go to the end."""
        place = len(self._file.readline())
        for line in self._file:
            try:
                values = self._values(line)
            except (ValueError, csv.Error, StopIteration) as error:
                raise DataError("{file:s}: a row is damaged: remove the file, and begin again", self.part) from error
            if self._stands(values):
                self._places[str(values[0])] = place
            place += len(line)
        self._file.seek(place)

    def _earlier_rows(self) -> Iterator[list[Cell]]:
        """Return the rows of the complete table of an earlier call that are kept."""
        self._must_be_alike(self._about, self.table)
        rows = self._of_parquet() if self.table.suffix.casefold() == PARQUET else self._of_csv()
        return filter(self._stands, rows)

    def _stands(self, cells: Sequence[Cell]) -> bool:
        """Return whether a row is kept: a run that failed, or was not at its end, is analyzed again."""
        return cells[self._index("status")] != "running" and cells[self._index("problem")] is None

    def _index(self, column: str) -> int:
        return [one.name for one in self._columns].index(column)

    def _of_csv(self) -> Iterator[list[Cell]]:
        with self.table.open("rb") as file:
            file.readline()
            yield from map(self._values, file)

    def _of_parquet(self) -> Iterator[list[Cell]]:
        import pyarrow.parquet as pq

        with pq.ParquetFile(self.table) as file:
            for batch in file.iter_batches(batch_size=GROUP):
                yield from (list(row.values()) for row in batch.to_pylist())


def _unit_of(column: Column) -> dict[str, str]:
    """Return the unit of a column of numbers, which stands at the end of its name."""
    unit = split(column.name)[1]
    return {"unit": unit.si if unit else "1"} if column.kind == "number" else {}


def _line(texts: Sequence[str]) -> bytes:
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerow(texts)
    return written.getvalue().encode("utf-8", errors="replace")
