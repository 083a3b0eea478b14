"""Who may come in: pages that this server sent, opened at the loopback address, and guests where the view is shared.

A page of another origin that a browser has open could otherwise read a run (DNS rebinding: its name is made to point to
127.0.0.1) or give commands to the bench for practice.  So the head of each request must name this server as its host,
a socket must be opened by a page of this server, and a command must carry the token that stands in the address which
the terminal shows.

A guest comes by another socket, at the machine's address in its network, to an application that knows no command; each
of its requests carries a token as the first part of its path.
"""

import hmac
import secrets
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

#: Names of this machine for itself.
HERE = ("127.0.0.1", "localhost")
#: What a page may load, by the name of the page.  Nothing in it is inline, and nothing comes from elsewhere.
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; font-src 'none'; "
    "connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: A report has its style and script inside; as a page of no origin it can ask this server for nothing.
REPORT_POLICY = (
    "sandbox allow-scripts allow-popups; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data:; font-src data:; base-uri 'none'; form-action 'none'"
)
_ALWAYS = {
    "cache-control": "no-store",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
}


@dataclass(frozen=True)
class Doors:
    """Where this server is, and the token of its commands, or of its guests.

    Attributes:
        port: at these addresses.
        token: of commands; of a view for guests, the first part of each path.
        names: of this machine; the first is the address of the socket.
    """

    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(18))
    names: tuple[str, ...] = HERE

    @property
    def hosts(self) -> frozenset[str]:
        """What the head of a request may name as its host."""
        named = {f"{host}:{self.port}" for host in self.names}
        return frozenset(named | {*self.names} if self.port == 80 else named)

    def lets_in(self, headers: Iterable[tuple[bytes, bytes]], *, is_socket: bool) -> bool:
        """Return whether a request comes from where it should.  A program that is no browser sends no origin."""
        found = [(name.lower(), value.decode("latin-1").lower()) for name, value in headers]
        hosts, origins = ([value for name, value in found if name == wanted] for wanted in (b"host", b"origin"))
        if len(hosts) != 1 or hosts[0] not in self.hosts:  # of two hosts, another program may have believed the other
            return False
        return not is_socket or {*origins} <= {f"http://{host}" for host in self.hosts}

    def knows(self, token: object) -> bool:
        """Return whether a command carries the token."""
        return isinstance(token, str) and hmac.compare_digest(token.encode(), self.token.encode())

    def headers(self, policy: str = PAGE_POLICY) -> dict[str, str]:
        """Return what goes with each answer."""
        sockets = " ".join(f"ws://{host}" for host in sorted(self.hosts))
        return _ALWAYS | {"content-security-policy": policy.replace("{sockets}", sockets)}


def doors_for_guests(address: str, port: int) -> Doors:
    """Return the doors of a shared view: 12 characters of a token, which a code on a terminal can hold."""
    return Doors(port, secrets.token_urlsafe(9), (address,))


class Guard:
    """ASGI: turns away what may not come in, before anything else sees it.

    Args:
        app: of the person at this machine.
        doors: its doors.
        shared: the application for guests and its doors, where the view is shared.
    """

    def __init__(self, app: Any, doors: Doors, shared: tuple[Any, Doors] | None = None) -> None:
        self.app, self.doors, self.shared = app, doors, shared

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on, or turn it away."""
        kind, app, doors = scope["type"], self.app, self.doors
        if kind not in {"http", "websocket"}:
            await app(scope, receive, send)
            return
        is_in = True
        if self.shared and (*scope["server"],) == (self.shared[1].names[0], self.shared[1].port):
            app, doors = self.shared
            given, _, path = scope["path"].removeprefix("/").partition("/")
            is_in, scope = doors.knows(given), {**scope, "path": f"/{path}"}
        if is_in and doors.lets_in(scope["headers"], is_socket=kind == "websocket"):
            await app(scope, receive, send)
        elif kind == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            await send({"type": "http.response.start", "status": 421, "headers": [(b"content-type", b"text/plain")]})
            await send({"type": "http.response.body", "body": b"open the address that levilab live has printed\n"})
