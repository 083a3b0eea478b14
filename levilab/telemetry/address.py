"""Where a bench publishes: a port of this machine, and a token that only those know who may read the run folder."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
from dataclasses import dataclass
from pathlib import Path

from levilab.computer import computer
from levilab.files import parse_json

#: Both ends are on this machine, always.
LOOPBACK = "127.0.0.1"
#: The file in a run folder that says where the bench publishes; it is there while the run is recorded.
FILE = "live.json"
#: Bytes of a token.
TOKEN_BYTES = 16
#: A file that is longer is none of ours [bytes].
_LONGEST = 1000


@dataclass(frozen=True)
class Address:
    """Where a bench publishes.

    Attributes:
        port: of UDP on the loopback address.
        token: in each datagram of both ends.
    """

    port: int
    token: bytes

    @classmethod
    def at(cls, port: int) -> Address:
        """Return an address with a token of its own."""
        return cls(port, secrets.token_bytes(TOKEN_BYTES))


def write_address(folder: Path, address: Address) -> None:
    """Say in a run folder where its bench publishes; only this user can read it.  Raises OSError."""
    path = folder / FILE
    part = path.with_name(f".{FILE}.{os.getpid()}.part")
    part.unlink(missing_ok=True)
    try:
        descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump({"port": address.port, "token": address.token.hex()}, file)
        computer().move(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def read_address(folder: Path) -> Address | None:
    """Return where the bench of a run publishes; None where the run is over, or the file is none of ours."""
    try:
        with (folder / FILE).open("rb") as file:
            said = parse_json(file.read(_LONGEST).decode())
        port, token = said["port"], bytes.fromhex(said["token"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if type(port) is not int or not 0 < port <= 0xFFFF or len(token) != TOKEN_BYTES:
        return None
    return Address(port, token)


def remove_address(folder: Path, address: Address) -> None:
    """Take the file away, if it still says this address."""
    with contextlib.suppress(OSError):
        if read_address(folder) == address:
            (folder / FILE).unlink()
