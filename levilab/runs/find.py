"""Find what a person names: a run by its path or its name, the runs below a folder; nothing of it is read."""

import difflib
import os
import re
from pathlib import Path

from levilab.errors import DataError, as_typed
from levilab.formats.texts import locate, name_files
from levilab.texts.text import Text

RECORD = "run.json"
#: Where runs are, unless a person says otherwise.
RUNS = Path("runs")


def find_run(name: Path, root: Path = RUNS) -> Path:
    """Return the run folder of a path, or of the name of a run in a folder, with or without its time."""
    if name.name != str(name) or name.exists() or not root.is_dir():
        return name
    named = runs_named(name.name, root)
    return named[0] if len(named) == 1 else name


def runs_named(name: str, root: Path) -> list[Path]:
    """Return the runs in a folder that have this name, with or without their time."""
    return [folder for folder in root.iterdir() if name in {folder.name, folder.name.split("Z-", 1)[-1]}]


def find_runs(root: Path) -> list[Path]:
    """Return the run folders at or below a folder, by name; links are followed, each folder is visited once."""
    return [Path(folder) for folder in run_folders(root)]


def run_folders(root: Path) -> list[str]:
    """Return the same as text, of which ten thousand take little memory."""
    found: list[str] = []
    seen: set[object] = set()
    for folder, below, files in os.walk(root, followlinks=True):
        this = _identity(folder)
        if this in seen:
            below.clear()
            continue
        seen.add(this)
        if RECORD in files:
            found.append(folder)
    return sorted(found, key=lambda folder: folder.split(os.sep))  # noqa: PTH206 - of ten thousand folders


def _identity(folder: str) -> object:
    """Return an identity that no two folders share: a path, where the file system numbers no files."""
    try:
        there = os.stat(folder)  # noqa: PTH116 - of ten thousand folders
    except OSError:
        return os.path.realpath(folder)
    return (there.st_dev, there.st_ino) if there.st_ino else os.path.realpath(folder)


#: Parts of a correction that a shell took for paths, and what to do.
_NO_PATHS = (
    (r"\[[^\[\]]+\]",
     '{part:s}: is no path; a unit stands with its column in quotation marks: `columns` = "f=2 {part:s}"'),
    (r"\w+=[\w ]+(\[[^\[\]]+\])?",
     '{part:s}: is no path; columns stand together, with a comma, in quotation marks: `columns` = "t=1,{part:s}"'),
)  # fmt: skip


def no_such_path(path: Path) -> DataError:
    """Return the error for a path that does not exist, with a name beside it that is nearly the same."""
    for pattern, said in _NO_PATHS:
        if re.fullmatch(pattern, str(path)):
            return DataError(said, part=path)
    folder = next(place for place in (path.parent, *path.parent.parents) if place.is_dir())
    wanted = path.relative_to(folder).parts[0] if folder != path.parent else path.name
    near = difflib.get_close_matches(wanted, sorted(one.name for one in folder.iterdir()), n=1, cutoff=0.8)
    ending = path.suffix.casefold()
    files = name_files(folder, (ending,)) if ending else ""
    check = "check the name" if ending else "check the name; levilab runs lists the runs of a folder"
    there = Text("its {ending:s} files are {files:s}", ending, files) if files else check
    advice = Text("did you mean {path}?", path=folder / near[0]) if near else there
    said = "{path}: there is no such file or folder in {folder}: {advice}"
    return DataError(said, path=path, folder=folder.resolve(), advice=advice)


def existing(paths: list[Path] | None) -> list[Path]:
    """Return paths, or the folder `RUNS` where none is given.

    Raises:
        DataError: one of them is neither a path, nor a sheet in a file, nor the name of a run.
    """
    if not paths and not RUNS.exists():
        raise DataError(
            "there is no folder {folder:s} here, and no other path is given: name a run or a data file, or make a "
            "run with levilab acquire spin `mock`",
            folder=RUNS,
        )
    for path in paths or []:
        if not locate(find_run(path))[0].exists():
            raise no_such_path(path)
    return paths or [RUNS]


def run_to_resume(name: Path, root: Path) -> Path:
    """Return the folder of the run that is to be gone on with, by its path or its name.  Raises DataError."""
    folder = find_run(name, root)
    if folder.exists():
        return folder
    if name.name != str(name):
        raise DataError("{name:s}: there is no such run; levilab runs lists those of a folder", name=name)
    if not root.is_dir():
        nowhere = "no run {name:s}, there is no folder {root:s} here: go to the folder that holds {root:s}"
        raise DataError(nowhere, name=name, root=root)
    if runs_named(name.name, root):
        several = "more than one run in {root:s} is called {name:s}: say its whole name; levilab runs lists them"
        raise DataError(several, root=root, name=name)
    raise DataError("no run {name:s} in {root:s}: levilab runs lists those that are there", name=name, root=root)


def run_or_folder(name: Path, root: Path = RUNS) -> Path:
    """Return the folder of a run, or one with runs, by its path or its name.  Raises DataError."""
    folder = find_run(name, root)
    if folder.is_file():
        raise DataError("{name}: is a file: levilab open {typed:s} shows it", name=name, typed=as_typed(name))
    if not folder.is_dir():
        raise DataError("{name}: there is no such run or folder; levilab runs lists the runs", name=name)
    return folder


def must_be_searchable(root: Path) -> None:
    """Raise DataError for what is no folder that may be searched."""
    if root.is_file():
        raise DataError("{root}: is a file; name the folder that holds the runs", root=root)
    if not root.is_dir():
        raise DataError("{root:s}: there is no such folder; levilab acquire writes runs into runs/", root=root)
    if not os.access(root, os.R_OK | os.X_OK):
        raise DataError("{root}: may not be searched by you; change its permissions or name another folder", root=root)
