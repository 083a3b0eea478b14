"""The commands of the bench.  Heavy imports happen where they are needed."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.acquire import look_at_files
from levilab.cli.options import Json, flag, option, place, quantity
from levilab.cli.output import message, print_json, result
from levilab.errors import NoInstrument, UsageError

if TYPE_CHECKING:
    from levilab.bench.check import Checked
    from levilab.bench.discover import Found
    from levilab.world.serve import Served

bench_app = typer.Typer(no_args_is_help=True, add_completion=False)


@bench_app.command("init", epilog="Example: levilab bench init --address TCPIP0::192.168.1.20::5025::SOCKET")
def bench_init(
    addresses: Annotated[
        list[str] | None,
        option("NAME", "Search there, too: a resource name or a serial port; repeatable.", "--address"),
    ] = None,
    library: Annotated[
        str, option("NAME", "PyVISA's library: @py is its own, '' a vendor's, @levilab virtual.")
    ] = "@py",
    out: Annotated[Path, place("FILE", "The file to write.", (".toml",))] = Path("bench.toml"),
    force: Annotated[
        bool, flag("Replace the file if it is there; write one to fill in if no instrument answers.", "--force")
    ] = False,
    as_json: Json = False,
) -> None:
    """Ask all instruments on the buses for their identity; write a commented bench.toml of those with a driver.

    It sends *IDN? and nothing else.  PyVISA finds instruments on the network if psutil and zeroconf are installed (pip
    install psutil zeroconf); else name them with --address.
    """
    from levilab.acquisition.table import tables_to_write
    from levilab.bench.discover import search
    from levilab.bench.template import bench_text, refuse_to_overwrite, write_bench

    if not force:
        refuse_to_overwrite(out)
    found = search(library, addresses or [], message)
    if as_json:
        print_json({"found": [asdict(one) for one in found], "file": str(out)}, indent=None)
    else:
        _print_found(found)
    if not any(one.kind for one in found) and not force:
        raise NoInstrument(
            "no instrument with a driver in levilab answered, so no file was written: is it on and connected?  "
            "Name it with `addresses`, or take `force` for a file to fill in by hand"
        )
    write_bench(out, bench_text(found, library, tables_to_write()))
    message(f"wrote {out}: look it over, then try it with `levilab bench check`")


def _print_found(found: "list[Found]") -> None:
    for one in found:
        if one.identity:
            what = f"{one.kind} {one.model}" if one.kind else "levilab has no driver for it"
            result(f"{one.address}\n  {one.identity}: {what}")
        else:
            result(f"{one.address}\n  {one.trouble}")


@bench_app.command("check", epilog="Example: levilab bench check --bench lab2.toml")
def bench_check(
    bench: Annotated[Path | None, option("FILE", "Describes the bench.", show_default="bench.toml")] = None,
    counter: Annotated[str | None, option("MODEL|ADDRESS", "Check this one, too.")] = None,
    scope: Annotated[
        str | None, option("MODEL|ADDRESS", "Check this one, too; `sound` lists the inputs of the computer.")
    ] = None,
    mock: Annotated[bool, flag("Check the virtual bench.", "--mock")] = False,
    as_json: Json = False,
) -> None:
    """Connect to each instrument of the bench, and print its identity and a reading, or what failed and what to try.

    The drive stays off.  The exit status is 3 if an instrument does not answer as it should.
    """
    if mock and bench:
        raise UsageError("bench", "does not go with `mock`, the virtual bench, which no file describes")
    look_at_files(bench, None, Path(), virtual=mock, named=bool(counter or scope))

    from levilab.acquisition.request import AcquisitionOptions, chosen_bench, named_instruments
    from levilab.acquisition.table import counter_settings
    from levilab.bench.check import Light, check
    from levilab.bench.wiring import described_wiring
    from levilab.world.bench import practice_world, virtual_wiring

    options = AcquisitionOptions(mock=mock, bench=bench, counter=counter, scope=scope)
    config = chosen_bench(options)
    wiring = virtual_wiring(practice_world(), models=named_instruments(options)) if mock else described_wiring(config)
    counting = counter_settings(config)
    checked = []
    for one in check(wiring, Light(counting.gate_s, counting.trigger_level_v)):
        checked.append(one)
        if not as_json:
            _print_checked(one)
    if as_json:
        print_json({"instruments": [asdict(one) for one in checked]}, indent=None)
    if any(one.trouble for one in checked):
        raise typer.Exit(exit_codes.INSTRUMENT)


def _print_checked(one: "Checked") -> None:
    result(f"{one.kind} at {one.address}")
    if one.identity:
        result(f"  {one.identity}")
    result(f"  {'FAILED: ' + one.trouble if one.trouble else one.reading}")


@bench_app.command("clock", epilog="Example: levilab bench clock --tone 1000 --u 0.001")
def bench_clock(
    scope: Annotated[str, option("MODEL|ADDRESS", "The sound card.")] = "sound",
    tone: Annotated[
        float | None,
        quantity("HZ", "Hz", "Compare with a tone of this frequency at channel 1.", low=20.0, high=20_000.0),
    ] = None,
    u: Annotated[float | None, quantity("HZ", "Hz", "Standard uncertainty of the tone.", low=0.0)] = None,
    duration: Annotated[
        float | None, quantity("S", "s", "How long.", low=1.0, high=86_400.0, show_default="600, a tone 20, --mock 60")
    ] = None,
    clock_u: Annotated[
        float | None,
        quantity(
            "U",
            "",
            "Relative standard uncertainty of the computer's clock: 1e-6 for one that the network sets.",
            low=0.0,
            show_default="1e-5",
        ),
    ] = None,
    bench: Annotated[Path | None, option("FILE", "Keep the result there.", show_default="bench.toml")] = None,
    mock: Annotated[bool, flag("Use the virtual bench; nothing is kept.", "--mock")] = False,
    save: Annotated[bool, flag("Keep the result in the bench file.", "--save/--no-save")] = True,
    as_json: Json = False,
) -> None:
    """Measure how far a sound card's clock is off, by a known tone or else by the computer's clock over a while.

    The result is kept in the bench file: from then on the times of records are corrected by it, and its uncertainty
    stands in the budgets of analyses.
    """
    from levilab.acquisition.request import AcquisitionOptions, chosen_bench
    from levilab.bench.clock import COMPUTER_U, Comparison, keep_clock, measure_clock
    from levilab.bench.wiring import described_wiring
    from levilab.present.progress import ShareBar
    from levilab.world.bench import practice_world, virtual_wiring

    if (tone is None) != (u is None):
        raise UsageError("u", "goes with `tone`, and a tone with its standard uncertainty")
    if tone is not None and clock_u is not None:
        raise UsageError("clock_u", "is that of the computer's clock, which a tone replaces")
    config = chosen_bench(AcquisitionOptions(mock=mock, bench=bench, scope=scope))
    wiring = virtual_wiring(practice_world(), models={"oscilloscope": scope}) if mock else described_wiring(config)
    usual_s = 20.0 if tone is not None else 60.0 if mock else 600.0  # a virtual second takes a fifth of a real one
    how = Comparison(tone, u, duration or usual_s, COMPUTER_U if clock_u is None else clock_u)
    message(f"listening for {how.duration_s:g} s" + " of the virtual bench" * mock)
    progress = ShareBar("listening", line_every=10.0)
    try:
        found = measure_clock(wiring, how, progress)
    finally:
        progress.close()
    settings = wiring.describe("oscilloscope")
    if as_json:
        print_json({"address": settings.address, "clock_error": found.value, "clock_u": found.u, "rate_hz": found.rate})
    else:
        result(found.text)
    if save and not mock:
        file = bench or Path("bench.toml")
        keep_clock(file, settings, found)
        message(f"wrote clock_error and clock_u into {file}")


@bench_app.command("serve", epilog="Example: levilab bench serve --speed 10 --port-base 15000")
def bench_serve(
    speed: Annotated[
        float, quantity("X", "", "Seconds of the bench per second on the wall; with --scene up to 200.")
    ] = 1.0,
    models: Annotated[
        list[str] | None, option("KIND=MODEL", "Choose a model, as counter=CNT-91; repeatable.", "--model")
    ] = None,
    scene: Annotated[
        str | None, option("SCENE", "The top in full motion: a scene's name or file.", show_default="spin only")
    ] = None,
    host: Annotated[
        str, option("ADDRESS", "Address of this machine to listen at; 0.0.0.0: all of them.")
    ] = "127.0.0.1",
    port_base: Annotated[
        int | None, option("N", "The first port, the others follow.", min=1, max=65535, show_default="any free")
    ] = None,
    portmapper: Annotated[
        bool,
        flag(
            "For programs that take a host and no port: each instrument has an address of its own, 127.0.0.2 and "
            "on, with a port mapper at port 111.",
            "--portmapper",
        ),
    ] = False,
    as_json: Annotated[
        bool, flag("Print one line of JSON when all can be reached, and nothing else.", "--json")
    ] = False,
) -> None:
    """Offer the virtual bench to other programs: TCP, HiSLIP, VXI-11, serial.  Prints the resource names to copy.

    Ctrl-C or SIGTERM ends it, and the end of a pipe that is its standard input.  There is no password: at another host
    than 127.0.0.1 any program can use it.
    """
    from instruments.virtual.servers.port_mapper import PORT
    from levilab.world.serve import Service, chosen_models, serve

    moving = None
    if scene is not None:
        from levilab.simulator.scene import read_scene

        moving = read_scene(scene)
    mapper = PORT if portmapper else None
    service = Service(host, port_base, speed, chosen_models(models or []), moving, mapper)
    ended_by = serve(service, _print_as_json if as_json else _print_served, message)
    if ended_by == "SIGINT":
        raise typer.Exit(exit_codes.INTERRUPTED)


def _print_as_json(instruments: "tuple[Served, ...]") -> None:
    offers = {served.kind: {"model": served.model, "resources": served.resources} for served in instruments}
    print_json({"ready": True, "instruments": offers}, indent=None)


#: What to print beside a resource name.
_HINTS = {"socket": "a line feed ends every message", "pty": "8 data bits, no parity"}


def _print_served(instruments: "tuple[Served, ...]") -> None:
    width = max(len(name) for served in instruments for name in served.resources.values())
    for served in instruments:
        result(f"{served.kind} {served.model}")
        for way, name in served.resources.items():
            hint = _HINTS.get(way)
            result(f"  {way:7} {name:{width}}  ({hint})" if hint else f"  {way:7} {name}")
    message("Ctrl-C ends the bench")
