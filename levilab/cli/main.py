"""The application, the help of its commands, and its console script.  What a command needs is imported by its call."""

import codecs
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Annotated, Any, NamedTuple, NoReturn

import typer
import typer.core

from levilab.cli import exit_codes
from levilab.cli.importing import importing
from levilab.cli.later import Later
from levilab.cli.options import speak_from
from levilab.cli.output import message, silence
from levilab.cli.quantities import APPLICATION, command_of, in_options
from levilab.errors import as_typed
from levilab.present.characters import SPELLED_OUT
from levilab.texts.text import Sentences, Text, in_language


class Commands(typer.core.TyperGroup):
    """All commands.  A wrong value of an option is refused with its fault; Ctrl-C ends them in one line."""

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the options before the command, which imports pydantic."""
        if args[:1] == ["help"]:
            args = [*args[1:], "--help"]
        elif args in (["version"], ["-v"], ["-V"]):
            args = ["--version"]
        speak_from(args)
        with importing(), _explaining():
            return super().make_context(info_name, args, parent, **extra)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that was named.  Fails where a file or a folder stands in its place."""
        if args and args[0] not in self.commands:
            name, *rest = args
            if os.path.exists(name):  # noqa: PTH110 - without pathlib's import
                text = "{name:s} is a file or a folder, and no command: take levilab analyze {path:s}"
                ctx.fail(Text(text, name=name, path=as_typed(name)))
            if meant := _MEANT.get(name.casefold()) or _of_another_command(name.casefold()):
                text = "No such command '{name:s}': take levilab {words:s}"
                ctx.fail(Text(text, name=name, words=" ".join([meant, *rest])))
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Carry out what was called."""
        try:
            with _explaining():
                return super().invoke(ctx)
        except KeyboardInterrupt:  # what can be lost is said by the command itself
            message("levilab: interrupted")
            raise typer.Exit(exit_codes.INTERRUPTED) from None


#: What other programs call a command → ours.
_MEANT = {
    **dict.fromkeys(("fit", "plot", "analyse", "evaluate", "auswerten"), "analyze"),
    **dict.fromkeys(("load", "read", "import", "show"), "open"),
    **dict.fromkeys(("convert", "save"), "export"),
    **dict.fromkeys(("measure", "record", "run", "messen"), "acquire"),
    **dict.fromkeys(("gui", "demo", "app", "start"), "live --mock"),
}

#: Options of other programs for the format of a file.
_OF_FORMATS = ("--format", "--pdf", "--html", "--xlsx")


#: Wrong words on the command line; typer has no public name for them.
_WRONG_WORDS: Any = typer.BadParameter.__base__
#: The sentences that typer has for them, the longer ones first: it keeps no values beside.
_TEMPLATES = (
    "No such command '{name:s}'. Did you mean {near:s}?",
    "No such command '{name:s}'.",
    "No such option: {name:s} (Possible options: {near:s})",
    "No such option: {name:s}",
    "Invalid value for {name:s}: {value:s} is not one of {choices:s}.",
    "Invalid value for {name:s}: {what}",
    "Option {name:s} requires an argument.",
    "Missing argument {name:s}.",
    "Got unexpected extra argument(s) ({name:s})",
)


@contextmanager
def _explaining() -> Iterator[None]:
    """Say what is wrong with the words on the command line, and typer's words about it, in the person's language."""
    try:
        yield
    except _WRONG_WORDS as error:
        from typer import rich_utils

        if isinstance(error, typer.BadParameter):
            from levilab.settings import own_words  # with pydantic

            errors: Any = getattr(error.__context__, "errors", list)() or [{}]
            error.message = explain_bad_value(error.message, errors[0].get("input"), own_words(errors[0]))
        rich_utils.RICH_HELP = in_language("Try [blue]'{command_path} {help_option}'[/] for help.")
        rich_utils.ERRORS_PANEL_TITLE = in_language("Error")
        if error.ctx:
            usage = error.ctx.get_usage().replace("Usage", in_language("Usage"), 1)
            error.ctx.get_usage = lambda: usage
        if isinstance(said := _as_text(error.format_message(), error.message), Text):
            raise _WRONG_WORDS(in_language(said), error.ctx) from None
        raise


def _as_text(message: str, what: str = "") -> str:
    """Return a sentence of typer's as a Text, which has other languages; as it is where no template is its.

    what: the fault that it names, in our words.
    """
    if isinstance(message, Text):
        return message
    if (option := message.removeprefix("No such option: ").partition(" ")[0]) in _OF_FORMATS:
        return Text("No such option: {name:s}. The ending of a file's name chooses the format: -o report.pdf", option)
    for template in _TEMPLATES:
        pattern = re.sub(r"\\\{(\w+)(?::s)?\\\}", r"(?P<\1>.+?)", re.escape(template))
        if found := re.fullmatch(pattern, message, re.DOTALL):
            return Text(template, **found.groupdict() | ({"what": what} if "{what}" in template else {}))
    return message


def _of_another_command(name: str) -> str:
    """Return the command below which a name stands; empty: it is none."""
    from levilab.cli.acquire import EXPERIMENT_HELP
    from levilab.pipelines.options import KINDS

    return f"analyze {name}" if name in KINDS else f"acquire {name}" if name in EXPERIMENT_HELP else ""


def explain_bad_value(text: str, seen: object = None, own: str = "") -> str:
    """Return typer's message about a wrong value, with the value and its fault.

    >>> explain_bad_value("Input should be a valid number, unable to parse string as a number", "0,03")
    "'0,03': a number is expected; write a decimal point, not a comma"
    >>> explain_bad_value("Input should be greater than or equal to 10")
    'a number greater than or equal to 10 is expected'
    >>> explain_bad_value("Value error, '5kg': a number in s, ms or h is expected", "5kg")
    "'5kg': a number in s, ms or h is expected"
    >>> explain_bad_value("Value error, 'off' is not one of 'auto', 'none', 'fitted'.")
    "'off' is not one of 'auto', 'none', 'fitted'. Did you mean none?"
    """
    from levilab.settings import explain_message, hint_about  # with pydantic

    said = own or explain_message(text)
    if re.match(r"'(?:off|no|false|0)' is not one of .*'none'", said):
        return f"{said} Did you mean none?"
    if not said.endswith(" is expected") or said.startswith(repr(seen)):
        return said
    hint = hint_about(seen, ", which --help names")
    return Sentences("" if seen is None else Text("'{seen:s}': ", seen=str(seen)), said, hint, between="")


def _word(parameter: typer.core.TyperArgument | typer.core.TyperOption, ctx: Any) -> str:  # noqa: ARG001
    """Return the word of an option's value, in the place of a type of Python; an argument is its own word."""
    return parameter.metavar or "" if isinstance(parameter, typer.core.TyperOption) else ""


