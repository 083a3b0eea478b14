"""The link to an address: one of its scheme's where it has one, pyserial's where it is a port, else PyVISA's."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from instruments.clock import Clock, WallClock
from instruments.links.http import HttpTransport
from instruments.links.serial_port import SerialPort
from instruments.links.sound import SoundLink
from instruments.links.transport import MessageLink, Port, TrafficLog, Transport
from instruments.links.visa import VisaPort

#: Scheme of an address → the link to it, with the arguments of `open_link` but for `line`.
LINKS: dict[str, Callable[..., Transport]] = {
    "phyphox": partial(
        HttpTransport,
        port=8080,  # 80 on an iPhone
        advice="in phyphox open a magnetometer experiment, then menu ⋮ → Allow remote access; the address stands at "
        "the bottom of the screen; phone and computer need the same Wi-Fi",
    ),
    "sound": SoundLink,
}


def open_link(
    address: str,
    *,
    line: Mapping[str, Any] | None = None,
    library: Any = "@py",
    timeout: float = 2.0,
    clock: Clock | None = None,
    log: TrafficLog | None = None,
) -> Transport:
    """Open a link: the one of the address's scheme in LINKS, pyserial's for a port or its URL, else PyVISA's.

    Args:
        address: a port (``COM3``), a URL (``phyphox://host:8080``, ``socket://host:port``) or the name of a VISA
            resource.
        line: settings of a serial line (baud_rate, data_bits, parity, stop_bits), and the pause that the instrument
            needs between messages.
        library: PyVISA's, by its name or itself; ``"@py"`` needs nothing installed, ``""`` is the vendor's.
        timeout: of one answer [s].
        clock: for the pauses between messages; by default the wall clock.
        log: called with all bytes.

    Raises:
        NotConnected: nothing could be opened there.
        Occupied: another program has it.
        OutOfRange: a serial line cannot be set so.
    """
    if link := LINKS.get(address.partition("://")[0].lower()):
        return link(address, library=library, timeout=timeout, clock=clock, log=log)
    options = dict(line or {})
    pause = options.pop("pause", 0.0)
    port: Port
    if "::" not in address or (address.upper().startswith("ASRL") and library == "@py"):
        port = SerialPort(address, timeout=timeout, clock=clock or WallClock(), **options)
    else:
        port = VisaPort(address, library, options)
    return MessageLink(port, address, timeout=timeout, pause=pause, clock=clock, log=log)
