"""`levilab bench serve`: offer the virtual bench to other programs until a signal ends it."""

import asyncio
import contextlib
import errno
import sys
from collections.abc import Callable
from dataclasses import dataclass, field

from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.servers.clients import first_of
from instruments.virtual.servers.server import (
    BY_SCHEME,
    LOOPBACK,
    PORTS_PER_INSTRUMENT,
    Endpoints,
    ListenAt,
    serve_bench,
)
from levilab.errors import LevilabError, UsageError
from levilab.interruption import End, end_with_standard_input, watching_for_end
from levilab.simulator.scene import Scene
from levilab.world.bench import (
    PUT_BACK_AFTER_S,
    VIRTUAL_MODELS,
    practice_world,
    scene_world,
    virtual_bus,
    virtual_instruments,
    virtual_settings,
)
from levilab.world.spin_world import World

#: A top in full motion is simulated some 700 times faster than it moves; more than half of the time is left for the
#: clients.
FASTEST_MOTION = 200.0

#: Time on the wall clock between two updates of the world's motion [s].
_KEEP_UP_S = 0.2

#: The highest number of a port.
_LAST_PORT = 0xFFFF


#: Operating system → how to let a program without privileges listen at any port.
_PORTS_FOR_ALL = {
    "linux": (
        "`sudo sysctl net.ipv4.ip_unprivileged_port_start={port}` lets all use it until the next start, "
        "`sudo setcap cap_net_bind_service=+ep PYTHON` this Python"
    ),
    "darwin": "start it with sudo",
}

#: How to add a loopback address on a system that has only one.
_ADD_ADDRESS = "`sudo ifconfig lo0 alias 127.0.0.2 up`, and so on for 127.0.0.3 and 127.0.0.4"


class CannotServe(LevilabError):
    """The bench cannot be offered at this address or port."""


@dataclass(frozen=True)
class Service:
    """How to offer the bench.

    Attributes:
        host: an address of this machine.
        port_base: the first port; None: any free ports.
        speed: seconds of the bench per second.
        models: kind of instrument → model, where it is not the default.
        scene: of the top's full motion; None: the top only spins.
        port_mapper: the port of each instrument's port mapper; None: there is none.
    """

    host: str = LOOPBACK
    port_base: int | None = None
    speed: float = 1.0
    models: dict[str, str] = field(default_factory=dict)
    scene: Scene | None = None
    port_mapper: int | None = None


@dataclass(frozen=True)
class Served:
    """An instrument that can be reached.

    Attributes:
        kind: of the instrument.
        model: its name.
        resources: protocol → resource name to copy.
    """

    kind: str
    model: str
    resources: dict[str, str]


def chosen_models(words: list[str]) -> dict[str, str]:
    """Read settings such as ``counter=CNT-91``.  Returns kind → model; raises UsageError."""
    chosen = {}
    for word in words:
        kind, _, model = word.partition("=")
        if kind not in VIRTUAL_MODELS:
            raise UsageError(
                "models", f"{kind!r} is no kind of instrument, known are {', '.join(VIRTUAL_MODELS)}", value=word
            )
        known = {name.upper(): name for name in VIRTUAL_MODELS[kind]}
        if model.upper() not in known:
            raise UsageError("models", f"no such {kind}, known are {', '.join(known.values())}", value=word)
        chosen[kind] = known[model.upper()]
        scheme, _, host = virtual_settings(kind, model).address.partition("://")
        if host and scheme not in BY_SCHEME:
            why = f"other programs cannot reach a virtual {model}; `levilab acquire --mock` has one"
            raise UsageError("models", why, value=word)
    return chosen


def serve(
    service: Service, ready: Callable[[tuple[Served, ...]], None], tell: Callable[[str], None] = lambda _: None
) -> str:
    """Offer the bench until a signal ends it, or the program that started it with a pipe as standard input is gone.

    Args:
        service: how to offer it.
        ready: called once, when all instruments can be reached.
        tell: called with a message before anything that takes long.

    Returns:
        The name of the signal, or EOF.

    Raises:
        CannotServe: the address or a port is not free.
        UsageError: a value of the service makes no sense.
        SceneError: the scene has no motion.
    """
    with watching_for_end() as end:
        end_with_standard_input(end)
        world = _world(service, tell)
        if not end.by:
            asyncio.run(_serve(service, world, ready, end))
    assert end.by
    return end.by