def _range(low: float | None, high: float | None) -> str | None:
    """Return the range of an option's number as text."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    return f"{low:g} or more" if low is not None else None if high is None else f"{high:g} or less"


typer.core.describe_number_range = _range  # type: ignore[assignment, attr-defined]
typer.core.TyperOption.display_type_rich = _word  # type: ignore[assignment]
typer.core.TyperArgument.display_type_rich = _word  # type: ignore[assignment]

app = typer.Typer(
    name="levilab",
    cls=Commands,
    help="The lab application for experiments on the Levitron: acquire, analyze, report.",
    epilog="Try: levilab live --mock, or in the terminal levilab acquire spin --mock",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
APPLICATION.append(app)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"levilab {version('levilab')}")
        raise typer.Exit


@app.callback()
def levilab(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Acquire, analyze and report experiments on the Levitron."""


class Row(NamedTuple):
    """A command: the module of levilab.cli and the function or application in it, its help, and an example."""

    made_of: str
    help: str
    example: str = ""
    is_hidden: bool = False


#: The commands by their names, in the groups of the help; what each is made of is imported by its call.
COMMANDS = {
    "Measure": {
        "live": Row(
            "live.live",
            r"""Show the bench in a web browser: a run as it grows, a finished one, or with --mock a bench to play with.

            A view only, in a process of its own: a run goes on when it is closed, and it can be opened again at any
            time. No program of another machine reaches it.  Needs the extra live: pip install ".\[live]" in the
            clone.""",
            "levilab live --mock",
        ),
        "acquire": Row("acquire.acquire_app", "Run an experiment on the bench and write a run folder."),
        "bench": Row("bench.bench_app", "Check the instruments, or serve a virtual bench to practise."),
        "tune": Row(
            "tune.tune",
            """Say which washers to put on today: by your trials, the temperature, and a Hall scan if there is one.

            Asks what it needs to know, and keeps it in tune.toml: with each trial it knows your top better.""",
            'levilab tune --temperature 21.5 --top 24.9 --washers "0.06,0.06,0.1,0.2" --trial "0.1 g, 20.5 C, rises"',
        ),
        "top": Row(
            "report.top",
            "Calculate mass and moments of inertia of a top from its parts, taken as cylinders, with uncertainties.",
            "levilab top sample_data/device.toml",
        ),
    },
    "Analyze": {
        "open": Row(
            "open.open_files",
            """Open data files: which columns hold what, in which units; correct that, keep it, analyze and report.

            Shows the files in the browser, where a click corrects them, or in the terminal with the option for each
            answer. What is understood is analyzed, and nothing is written without --keep and -o: -o is the report, and
            levilab analyze writes result and figure beside the file.""",
            r'levilab open my.csv --columns "t=1,f=3 \[rpm]" --keep -o my.html',
        ),
        "analyze": Row(
            "analyze.analyze_app",
            "Analyze runs or data files.  Without a COMMAND: each analysis that suits, as levilab analyze runs/.",
        ),
        "runs": Row("report.runs", "List runs: when, what, status, length.", "levilab runs runs/"),
        "report": Row(
            "report.report",
            """Report runs and simulations in one file, HTML or PDF: what was measured, how, figures, numbers, warnings.

            A PATH is a run folder, a data file, a folder to search, a simulated motion, a sweep's NAME.zarr, or the
            output of levilab stability --json; all of them go together.

            The numbers are those that levilab analyze wrote beside the runs, of every analysis; where it wrote them
            elsewhere (--out), give that folder or result.json.  What has no result, or one of other readings or options
            than the given, is analyzed for the page.""",
            "levilab report sample_data/ -o report.html, or -o report.pdf --tables",
        ),
        "export": Row(
            "export.export_data",
            r"""Write a run, file or sweep for other programs: readings, traces in volts and seconds, results with u.

            The ending of the name chooses: .nc is netCDF with the CF conventions, .h5 the same as HDF5 (needs
            levilab\[hdf5]), .csv a table and one more for each trace and the result, .xlsx a sheet for each, .zip a
            data package.  The result
            is the one that levilab analyze wrote; what has none is analyzed.""",
            "levilab export sample_data/spin-down-1 -o spin-down.nc, or -o spin-down.zip --licence CC-BY-4.0",
        ),
    },
    "Teach a class": {
        "worksheet": Row(
            "groups.worksheet",
            """Write worksheets for students and keys for their teacher, in English or German.

            Each group has a seed, and by it a top of its own; the numbers of the key come from the virtual bench.""",
            "levilab worksheet spin --language de --groups 20",
        ),
        "class": Row(
            "groups.of_class",
            """Put the groups of a class beside each other: values with u, residuals, warnings, distance from the class.

            A run has its group by levilab acquire --group, a file by its folder, as Anna/spin.csv.  On a virtual bench
            each group's seed made a top of its own: its distance from that truth is shown, too.""",
            "levilab class runs/ -o class.html, or -o class.pdf, or -o class.xlsx",
        ),
    },
    "Simulate": {
        "simulate": Row(
            "simulate.simulate",
            """Simulate the motion: does the top stay up, where and how fast does it turn, which frequencies are in it.

            The first run for a kind of scene compiles for about 2 s of processor time.  Ctrl-C ends it, and nothing is
            written then.""",
            "levilab simulate driven --duration 60 --set drive.frequency_hz=30.1 --out runs",
        ),
        "stability": Row(
            "simulate.stability",
            "Find where the top floats: heights, masses and spins, from the field and the theory of small motions.",
            "levilab stability undriven --set top.mass_kg=0.0255",
        ),
        "sweep": Row(
            "sweep.sweep",
            """Map a scene over its parameters: does the top survive, and how long, at each of thousands of points.

            Results go chunk by chunk into a store of Zarr.  Ctrl-C costs only the chunks under way, and --resume goes
            on. The store's name instead of a scene shows its summary and draws its figure again, without
            simulating.""",
            "levilab sweep undriven --sweep start.spin_hz=18:40:23 --sweep top.mass_kg=0.0250:0.0255:11 "
            "--duration 5 --out map.zarr",
        ),
    },
    "Check levilab": {
        "crosscheck": Row(
            "checks.crosscheck",
            """Check the analyses: simulate, acquire by the real drivers, analyze, compare with the truth, many times.

            A pull is (estimate − truth)/u.  Where estimates and uncertainties are right, pulls have the mean 0 and the
            standard deviation 1, and 68 % of the truths lie within u.  Ends with 1 where they do not.""",
            "levilab crosscheck spindown --trials 100",
        ),
        "reproduce": Row(
            "checks.reproduce",
            """Compute tables and figures of the Levitron thesis and of two papers again: published value beside ours.

            Prints published, ours and agreement, and writes all with figures as a report.  A minute on two cores.  Ends
            with 1 where a value neither agrees nor differs for the reason that is shown.""",
            'levilab reproduce --only "limits,errata" -o reproduce.html',
        ),
        "benchmark": Row("simulate.benchmark_app", "Compare speed and error with other programs."),
        "fuzz": Row(
            "fuzz.fuzz",
            """Carry out simulated laboratories, one a seed: acquire, kill, resume, analyze, and judge what is left.

            For people who work on levilab.  Where something is wrong it prints the shortest story that still fails, and
            ends with 1.""",
            "levilab fuzz --number 1000",
            is_hidden=True,
        ),
    },
}


