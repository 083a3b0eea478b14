"""Open: how a data file is understood, corrected, kept, analyzed and reported.  Heavy imports happen inside."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from levilab.cli.analyze import takes_options, write_and_print
from levilab.cli.options import Json, PageLanguage, argument, existing_paths, flag, place
from levilab.cli.output import interruptible, message, place_of_report, print_json, result
from levilab.errors import DataError, UsageError, as_typed
from levilab.pipelines.options import OF_FILES, read_options
from levilab.texts.text import Text, in_language, verbatim

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from levilab.formats.understanding import UnderstoodColumn, UnderstoodRun
    from levilab.pipelines.look import Look

#: First values of a column that the terminal shows.
_SHOWN = 3


@takes_options(OF_FILES)
def open_files(
    paths: Annotated[
        list[Path] | None,
        argument(
            "FILE", "Data files, or sheets and runs in them: FILE/SHEET.", readable=False, callback=existing_paths
        ),
    ] = None,
    keep: Annotated[bool, flag("Keep the options in FILE.levilab.toml, which every analysis reads.", "--keep")] = False,
    out: Annotated[Path | None, place("FILE", "Write the report, .html or .pdf.", (".html", ".pdf"))] = None,
    browser: Annotated[
        bool | None,
        flag(
            "Show the files in the browser, or in the terminal alone.",
            "--browser/--no-browser",
            show_default="a browser where there is one, but not with --keep, -o or --json",
        ),
    ] = None,
    language: PageLanguage = "",
    as_json: Json = False,
    **given: Any,
) -> None:
    """Show how files are understood, and what the data say; writes nothing without --keep or -o."""
    from levilab.pipelines.inputs.correction import write_correction
    from levilab.pipelines.look import look_as_kept

    files, options = paths or [], read_options(given, typed=True)
    shows = _has_browser() and not (keep or out or as_json) if browser is None else browser
    if not files and not shows:
        raise UsageError("FILE", "name a data file, as levilab open my.csv: there is no browser here to choose one")
    looks = [look_as_kept(path, options, plots=False) for path in files]
    _print_looks(looks, as_json=as_json)
    readable = [look.path for look in looks if not look.problem]
    for path in readable if keep else []:
        message(Text("kept in {path:s}", path=write_correction(path, options)))
    if shows:
        _serve([(path, options) for path in files], language)
    if not readable:
        raise _refusal(looks[0])
    if not as_json:
        _analyze(readable, options)
    if out:
        _report(readable, options, out)


def _refusal(look: "Look") -> DataError:
    if any(run.doubts for run in look.runs):
        return DataError("{path:s}: is not read before the question is answered, by `columns`", look.path)
    named = str(look.path) in look.problem
    return DataError(look.problem) if named else DataError("{path:s}: {what}", look.path, look.problem)


def _analyze(paths: "Sequence[Path]", options: "Mapping[str, Any]") -> None:
    from levilab.pipelines.suits import analyze_suiting

    with interruptible("nothing is shown"):
        results = analyze_suiting(paths, options)
    write_and_print(results, save=False, out=None, as_json=False, tables=False)
    text = "all numbers, and a figure beside the file: levilab analyze {paths:s}{same}"
    message(Text(text, paths=" ".join(map(as_typed, paths)), same=" with the same options" if options else ""))


def _report(paths: "Sequence[Path]", options: "Mapping[str, Any]", output: Path) -> None:
    from levilab.report.page import write_report

    place = place_of_report(output)
    with interruptible("no report is written"):
        write_report(paths, output, options, message)
    result(place)


def _has_browser() -> bool:
    """Return whether a person sits before this terminal, with a screen, and the page can be served."""
    from importlib.util import find_spec

    screen = sys.platform in {"win32", "darwin"} or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(screen) and sys.stdout.isatty() and bool(find_spec("nicegui"))


def _serve(files: "list[tuple[Path, Mapping[str, Any]]]", language: str) -> NoReturn:
    """Show files in the browser until Ctrl-C."""
    from levilab.cli.live import serve

    serve("Ctrl-C ends the page", opens=True, port=0, files=tuple(files), language=language)


def _print_looks(looks: "Sequence[Look]", *, as_json: bool) -> None:
    if as_json:
        print_json([look.as_dict() for look in looks])
        return
    for look in looks:
        _print_look(look)
        if look.problem and len(looks) > 1:
            message(Text("not read: {problem}", problem=look.problem))


def _print_look(look: "Look") -> None:
    """Print how a file is understood: its columns, and the questions that are left."""
    from levilab.pipelines.look import QUANTITIES
    from levilab.present.tables import table
    from levilab.present.terminal import draw, terminal

    console = terminal()
    for run in look.runs:
        name = f"{look.path.name}, {run.name}" if run.name else look.path.name
        rows = [
            (
                str(column.index + 1),
                verbatim(column.title),
                QUANTITIES.get(column.quantity or "", (column.quantity or "–",))[0],
                _unit_of(column),
                verbatim(", ".join(column.values[:_SHOWN]) + " …" * (len(column.values) > _SHOWN)),
            )
            for column in run.columns
        ]
        heads = ("column", "title", "understood as", "unit", "first values")
        if rows:
            title = Text("{name:s} ({holds})", name=name, holds=look.holds) if look.holds else verbatim(name)
            console.print(draw(table(title, heads, rows)))
        _print_doubts(look, run)


def _unit_of(column: "UnderstoodColumn") -> str:
    from levilab.formats.titles import unit_factor

    if not column.inverse:
        return Text("{unit}, differences", unit=column.unit) if column.unit == "turns" else column.unit
    turns = round((unit_factor(column.unit, "time") or column.factor) / column.factor)
    return Text("{unit} a turn" if turns == 1 else "{unit} for {turns} turns", unit=column.unit, turns=turns)


def _print_doubts(look: "Look", run: "UnderstoodRun") -> None:
    from rich.markup import escape

    from levilab.present.terminal import terminal

    console = terminal()
    for text in run.warnings if run.doubts or look.problem else ():  # else the analysis says them
        console.print(escape(in_language(Text("note: {text}", text=text))))
    for doubt in run.doubts:
        console.print(f"[yellow]{in_language('question')}:[/yellow] {escape(in_language(doubt.text))}")
        answers = [
            (choice.text, ",".join(f"{key}={to}" for key, to in choice.columns.items())) for choice in doubt.choices
        ]
        if doubt.kind == "titles":  # each column could be each of them
            keys = dict.fromkeys(key for choice in doubt.choices for key in choice.columns)
            with_unit = [(text, columns) for text, columns in answers if "[" in columns]
            answers = [*with_unit, ("by their numbers", ",".join(f"{key}={in_language('NUMBER')}" for key in keys))]
        for text, columns in answers:
            console.print(escape(f'  {in_language(text)}: levilab open {as_typed(look.path)} --columns "{columns}"'))
    if run.problem and not run.doubts and run.problem != look.problem:
        console.print(in_language(Text("not read: {problem}", problem=run.problem)), style="red", markup=False)
