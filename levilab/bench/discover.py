"""Which instruments answer: every address that PyVISA lists, and those that are named, asked who they are."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from instruments.drivers import Instrument
from instruments.errors import InstrumentError
from instruments.links.advice import one_line
from instruments.links.visa import addresses
from levilab.bench.config import InstrumentSettings
from levilab.bench.kinds import COUNTER, KINDS, transport_to

#: How long one address is waited for [s]: who is there answers within some milliseconds.
PATIENCE_S = 1.0


@dataclass(frozen=True)
class Found:
    """What is at an address.

    identity: its answer, None if there was none; kind, model: None where no driver of ours speaks to it; line: how the
    serial line was set when it answered; trouble: why there was no answer.
    """

    address: str
    identity: str | None = None
    kind: str | None = None
    model: str | None = None
    line: dict[str, Any] | None = None
    trouble: str = ""


def search(library: str, named: Sequence[str], tell: Callable[[str], None]) -> list[Found]:
    """Identify every instrument.

    named: addresses beside those that PyVISA lists; tell: called with a line of progress.  Raises NotConnected where
    there is no such library.
    """
    candidates = dict.fromkeys((*named, *addresses(library)))
    found = []
    for address in candidates:
        tell(f"asking {address}")
        found.append(identify(address, library))
    return found


def identify(address: str, library: str) -> Found:
    """Identify the instrument at an address, with each of the ways that a serial line may be set."""
    trouble = ""
    for driver, line in _lines_to_try(address):
        settings = InstrumentSettings(model="", address=address, timeout_s=PATIENCE_S)
        try:
            transport = transport_to(driver, settings, library=library)
        except InstrumentError as error:
            return Found(address, trouble=error.reason)
        except Exception as error:  # noqa: BLE001 - a port that is no port: others are still to be asked
            return Found(address, trouble=f"cannot be asked ({one_line(error)})")
        try:
            # one with a link of its own says in its own way who it is
            answer = driver(transport).identity() if scheme_of(address) else transport.query("*IDN?")
            identity = _printable(answer)
        except InstrumentError as error:
            trouble = error.reason
        else:
            kind_of_it, model_of_it = driver_for_identity(identity) or (None, None)
            return Found(address, identity, kind_of_it, model_of_it, line)
        finally:
            transport.close()
    return Found(address, trouble=trouble)


def _lines_to_try(address: str) -> Iterator[tuple[type[Instrument], dict[str, Any]]]:
    """Yield the drivers whose links are tried, and their lines: for a serial port one of each line, else any driver."""
    if scheme := scheme_of(address):
        yield next(row.driver for kind in KINDS.values() for row in kind.models if row.scheme == scheme), {}
        return
    if "::" in address and not address.upper().startswith("ASRL"):
        yield COUNTER.models[0].driver, {}
        return
    seen: list[dict[str, Any]] = []
    for kind in KINDS.values():
        for model in kind.models:
            line = dict(model.driver.SERIAL)
            if line and line not in seen:
                seen.append(line)
                yield model.driver, line


def scheme_of(address: str) -> str:
    """Return the scheme of an address, where a model of ours has it; else empty."""
    scheme = address.partition("://")[0].lower()
    known = {row.scheme for kind in KINDS.values() for row in kind.models}
    return scheme if "://" in address and scheme in known else ""


def _printable(identity: str) -> str:
    """Return text for a file, with question marks for control characters, which no instrument has in its name."""
    return "".join(sign if sign.isprintable() else "?" for sign in identity)


def driver_for_identity(identity: str) -> tuple[str, str] | None:
    """Return kind and model of our driver for an answer to ``*IDN?``; None if there is none.

    >>> driver_for_identity("Keysight Technologies,53220A,MY1,2.1")
    ('counter', '53220A')
    >>> driver_for_identity("RIGOL TECHNOLOGIES,DS1104Z,DS1Z,00.04")
    ('oscilloscope', 'DS1000Z')
    """
    fields = identity.split(",")
    field = fields[1].strip() if len(fields) > 1 else ""
    fitting = [
        (
            model.name.upper() not in field.upper() and not re.fullmatch(model.answers_as, field, re.IGNORECASE),
            kind,
            model,
        )
        for kind in KINDS.values()
        for model in kind.models
        if re.fullmatch(model.driver.MODELS, field, re.IGNORECASE)
    ]
    # of several models of one driver the one that the instrument says it is
    found = min(fitting, key=lambda row: row[0], default=None)
    return (found[1].name, found[2].name) if found else None