async def _serve(service: Service, world: World, ready: Callable[[tuple[Served, ...]], None], end: End) -> None:
    bus = virtual_bus(world, service.models)
    # time begins with the first message: the top does not spin down before a program uses the bench
    assert isinstance(world.clock, WallClock)
    bus.on_message = world.clock.begin
    place = _place(service, len(bus.instruments))
    async with contextlib.AsyncExitStack() as opened:
        try:
            offers = await opened.enter_async_context(serve_bench(bus, place))
        except OSError as error:
            raise _cannot_serve(service, error) from error
        ready(tuple(_endpoints(service, offer) for offer in offers))
        await first_of(_wait_for(end), _keep_up(bus, world))


def _cannot_serve(service: Service, error: OSError) -> CannotServe:
    """Return the error for an address or port that is not free, with what to do."""
    if service.port_mapper is None:
        why = f"the bench cannot be offered at {service.host} ({error})"
        return CannotServe(f"{why}: try another `host` or `port_base`")
    port = service.port_mapper
    if isinstance(error, PermissionError):
        system = _PORTS_FOR_ALL.get(sys.platform, "run it with the rights of the system's administrator")
        what = f"this system gives port {port} to privileged programs alone: {system.format(port=port)}"
    elif error.errno == errno.EADDRINUSE:
        what = "another port mapper (rpcbind) is there, or another program has `port_base`: end it, or change that"
    elif error.errno == errno.EADDRNOTAVAIL:
        what = "each instrument needs a loopback address of its own: add them, on macOS with " + _ADD_ADDRESS
    else:
        what = "try without `portmapper`"
    return CannotServe(f"the port mapper cannot be offered ({error}): {what}")


async def _keep_up(bus: VirtualBench, world: World) -> None:
    """Let the motion follow the clock between messages, so that the next one need not wait for hours of it."""
    while True:
        await asyncio.sleep(_KEEP_UP_S)
        with bus.lock:
            world.catch_up()


def _world(service: Service, tell: Callable[[str], None]) -> World:
    clock = _clock(service)
    if service.scene is None:
        return practice_world(clock)
    if service.speed > FASTEST_MOTION:
        raise UsageError("speed", f"with `scene` up to {FASTEST_MOTION:g} is possible", value=service.speed)
    return scene_world(service.scene, lambda: _clock(service), tell, put_back_after_s=PUT_BACK_AFTER_S)


def _clock(service: Service) -> WallClock:
    try:
        return WallClock(speed=service.speed, waits=True)
    except ValueError as error:
        raise UsageError("speed", "a number above 0 is expected", value=service.speed) from error


def _place(service: Service, instruments: int) -> ListenAt:
    if ":" in service.host:  # a resource name is cut at its colons
        raise UsageError("host", "IPv6 has no place in VISA resource names, give an IPv4 address", value=service.host)
    if service.port_mapper is not None and service.host != LOOPBACK:
        why = "does not go with `portmapper`, which gives each instrument a loopback address of its own"
        raise UsageError("host", why, value=service.host)
    try:
        service.host.encode("idna")
    except UnicodeError:
        raise UsageError("host", "no host can have this name", value=service.host) from None
    last = (service.port_base or 0) + PORTS_PER_INSTRUMENT * instruments - 1
    if last > _LAST_PORT:
        raise UsageError("port_base", f"the ports end at {_LAST_PORT}, {last} would be needed", value=service.port_base)
    return ListenAt(service.host, service.port_base, service.port_mapper)


def _endpoints(service: Service, offer: Endpoints) -> Served:
    instruments = virtual_instruments(service.models).items()
    kind, model = next((kind, one.model) for kind, one in instruments if one.address == offer.address)
    return Served(kind, model, offer.resources)


async def _wait_for(end: End) -> None:
    event, loop = asyncio.Event(), asyncio.get_running_loop()
    end.wake = lambda: loop.call_soon_threadsafe(event.set)
    if end.by is None:
        await event.wait()
    end.wake = None
