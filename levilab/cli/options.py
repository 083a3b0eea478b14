"""The options that commands share."""

import inspect
import math
import os
from collections.abc import Callable, Collection, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer

from levilab.errors import UsageError, check_ending, check_language, list_known
from levilab.texts.text import ENGLISH, Text, languages, speak


def number(unit: str = "", *, low: float = -math.inf, high: float = math.inf) -> Callable[[Any], float]:
    """Return the reader of an option: a number in a unit, which may be typed with another one, as 2min for 120 [s].

    Its reader raises ValueError, whose text says what is expected; so it does beyond low and high.
    """

    def read(typed: Any) -> float:
        from levilab.formats.ranges import WithUnit  # not for every help
        from levilab.formats.typed import read_number

        value = read_number(typed, unit) if isinstance(typed, str) else float(typed)
        if not low <= value <= high and not math.isnan(value):
            span = f"of {low:g} or more" if high == math.inf else f"from {low:g} to {high:g}"
            raise ValueError(f"{typed!r}: a number {span}{f' [{unit}]' * bool(unit)} is expected")
        has_unit = isinstance(typed, str) and typed.strip()[-1:].isalpha()
        return WithUnit(value, typed.strip()) if has_unit else value

    return read


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """Return an option with a value.

    Args:
        metavar: what is written: DIR, FILE, N.
        text: the help.
        names: as "--set", where it is not the parameter's.
        more: of typer.Option.
    """
    return typer.Option(*names, metavar=metavar, help=text, **more)


def argument(metavar: str, text: str, **more: Any) -> Any:
    """Return an argument without a name; see `option`."""
    return typer.Argument(metavar=metavar, help=text, **more)


def flag(text: str, *names: str, **more: Any) -> Any:
    """Return an option without a metavar of its own; see `option`."""
    return typer.Option(*names, help=text, **more)


def quantity(metavar: str, unit: str, text: str, *, low: float = -math.inf, high: float = math.inf, **more: Any) -> Any:
    """Return an option whose value is a number in a unit; see `number` and `option`."""
    return option(metavar, text, parser=number(unit, low=low, high=high), **more)


def place(metavar: str, text: str, endings: Collection[str] = (), **more: Any) -> Any:
    """Return the option for where a command writes, which has one name in all of them; see `option`.

    Args:
        metavar: of a folder DIR or NAME.zarr, which refuses the names of files.
        text: the help.
        endings: of the files that the command writes; it refuses others.
        more: of typer.Option.
    """

    def check(path: Path | None) -> Path | None:
        if path is not None and endings:
            check_ending(path, endings)
        target = path if endings else folder(path)
        return target if target is None or target.suffix == ".zarr" else writable(target)

    return option(metavar, text, "--out", "-o", **{"callback": check, **more})


def writable(path: Path | None) -> Path | None:
    """Return the name of a file, or of a folder, that can be written.  Raises CannotWrite before anything is done."""
    if path is not None:
        from levilab.files import check_writable, must_be_folder, writing

        must_be_folder(path.parent if path.suffix else path)
        with writing(path, "choose another place with `out`"):
            check_writable(path if path.suffix else path / "file")
    return path


def folder(path: Path | None) -> Path | None:
    """Return the name of a folder that files are written into.  Raises UsageError for the name of a file."""
    if path is not None:
        from levilab.files import check_folder

        check_folder("out", path)
    return path


def existing_paths(paths: list[Path] | None) -> list[Path] | None:
    """Return paths, each of which is there.  Raises DataError before anything is imported that takes long."""
    if not paths:
        return paths
    from levilab.runs.find import existing

    return existing(paths)


def existing_path(path: Path | None) -> Path | None:
    """Return a path that is there.  Raises DataError."""
    existing_paths([path] if path else None)
    return path


def among(known: Collection[str], what: str) -> Callable[[Any], Any]:
    """Return the check of names, in a list or with commas: UsageError before their room is imported, which takes long.

    Args:
        known: names.
        what: the option's name, or what is named.
    """

    def check(given: Any) -> Any:
        for name in [one.strip() for one in given.split(",")] if isinstance(given, str) else given or ():
            if name not in known:
                raise UsageError(what, list_known(name, known), value=name or "''")
        return given

    return check


def _runs_or(paths: list[Path] | None) -> list[Path]:
    from levilab.runs.find import existing

    return existing(paths)


def named_scene(scene: str | None) -> str:
    """Return the name of a scene.  Raises UsageError where none is given."""
    if scene is None:
        text = "is missing: name one of {scenes:s}, or a scene's file, as in levilab simulate driven"
        raise UsageError("SCENE", Text(text, scenes=SCENES))
    return scene


Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else on standard output.")]


def speak_from(args: Sequence[str]) -> None:
    """Speak the language of the command line or the environment, before anything is refused."""
    asked = [after for option, after in pairwise(args) if option == "--language"]
    code = [os.environ.get("LEVILAB_LANGUAGE", ENGLISH), *asked][-1]
    if code in languages():  # another one is refused where its option is read
        speak(code)


def _speak(context: typer.Context, language: str) -> str:
    """Speak a language before the other options are read, which may be refused.  Raises UsageError.

    Empty where it is left to the browser, while the terminal speaks English.
    """
    source = context.get_parameter_source("language")
    if not language and source and source.name == "DEFAULT":
        return language
    check_language(language, "LEVILAB_LANGUAGE" if source and source.name == "ENVIRONMENT" else "language")
    speak(language)
    return language


#: Not the machine's own: a script that reads messages finds the same on each.
_LANGUAGE: dict[str, Any] = {
    "metavar": "CODE", "envvar": "LEVILAB_LANGUAGE", "help": "Of what people read: en or de.", "is_eager": True,
    "callback": _speak,
}  # fmt: skip
Language = Annotated[str, typer.Option("--language", **_LANGUAGE)]
PageLanguage = Annotated[str, typer.Option("--language", show_default="the browser's; in the terminal en", **_LANGUAGE)]
#: The heading of a report: name → metavar and help.
_HEADING = {
    "title": ("TEXT", "In place of the report's own title."),
    "course": ("TEXT", "Below the title, as 'Physics lab 2'."),
    "author": ("NAMES", "Below the title."),
    "date": ("TEXT", "Below the title, as it is to stand there."),
}
HEADING = tuple(
    inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default="",
        annotation=Annotated[str, typer.Option(metavar=metavar, help=text)],
    )
    for name, (metavar, text) in _HEADING.items()
)
#: readable=False here and elsewhere: what may not be read is said by the reader, in one line, with what to do.
Paths = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="PATH",
        readable=False,
        help="Run folders, data files, or folders to search.",
        show_default="runs",
        callback=_runs_or,
    ),
]
#: Those that come with levilab, simple ones first; help is not to wait for their files.
SCENES = "undriven, friction, tilted, driven, loose-washers, motor, ramp, precession, spindown, sway, practice"
Presets = Annotated[
    str | None, typer.Argument(metavar="SCENE", help=f"{SCENES}, or a file.", show_default=False, callback=named_scene)
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the scene, as top.mass_kg=25g; repeatable."),
]
