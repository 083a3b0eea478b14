"""`levilab live`: serve the view until a signal ends it."""

import contextlib
import errno
import socket
import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from levilab.errors import LevilabError, UsageError, check_language
from levilab.files import must_be_folder
from levilab.interruption import End
from levilab.live.desk import Desk
from levilab.live.doors import Doors, doors_for_guests
from levilab.live.practice.bench import PracticeBench
from levilab.live.server import Hall, application
from levilab.live.share import address_in_network
from levilab.runs.find import RECORD, run_or_folder
from levilab.texts.text import ENGLISH, Text

#: Only programs of this machine reach it; a shared view has a second socket, for guests.
HOST = "127.0.0.1"
#: Time that open pages have to close, and a connection for its first request [s].
_GOODBYE_S, _FIRST_REQUEST_S = 1, 10.0
#: Connections that wait to be taken in, and are then taken in at once: those who connect without end are worked on
#: before a page's next frame, with uvicorn's 2048 for 19 s.
_WAITING = 64
#: Connections of guests at a time: 60 phones that look, and 15 that load the page; macOS allows a process 256 files.
_MOST_OF_GUESTS = 150


class CannotShow(LevilabError):
    """The view cannot be served."""


@dataclass(frozen=True)
class LiveOptions:
    """What to show, and where.

    Attributes:
        run: a run folder; None: the newest that is running in `out`, else the newest.
        out: the folder with the runs.
        mock: a bench for practice, which records into `out`.
        port: of the loopback address; 0: any that is free.
        seed: of the top on the bench for practice; of the first group, where groups have numbers.
        share: whether phones in the network may look, too.
        language: of pages at which none was chosen; empty: of the browser.
        files: data files to open, with the options by which they are read; None: the view is of runs.
    """

    run: Path | None = None
    out: Path = Path("runs")
    mock: bool = False
    port: int = 8765
    seed: int = 0
    share: bool = False
    language: str = ""
    files: tuple[tuple[Path, Mapping[str, Any]], ...] | None = None


class ViewServer(uvicorn.Server):
    """A server that leaves signals to the program, and says when it is to end what the end waits for.

    Args:
        config: what is served, and how.
        farewell: returns what the person at the terminal has to know then; empty where it ends at once.
        say: is called with that.
    """

    def __init__(self, config: uvicorn.Config, farewell: Callable[[], str], say: Callable[[str], None]) -> None:
        super().__init__(config)
        self._farewell, self._say = farewell, say

    def leave(self) -> None:
        """End soon; a signal's handler may call this, and more than once."""
        self.should_exit = True

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals alone: uvicorn would restore them before the bench is closed, and exit at the second Ctrl-C."""
        yield

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say why the end waits, and close everything."""
        if text := self._farewell():
            self._say(text)
        await super().shutdown(sockets)


def serve_live(
    options: LiveOptions, end: End, announce: Callable[[str, str], None], say: Callable[[str], None]
) -> None:
    """Serve until a signal asks for the end.

    The signals are taken until this has returned, so that none keeps the bench from being switched off.

    Args:
        options: what to show, and where.
        end: of `watching_for_end`, whose context outlasts this call.
        announce: is called with the address, and with that for guests, empty without any, once pages can be opened.
        say: is called with a line for the person at the terminal.

    Raises:
        UsageError: a run and a bench for practice at once; there is no such language.
        MissingThree: the extra is not installed.
        DataError: there is no such run.
        CannotWrite: the bench would record into a file.
        CannotShow: the port is taken.
        NoNetwork: the view is to be shared, and this machine is in no network.
    """
    check_language(options.language or ENGLISH)
    root, shown = _where(options)
    with contextlib.ExitStack() as at_end:
        hosts = [HOST, address_in_network()] if options.share else [HOST]
        sockets = [at_end.enter_context(contextlib.closing(_listening(host, options.port))) for host in hosts]
        ports = [opened.getsockname()[1] for opened in sockets]
        doors, guests = Doors(ports[0]), doors_for_guests(hosts[1], ports[1]) if options.share else None
        bench = at_end.enter_context(PracticeBench(root, seed=options.seed)) if options.mock else None
        hall = Hall(root, shown, doors, Desk(bench) if bench else None, guests, options.language)
        config = configuration(hall)
        at_end.callback(hall.analyses.end)
        server = ViewServer(config, lambda: farewell(bench, hall.analyses.running), say)
        end.wake = server.leave
        if end.by:  # before there was a server to wake
            return
        for path, given in options.files or ():
            hall.opened.add(path.absolute(), given)
        own = f"http://{HOST}:{doors.port}/{'' if options.files is None else 'open'}#{doors.token}"
        shared = f"http://{hosts[1]}:{guests.port}/{guests.token}/" if guests else ""
        with _announcing(server, lambda: announce(own, shared)):
            server.run(sockets=sockets)


