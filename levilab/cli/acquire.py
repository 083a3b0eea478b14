"""Acquire: experiments on the bench.  Heavy imports happen inside the commands that need them."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from levilab.cli import exit_codes
from levilab.cli.importing import importing
from levilab.cli.later import Later, NamedLast
from levilab.cli.options import Json, Language, flag, option, place, quantity
from levilab.cli.output import message, print_json, result
from levilab.errors import UsageError
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from levilab.bench.config import BenchConfig
    from levilab.bench.person import Task


class AcquireGroup(NamedLast):
    """`levilab acquire --mock spin` is `levilab acquire spin --mock`."""

    typical = "limit"  # its options are those of all experiments

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the name of the experiment first.  Fails where options stand alone."""
        if args and args[0].startswith("-") and args[0] not in ctx.help_option_names:
            args = self.with_name_first(args) or ctx.fail(
                Text(
                    "name the experiment, as levilab acquire spin {options:s}: {names:s}",
                    " ".join(args), ", ".join(self.commands),
                )
            )  # fmt: skip
        return super().parse_args(ctx, args)


acquire_app = typer.Typer(cls=AcquireGroup, no_args_is_help=True, add_completion=False)


#: Experiment → help of its command.  The table of experiments takes too long to import for a help page.
EXPERIMENT_HELP = {
    "spin": "Spin-down: drive the top up, switch the drive off, count its spin until it falls.",
    "trace": "Records of the oscilloscope: raw codes into the run folder, written as they come.",
    "field": "Hall scan: the base's flux density on its axis, at one height after the other.",
    "limit": "Limits of the spin, top after top: where a free top falls, or with --upper where a driven one is lost.",
    "hold": "A held spin: a drive that the top triggers holds it for hours, and its amplitude shows the drag.",
    "sway": "Sway, with --mock: films of a free top and its spin; a real top's film is for levilab analyze video.",
    "precession": "Precession: sweep the drive, and count at each frequency how often the stem cuts a laser beam.",
}
#: Option → the setting that it stands for, as --set takes it; where that names an experiment, only this has the option.
SHORT = {"drive": "drive={}", "spin": "drive_frequency_hz={}", "upper": "limit.which=upper"}
_ENDING = "Ctrl-C ends the run after the reading under way; outputs go off and the run is kept."


def acquire_experiment(
    experiment: str,
    mock: Annotated[bool, flag("Use the virtual bench; needs no hardware.", "--mock")] = False,
    bench: Annotated[
        Path | None,
        option("FILE", "Describes the bench; with --mock only its settings count.", show_default="bench.toml"),
    ] = None,
    counter: Annotated[
        str | None,
        option("MODEL|ADDRESS", "Count with this one instead of the bench's, as phyphox or phyphox://HOST:8080."),
    ] = None,
    scope: Annotated[
        str | None, option("MODEL|ADDRESS", "Record with this oscilloscope instead of the bench's.")
    ] = None,
    out: Annotated[Path, place("DIR", "Where the run folder is made.")] = Path("runs"),
    drive: Annotated[
        str | None, option("ramp|triggered", "How the coil drives the top: triggered by its own light pulse.")
    ] = None,
    spin: Annotated[
        float | None, quantity("HZ", "Hz", "Bring the top to this spin.", show_default="the settings'")
    ] = None,
    scene: Annotated[
        str | None,
        option(
            "SCENE", "With --mock: a top in full motion, such as spindown, or a scene's file.", show_default="spin only"
        ),
    ] = None,
    seed: Annotated[int | None, option("N", "Makes a virtual run repeatable.", min=0)] = None,
    group: Annotated[
        str | None, option("NAME", "Who measures, as 'Group 7': the run's name in tables and figures.")
    ] = None,
    note: Annotated[str, option("TEXT", "Kept with the run.")] = "",
    temperature: Annotated[str | None, option("T", "Of the magnets, as 21.5 C; kept with the run.")] = None,
    washers: Annotated[str | None, option("MASSES", "On the top, as 0.06+0.1 g; kept with the run.")] = None,
    realtime: Annotated[bool, flag("Run the virtual bench in real time.", "--realtime")] = False,
    resume: Annotated[Path | None, option("RUN", "Continue an interrupted run, with its own settings.")] = None,
    wire_log: Annotated[bool, flag("Keep all bytes sent and received.", "--wire-log")] = False,
    yes: Annotated[bool, flag("Ask no questions: the bench is as the experiment needs it.", "--yes")] = False,
    upper: Annotated[bool, flag("The upper limit, of a driven top, with the cause of each loss.", "--upper")] = False,
    settings: Annotated[
        list[str] | None,
        option(
            "KEY=VALUE",
            "Change a setting of the experiment, as limit.repetitions=3 or spin.gate_s=2s; repeatable.",
            "--set",
        ),
    ] = None,
    list_settings: Annotated[
        bool, flag("List the settings that --set changes, with units and ranges, and exit.", "--settings")
    ] = False,
    language: Language = "en",  # noqa: ARG001 - its callback speaks it
    as_json: Json = False,
) -> None:
    """Carry out an experiment."""
    if not list_settings:
        named = bool(counter or scope)
        look_at_files(bench, resume, out, scene, virtual=mock, named=named, films=experiment == "sway")
    typed = {"drive": drive, "spin": spin, "upper": upper or None}
    given = (*(SHORT[name].format(value) for name, value in typed.items() if value is not None), *(settings or ()))
    with importing():
        if temperature or washers:  # wrong ones are refused before the rest is imported
            from levilab.acquisition.given import read_conditions

            read_conditions(temperature, washers)
        if given and mock and not (bench or resume):
            from levilab.acquisition.given import settings_without_bench, with_given_settings

            with_given_settings(settings_without_bench(experiment), experiment, given)
        from levilab.acquisition.loop import acquire
        from levilab.acquisition.request import AcquisitionOptions, chosen_settings, request_for
        from levilab.acquisition.table import EXPERIMENTS
        from levilab.bench.person import ask_no_person
        from levilab.interruption import watching_for_end
        from levilab.present.progress import to_stderr

    options = AcquisitionOptions(
        mock=mock,
        bench=bench,
        counter=counter,
        scope=scope,
        out=out,
        seed=seed,
        scene=scene,
        group=group,
        note=note,
        temperature=temperature,
        washers=washers,
        realtime=realtime,
        resume=resume,
        wire_log=wire_log,
        person=ask_no_person if yes else _ask,
        tell=message,
        settings=given,
    )
    if list_settings:
        _print_settings(chosen_settings(experiment, options), experiment, as_json=as_json)
        return
    request = request_for(experiment, options)
    with watching_for_end():  # `acquire` takes the signals; after it the run is kept, and one more changes nothing
        run = acquire(request, to_stderr(bench_time=bool(request.synthetic_how) and not realtime))
        readings = run.count()
        if as_json:
            print_json({"run": str(run.folder), "status": run.status, "readings": readings}, indent=None)
        else:
            called = EXPERIMENTS[experiment].called + "s" * (readings != 1)
            result(
                in_language(
                    Text("{status}: {count} {called} in {folder}", run.status, readings, called, str(run.folder))
                )
            )
        if run.status == "interrupted":
            if readings:
                command = f"levilab acquire {experiment} --resume {run.folder}"
                message(Text("go on with it: {command}", command=command))
            raise typer.Exit(exit_codes.INTERRUPTED)


