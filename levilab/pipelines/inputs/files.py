"""Files of a folder that may hold data, and those that levilab wrote itself."""

import json
import os
import re
import zipfile
import zlib
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from levilab.formats.waveforms.record import SEARCHED
from levilab.runs.find import RECORD

#: A file of this name keeps its folder out of searches of the folders above.
SKIP = ".levilab-skip"


def data_files(root: Path) -> list[Path]:
    """Find the files at or below a folder that may hold data, by name; those of runs belong to their runs.

    A folder below with a file `SKIP` is left out, with all in it.  A browser's `a (1).csv` comes after `a.csv`.
    """
    files = (path for path in _files(root) if path.suffix.casefold() in SEARCHED)
    return sorted(files, key=lambda path: (path.with_suffix(""), path))


def other_files(root: Path) -> list[Path]:
    """Find the other files at or below a folder, but for those that levilab or a computer's desktop keeps there."""
    others = [path for path in _files(root) if path.suffix.casefold() not in SEARCHED]
    return sorted(set(others) - files_of_levilab(others))


def files_of_levilab(paths: Sequence[Path]) -> set[Path]:
    """Return those of files that levilab has written: results, their figures, corrections of columns."""
    results = [path for path in paths if _RESULT.search(path.name)]
    figures = {result.with_name(f"{_RESULT.sub('', result.name)}{_analysis_of(result)}.png") for result in results}
    return {*results, *(path for path in paths if path in figures or path.name.endswith(_CORRECTION))}


def _analysis_of(result: Path) -> str:
    """Return the name of the analysis that wrote a result; empty where it cannot be read."""
    try:
        return str(json.loads(result.read_bytes())["analysis"])
    except (OSError, ValueError, LookupError, TypeError):
        return ""


def is_archive_of(path: Path, runs: Collection[Path]) -> bool:
    """Return whether a file is a zip of runs that lie unpacked, too: of one beside it, or with the same records."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = [member for member in archive.infolist() if Path(member.filename).name == RECORD]
    except (OSError, ValueError, zipfile.BadZipFile):
        return False
    records = {zlib.crc32((run / RECORD).read_bytes()) for run in runs}
    return bool(members) and (path.with_suffix("") in runs or records.issuperset(member.CRC for member in members))


#: How names of files begin that are not a person's.
_OF_DESKTOPS = (".", "~$", "desktop.ini", "Thumbs.db", SKIP)

#: Tables that are saved with the result of a film, and this: results, and no further inputs of a folder.
_OF_FILM = re.compile(r"(.+)\.(tracks|spin|limit|precession)\.csv")
_RESULT_OF_FILM, _RESULT_OF_FILMS = re.compile(r"(.+)\.\w+\.result\.video\.json"), "result.video.json"

#: How an export begins; and what stands in which member of exports of several inputs, which no analysis reads.
_EXPORT = b"analysis,model,name,value,u,unit"
_OF_SEVERAL = {".xlsx": ("docProps/core.xml", b"<cp:keywords>levilab<"), ".zip": ("run-001.json", b"{")}

#: How names of files end that levilab writes beside what it reads.
_RESULT, _CORRECTION = re.compile(r"result(\.\w+)?\.json$"), ".levilab.toml"


def _exports(folder: Path, files: Sequence[str]) -> Iterator[str]:
    """Yield the tables of exports and the spreadsheets of several inputs; the readings of one are an input, too."""
    for name in files:
        stem = name.removesuffix(".result.csv")
        if stem != name and _begin(folder / name).startswith(_EXPORT):
            yield from (name, f"{stem}.inputs.csv", *([f"{stem}.csv"] * (f"{stem}.inputs.csv" in files)))
        elif (mark := _OF_SEVERAL.get(Path(name).suffix)) and mark[1] in _begin(folder / name, mark[0]):
            yield name


def _begin(path: Path, member: str = "") -> bytes:
    """Return how a file, or one in an archive, begins; empty where it cannot be read."""
    try:
        with zipfile.ZipFile(path).open(member) if member else path.open("rb") as stream:
            return stream.read(1000)
    except (OSError, KeyError, RuntimeError, ValueError, zipfile.BadZipFile):
        return b""


def _files(root: Path) -> list[Path]:
    """Return the files at or below a folder that belong to no run."""
    found, seen = [], set()
    for folder, below, files in os.walk(root, followlinks=True):
        real = os.path.realpath(folder)
        if real in seen or RECORD in files or (SKIP in files and Path(folder) != root):
            below.clear()
            continue
        seen.add(real)
        films = {film[1] for name in files if (film := _RESULT_OF_FILM.fullmatch(name))}
        if _RESULT_OF_FILMS in files:
            films |= {"films", *(Path(name).stem for name in files)}
        own = {name for name in files if (table := _OF_FILM.fullmatch(name)) and table[1] in films}
        own |= {*_exports(Path(folder), files)}
        found += [Path(folder) / name for name in files if name not in own and not name.startswith(_OF_DESKTOPS)]
    return found
