"""The commands of the bench.  Heavy imports happen where they are needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from levilab.bench_serve import Served

EXIT_INTERRUPTED = 130

bench_app = typer.Typer(no_args_is_help=True, help="The instruments: what answers, and a virtual bench to practise.")


@bench_app.command("serve", epilog="Example: levilab bench serve --speed 10 --port-base 15000")
def bench_serve(
    speed: Annotated[float, typer.Option(metavar="X", help="Seconds of the bench per second on the wall.")] = 1.0,
    models: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="KIND=MODEL", help="Choose a model, as counter=CNT-91; repeatable."),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address of this machine to listen at; 0.0.0.0: all of them.")
    ] = "127.0.0.1",
    port_base: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=65535, help="The first port, the others follow.", show_default="any free"),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON when all can be reached, and nothing else.")
    ] = False,
) -> None:
    """Offer the virtual bench to other programs: TCP, HiSLIP, VXI-11, serial.  Prints the resource names to copy.

    Ctrl-C or SIGTERM ends it.  Nobody is asked for a password: at another host than 127.0.0.1 all can use it.
    """
    from levilab.bench_serve import Service, chosen_models, serve

    service = Service(host, port_base, speed, chosen_models(models or []))
    if serve(service, _tell_as_json if as_json else _tell) == "SIGINT":
        raise typer.Exit(EXIT_INTERRUPTED)


def _tell_as_json(instruments: tuple[Served, ...]) -> None:
    import json

    offers = {served.kind: {"model": served.model, "resources": served.resources} for served in instruments}
    typer.echo(json.dumps({"ready": True, "instruments": offers}))


#: What must be said beside a resource name.
_HINTS = {"socket": "a line feed ends every message", "pty": "8 data bits, no parity"}


def _tell(instruments: tuple[Served, ...]) -> None:
    width = max(len(name) for served in instruments for name in served.resources.values())
    for served in instruments:
        typer.echo(f"{served.kind} {served.model}")
        for way, name in served.resources.items():
            hint = _HINTS.get(way)
            typer.echo(f"  {way:7} {name:{width}}  ({hint})" if hint else f"  {way:7} {name}")
    typer.echo("Ctrl-C ends the bench", err=True)
