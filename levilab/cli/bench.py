"""The commands of the bench.  Heavy imports happen where they are needed."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import Json
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
        typer.Option(
            "--address", metavar="NAME", help="Search there, too: a resource name or a serial port; repeatable."
        ),
    ] = None,
    library: Annotated[
        str, typer.Option(metavar="NAME", help="PyVISA's library: @py is its own, '' a vendor's, @levilab virtual.")
    ] = "@py",
    out: Annotated[Path, typer.Option(metavar="FILE", help="The file to write.")] = Path("bench.toml"),
    force: Annotated[
        bool,
        typer.Option("--force", help="Replace the file if it is there; write one to fill in if no instrument answers."),
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
        from dataclasses import asdict

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
    bench: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Describes the bench.", show_default="bench.toml")
    ] = None,
    mock: Annotated[bool, typer.Option("--mock", help="Check the virtual bench.")] = False,
    as_json: Json = False,
) -> None:
    """Connect to each instrument of the bench, and print its identity and a reading, or what failed and what to try.

    The drive stays off.  The exit status is 3 if an instrument does not answer as it should.
    """
    from levilab.acquisition.table import Configuration, counter_settings
    from levilab.bench.check import Light, check
    from levilab.bench.config import read_bench
    from levilab.bench.wiring import described_wiring
    from levilab.world.bench import practice_world, virtual_wiring

    if mock and bench:
        raise UsageError("bench", "does not go with `mock`, the virtual bench, which no file describes")
    config = Configuration() if mock else read_bench(bench or Path("bench.toml"), Configuration)
    wiring = virtual_wiring(practice_world()) if mock else described_wiring(config)
    counting = counter_settings(config)
    checked = []
    for one in check(wiring, Light(counting.gate_s, counting.trigger_level_v)):
        checked.append(one)
        if not as_json:
            _print_checked(one)
    if as_json:
        from dataclasses import asdict

        print_json({"instruments": [asdict(one) for one in checked]}, indent=None)
    if any(one.trouble for one in checked):
        raise typer.Exit(exit_codes.INSTRUMENT)


def _print_checked(one: "Checked") -> None:
    result(f"{one.kind} at {one.address}")
    if one.model:
        result(f"  {one.maker} {one.model}, serial number {one.serial_number or '-'}, firmware {one.firmware or '-'}")
    result(f"  {'FAILED: ' + one.trouble if one.trouble else one.reading}")


@bench_app.command("serve", epilog="Example: levilab bench serve --speed 10 --port-base 15000")
def bench_serve(
    speed: Annotated[
        float, typer.Option(metavar="X", help="Seconds of the bench per second on the wall; with --scene up to 200.")
    ] = 1.0,
    models: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="KIND=MODEL", help="Choose a model, as counter=CNT-91; repeatable."),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(metavar="SCENE", help="The top in full motion: a scene's name or file.", show_default="spin only"),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address of this machine to listen at; 0.0.0.0: all of them.")
    ] = "127.0.0.1",
    port_base: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=65535, help="The first port, the others follow.", show_default="any free"),
    ] = None,
    portmapper: Annotated[
        bool,
        typer.Option(
            "--portmapper",
            help="For programs that take a host and no port: each instrument has an address of its own, 127.0.0.2 and "
            "on, with a port mapper at port 111.",
        ),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON when all can be reached, and nothing else.")
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
