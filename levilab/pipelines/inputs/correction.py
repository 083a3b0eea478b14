"""How a data file is read, kept beside it in FILE.levilab.toml: `levilab open` writes it, every analysis reads it."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from levilab.errors import DataError, UsageError, list_known
from levilab.files import parse_toml, replace_atomically, toml_value, writing
from levilab.formats.columns import SHORTHANDS, key_of
from levilab.formats.texts import locate, texts_of
from levilab.formats.understanding import is_named, understand
from levilab.pipelines.options import OF_FILES, read_options

ENDING = ".levilab.toml"
#: The table of tables of what holds for one sheet or run of a file alone.
_SHEET = "sheet"
_HEAD = "# How levilab reads {name}; options on the command line go before.  levilab open --help\n"
#: The values of each key, as text.
_EXPECTED = {
    "columns": '{t = "Zeit", f = "Drehzahl [rpm]"}, each a title or a number',
    "skip_doubtful": "true or false",
    "channel": "a name or a number of a channel",
    "rate": "samples per second",
}


class CorrectionError(DataError):
    """A FILE.levilab.toml that cannot be used."""


def place_of_correction(file: Path) -> Path:
    """Return where the correction of a data file lies, also of a sheet or run in it.

    >>> from pathlib import Path
    >>> place_of_correction(Path("a/my.csv")).name
    'my.csv.levilab.toml'
    """
    file, _ = locate(file)
    return file.parent / f"{file.name}{ENDING}"  # of a folder, too, which may have no name


def read_correction(file: Path) -> dict[str, Any]:
    """Return the options kept beside a data file, by the names of their fields; empty without any.

    Of a sheet or run in it those for that alone go before those of the whole file.  Raises CorrectionError, which names
    the file and the key.
    """
    inside = locate(file)[1]
    found: dict[str, Any] = {}
    for name, options in sorted(_read_all(file).items(), key=lambda each: len(each[0])):
        found |= options if is_named(name, inside) else {}
    return found


def corrected_parts(file: Path) -> list[Path]:
    """Return the file itself; where sheets or runs in it have corrections of their own, all its sheets and these runs.

    Raises:
        CorrectionError: the correction cannot be used.
        DataError, OSError: the file cannot be read.
    """
    names = {} if locate(file)[1] or not file.is_file() else {file / name for name in _read_all(file) if name}
    if not names:
        return [file]
    parts: list[Path] = []
    for sheet in (text.path for text in texts_of(file)):
        own = [name for name in names if name != sheet and name.is_relative_to(sheet)]
        others = (run.path for run in understand(sheet).runs if not run.problem) if own else [sheet]
        parts += [sheet] if sheet in names else dict.fromkeys([*own, *others])
    return parts


def _read_all(file: Path) -> dict[str, dict[str, Any]]:
    """Return the options kept beside a data file by the sheet or run in it, "" for the whole file."""
    path = place_of_correction(file)
    if not path.is_file():
        return {}
    try:
        table = parse_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CorrectionError("{path:s}: cannot be read ({why:s})", path, error.strerror) from error
    except ValueError as error:
        raise CorrectionError("{path:s}: is no TOML ({why}): correct it, or delete it", path, error) from error
    sheets = table.pop(_SHEET, {})
    if not isinstance(sheets, dict) or not all(isinstance(one, dict) for one in sheets.values()):
        said = '{path:s}: [sheet."NAME"] is expected, and below it {keys:s}'
        raise CorrectionError(said, path, ", ".join(OF_FILES))
    try:
        return {name: read_file_options(options) for name, options in {"": table, **sheets}.items()}
    except UsageError as error:
        raise CorrectionError("{path:s}: {error}", path, error) from error


def read_file_options(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return options that say how a file is read, out of a table from elsewhere.  Raises UsageError."""
    for key, value in table.items():
        if key not in OF_FILES:
            raise UsageError(key, list_known(key, OF_FILES))
        if not _is_of_kind(key, value):
            raise UsageError(key, "{what} is expected", _EXPECTED[key], value=value)
    found = read_options({key: str(value) if key == "channel" else value for key, value in table.items()})
    if columns := found.get("columns"):
        found["columns"] = {_SHORT.get(name, name): to for name, to in columns.items()}
    return found


#: Canonical names of columns → those that people type.
_SHORT = {name: key for key, name in SHORTHANDS.items()}


def _is_of_kind(key: str, value: object) -> bool:
    if key == "skip_doubtful":
        return isinstance(value, bool)
    if key == "rate":
        return isinstance(value, float | int) and not isinstance(value, bool)
    if key == "channel" or isinstance(value, str):
        return type(value) in {str, int}
    named = value if isinstance(value, dict) else {"": ""}
    return all(map(key_of, named)) and all(type(to) in {str, int} for to in named.values())


def write_correction(file: Path, options: Mapping[str, Any]) -> Path:
    """Keep how a data file, or a sheet or run in it alone, is read, beside what was kept.  Returns the file.

    A correction that cannot be used is replaced.

    Raises:
        UsageError: there is nothing to keep.
        CannotWrite: of the file.
    """
    path, inside = place_of_correction(file), locate(file)[1]
    kept: dict[str, dict[str, Any]] = {"": {}}
    with suppress(CorrectionError):
        kept |= _read_all(file)
    kept[inside] = {**kept.get(inside, {}), **{key: options[key] for key in OF_FILES if options.get(key)}}
    if not kept[inside]:
        raise UsageError(
            "keep", "goes with `columns`, `skip_doubtful`, `channel` or `rate`: without one the file is read as it is"
        )
    lines = []
    for name, those in kept.items():
        lines += [f"\n[{_SHEET}.{toml_value(name)}]\n"] if name else []
        lines += [f"{key} = {toml_value(value)}\n" for key, value in those.items()]
    with writing(path, "copy the data file to a folder of yours"):
        replace_atomically(path, _HEAD.format(name=path.name.removesuffix(ENDING)) + "".join(lines))
    return path


def describe(options: Mapping[str, Any]) -> str:
    """Return options that say how a file is read, as text.

    >>> describe({"columns": {"t": "1", "f": "2 [rpm]"}, "rate": 100.0})
    'columns t=1,f=2 [rpm]; rate 100.0'
    """
    return "; ".join(
        f"{key} {','.join(f'{name}={to}' for name, to in value.items()) if isinstance(value, dict) else value}"
        for key, value in options.items()
    )
