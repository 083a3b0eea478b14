"""`levilab live --share`: where phones in the same room find the view, and the code that their cameras read."""

import contextlib
import io
import ipaddress
import socket

import segno

from levilab.errors import LevilabError

#: An address for examples (RFC 5737), to which nothing is sent: the system only chooses the interface towards it.
_ELSEWHERE = ("192.0.2.1", 9)


class NoNetwork(LevilabError):
    """This machine has no address that a phone could open."""


def address_in_network() -> str:
    """Return the IPv4 address of this machine in its network; sends nothing.  Raises NoNetwork."""
    found = "0.0.0.0"  # noqa: S104 - no address
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(_ELSEWHERE)
        found = probe.getsockname()[0]
    if ipaddress.ip_address(found).is_unspecified or ipaddress.ip_address(found).is_loopback:
        raise NoNetwork("this machine is in no network: join the network of the phones, or leave `share` out")
    return found


def who_may_look(address: str) -> str:
    """Return who may look at a shared view, for the person at the terminal.

    >>> who_may_look("http://192.168.1.7:8765/token/")
    'Anyone with this address in the same network may look at the runs, and can change nothing.'
    """
    host = ipaddress.ip_address(address.split("/")[2].partition(":")[0])
    where = "(anywhere: the address is public)" if host.is_global else "in the same network"
    return f"Anyone with this address {where} may look at the runs, and can change nothing."


def code_of(address: str) -> list[str]:
    """Return the QR code of an address as lines of a terminal, light on dark, two modules above each other a character.

    >>> lines = code_of("http://192.168.1.7:8765/token/")
    >>> {len(line) for line in lines} == {2 * len(lines) - 1}
    True
    """
    text = io.StringIO()
    segno.make(address, micro=False).terminal(text, compact=True)
    return text.getvalue().splitlines()