def look_at_files(
    bench: Path | None,
    resume: Path | None,
    out: Path,
    scene: str | None = None,
    *,
    virtual: bool,
    named: bool,
    films: bool = False,
) -> None:
    """Refuse a bench file, a run or a scene that is not there, before what takes long is imported.

    virtual: on the virtual bench; named: whether instruments are, so that bench.toml may be missing; films: whether a
    camera is needed, which no bench has.
    """
    if bench or not (virtual or named or resume):
        from levilab.bench.config import ConfigError, read_table

        if films and not (bench or Path("bench.toml").exists()):
            from levilab.acquisition.experiments.sway import NO_CAMERA

            raise ConfigError(NO_CAMERA)
        read_table(bench or Path("bench.toml"), **({"instead": ""} if virtual else {}))
    if resume:
        from levilab.runs.find import run_to_resume

        run_to_resume(resume, out)
    if scene and virtual:
        from levilab.simulator.scene import read_scene

        read_scene(scene)


def _print_settings(config: "BenchConfig", experiment: str, *, as_json: bool) -> None:
    from levilab.acquisition.keys import keys_of, keys_table

    keys = keys_of(config, experiment)
    if as_json:
        print_json({"settings": [vars(one) for one in keys]})
        return
    from levilab.present.terminal import draw, terminal  # with rich

    terminal().print(draw(keys_table(keys, experiment)))


def _command_of(experiment: str) -> Callable[[], Callable[..., None]]:
    """Return the maker of an experiment's command, without the options that only others have."""

    def make() -> Callable[..., None]:
        @wraps(acquire_experiment)
        def command(**given: Any) -> None:
            with _named_as_typed(experiment, given):
                acquire_experiment(experiment, **given)

        shared = signature(acquire_experiment)
        _, *options = shared.parameters.values()
        own = [one for one in options if SHORT.get(one.name, "").rpartition(".")[0] in {"", experiment}]
        command.__signature__ = shared.replace(parameters=own)  # type: ignore[attr-defined]
        return command

    return make


for _name, _help in EXPERIMENT_HELP.items():
    acquire_app.command(
        _name,
        cls=Later,
        help=f"{_help}\n\n{_ENDING}",
        epilog=f"Example: levilab acquire {_name} --mock --note 'first try'",
    )(_command_of(_name))


@contextmanager
def _named_as_typed(experiment: str, given: Mapping[str, Any]) -> Iterator[None]:
    """Name the option that was typed in the error about the setting that it stands for."""
    try:
        yield
    except UsageError as error:
        refused = (error.value or "").removeprefix(f"{experiment}.")
        for name, setting in SHORT.items():
            typed = setting.format(value := given.get(name)).removeprefix(f"{experiment}.")
            if error.name == "settings" and value and refused in {typed, typed.partition("=")[0]}:
                raise UsageError(name, error.text, value=None if value is True else value) from error
        raise


def _ask(task: "Task") -> str:
    """Ask the person at the bench, on the terminal."""
    from levilab.acquisition.session import ExperimentFailed

    message(Text("{prompt}  [Enter]", prompt=task.prompt))
    answer = sys.stdin.readline()
    if not answer:
        raise ExperimentFailed(
            Text(
                "{quote}{task}{quote} cannot be answered: standard input is closed; start it at a terminal, "
                "or with --yes",
                quote=repr(task.text)[0],
                task=task.text,
            )
        )
    return answer