def _add(name: str, row: Row, group: str) -> None:
    module, _, made = row.made_of.partition(".")
    epilog = f"Example: {row.example}" if row.example else None

    @app.command(name, cls=Later, help=row.help, epilog=epilog, hidden=row.is_hidden, rich_help_panel=group)
    def command() -> Any:
        return getattr(import_module(f"levilab.cli.{module}"), made)


for _group, _rows in COMMANDS.items():
    for _name, _row in _rows.items():
        _add(_name, _row, _group)


def main() -> None:
    """Run the console script: known failures become one line and an exit status, all others keep their traceback."""
    _prepare_output()
    # before numpy is loaded: matrices of a few hundred rows gain nothing by threads, which wait for each other busily
    # where another program has a core (docs/speed.md)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        command_of(app)()
    except BrokenPipeError:  # the reader closed the pipe
        for stream in (sys.stdout, sys.stderr):
            silence(stream)
        sys.exit(exit_codes.FAILED)
    except Exception as error:  # noqa: BLE001 - sorted by kind below
        _exit_with(error)


def _exit_with(error: Exception) -> NoReturn:
    try:
        status, text = exit_codes.exit_status(error), in_options(error)
        if isinstance(error, PermissionError) and error.filename:
            closed = "{path:s}: may not be opened by you; change its permissions or choose another place"
            text = in_language(Text(closed, error.filename))
    except OSError:  # no file can be opened any more, not even that of a module
        status, text = exit_codes.FAILED, str(error)
    if status is None:
        raise error
    message("levilab: " + " ".join(text.split()))
    sys.exit(status)


def _prepare_output() -> None:
    """Let Windows consoles and pipes with code pages without ν and ⁻³ spell these out.

    A stream that is closed from the start, as by ``>&-``, is None in Python: what goes there is thrown away.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115 - until the end
        reconfigure = getattr(getattr(sys, name), "reconfigure", None)
        if reconfigure and codecs.lookup(getattr(sys, name).encoding or "utf-8").name != "utf-8":
            reconfigure(errors=SPELLED_OUT)
        elif reconfigure:  # what UTF-8 has no place for, as in the name of a file
            reconfigure(errors="replace")