class Connection(H11Protocol):
    """A connection that is closed where its first request does not come, or where guests have too many.

    Else a program in the network, which needs no token for that, could take all that this process may have open.
    """

    def connection_made(self, transport: Any) -> None:
        """Take a connection in, or not."""
        super().connection_made(transport)
        app: Any = self.config.app  # a Guard
        connections: set[Any] = self.connections  # WebSockets, too
        here = transport.get_extra_info("sockname")  # None of one that is closed already, on some systems
        is_of_guest = app.shared is not None and (not here or here[1] == app.shared[1].port)
        if is_of_guest and sum(one.server == here for one in connections) > _MOST_OF_GUESTS:
            transport.abort()
        else:
            self.loop.call_later(_FIRST_REQUEST_S, self._expect_request)

    def _expect_request(self) -> None:
        cycle: Any = self.cycle  # of a request and its answer
        if cycle is None and self in self.connections:  # where a WebSocket has taken its place
            self.transport.close()


def configuration(hall: Hall) -> uvicorn.Config:
    """Return how the view is served.  Raises MissingThree."""
    return uvicorn.Config(
        application(hall),
        log_config=None,
        log_level="critical",  # else a line for each request that is no HTTP, on the terminal of a measurement
        access_log=False,
        lifespan="on",
        http=Connection,
        ws="websockets-sansio",
        ws_max_size=1 << 16,
        backlog=_WAITING,
        server_header=False,
        timeout_graceful_shutdown=_GOODBYE_S,
    )


def farewell(bench: PracticeBench | None, analyzed: Collection[Path] = ()) -> str:
    """Return a message for the terminal when the view is to end; empty where it ends at once.

    Args:
        bench: the one for practice.
        analyzed: runs and data files that are being analyzed.
    """
    parts = []
    if bench and bench.may_record:
        parts.append("the run that is being recorded ends with the reading under way and is kept")
    if analyzed:
        parts.append(
            f"the analysis of {', '.join(sorted(path.name for path in analyzed))} is given up; levilab analyze makes it"
        )
    if bench:
        parts.append("the bench is switched off")
    return "; ".join(parts)


def _where(options: LiveOptions) -> tuple[Path, str]:
    """Return the folder with the runs, and the name of the run to show at first."""
    if options.run is None:
        if options.mock:
            must_be_folder(options.out)
        return options.out.absolute(), ""
    if options.mock:
        raise UsageError("mock", "a run and a bench for practice exclude each other: it records runs of its own")
    run = run_or_folder(options.run, options.out).absolute()
    if not (run / RECORD).exists():
        return run, ""  # a folder with runs
    return run.parent, run.name


def _listening(host: str, port: int) -> socket.socket:
    """Return a socket at an address of this machine.  Raises CannotShow."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows: else two servers could share a port
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((host, port))
        opened.listen(128)
    except OSError as error:
        opened.close()
        taken = error.errno in {errno.EADDRINUSE, errno.EACCES}
        why = "is in use, perhaps by another live view"
        why = why if taken else Text("cannot be listened at ({why})", why=str(error.strerror))
        advice = "port {port} {why}: close that, or choose another `port`, as 0 for any"
        raise CannotShow(advice, port=port, why=why) from error
    return opened


@contextlib.contextmanager
def _announcing(server: ViewServer, announce: Callable[[], None]) -> Iterator[None]:
    """Say the addresses once the server has started; a thread waits for that, since the server takes the main one."""
    over = threading.Event()

    def wait() -> None:
        while not server.started and not over.wait(0.02):
            pass
        if server.started and not server.should_exit:
            announce()

    waiting = threading.Thread(target=wait, daemon=True)
    waiting.start()
    try:
        yield
    finally:
        over.set()
        waiting.join()
