"""Which instruments answer: every address that PyVISA lists, and those that are named, asked who they are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from instruments.errors import InstrumentError
from instruments.links.advice import one_line
from levilab.bench.config import InstrumentSettings
from levilab.bench.kinds import DRIVERS, driver_of, transport_to
from levilab.errors import LevilabError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

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


def listed(library: str) -> tuple[str, ...]:
    """The addresses that a PyVISA library finds by itself.  Raises NotConnected."""
    from instruments.links.visa import addresses

    return addresses(library)


def search(library: str, named: Sequence[str], tell: Callable[[str], None]) -> list[Found]:
    """Ask everybody.  named: addresses beside those that are listed; tell: is told who is being asked.

    Raises NotConnected where there is no such library.
    """
    everybody = dict.fromkeys((*named, *listed(library)))
    found = []
    for address in everybody:
        tell(f"asking {address}")
        found.append(asked(address, library))
    return found


def asked(address: str, library: str) -> Found:
    """Who is at an address, with each of the ways that a serial line may be set."""
    trouble = ""
    for kind, model, line in _ways(address):
        settings = InstrumentSettings(model=model, address=address, timeout_s=PATIENCE_S)
        try:
            transport = transport_to(kind, settings, library=library)
        except InstrumentError as error:
            return Found(address, trouble=str(error))
        except Exception as error:  # noqa: BLE001 - a port that is no port: others are still to be asked
            return Found(address, trouble=f"{address}: cannot be asked ({one_line(error)})")
        try:
            identity = _printable(transport.query("*IDN?"))
        except InstrumentError as error:
            trouble = str(error)
        else:
            kind_of_it, model_of_it = recognised(identity) or (None, None)
            return Found(address, identity, kind_of_it, model_of_it, line)
        finally:
            transport.close()
    return Found(address, trouble=trouble)


def _ways(address: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Kind, model and line to ask with: for a serial port every line that a driver knows, else any."""
    if "::" in address and not address.upper().startswith("ASRL"):
        yield "counter", next(iter(DRIVERS["counter"])), {}
        return
    seen: list[dict[str, Any]] = []
    for kind, models in DRIVERS.items():
        for model in models:
            line = dict(getattr(driver_of(kind, model), "SERIAL", {}))
            if line and line not in seen:
                seen.append(line)
                yield kind, model, line


def _printable(identity: str) -> str:
    """What can stand in a file: control characters, which no instrument has in its name, as question marks."""
    return "".join(sign if sign.isprintable() else "?" for sign in identity)


def recognised(identity: str) -> tuple[str, str] | None:
    """Kind and model of our driver for an answer to ``*IDN?``; None if there is none.

    >>> recognised("Keysight Technologies,53220A,MY1,2.1"), recognised("RIGOL TECHNOLOGIES,DS1104Z,DS1Z,00.04")
    (('counter', '53220A'), ('oscilloscope', 'DS1000Z'))
    """
    fields = identity.split(",")
    field = fields[1].strip() if len(fields) > 1 else ""
    fitting = [
        (kind, model)
        for kind, models in DRIVERS.items()
        for model in models
        if re.fullmatch(driver_of(kind, model).MODELS, field, re.IGNORECASE)
    ]
    # of several names for one driver the one that the instrument gives itself
    return min(fitting, key=lambda what: what[1].upper() not in field.upper(), default=None)


#: What a kind is for, and an address as one of it may have.
KINDS = {
    "counter": ("counts the light pulses", "TCPIP0::192.168.1.20::5025::SOCKET"),
    "generator": ("drives the coil", "USB0::0x0957::0x2807::MY52400001::INSTR"),
    "oscilloscope": ("records the phototransistor", "TCPIP0::192.168.1.22::INSTR"),
    "magnetometer": ("measures the base's field", "COM3"),
}


class WouldOverwrite(LevilabError):
    """A file that is there already."""


class NobodyFound(LevilabError):
    """Nobody answered that there is a driver for."""

    exit_code = 3

    def __init__(self) -> None:
        super().__init__(
            "nobody answered that levilab has a driver for, so no file was written: is it on and connected?  Name it "
            "with --address, or take --force for a file to fill in by hand"
        )


def bench_text(found: Sequence[Found], library: str) -> str:
    """The text of a bench.toml: the first instrument of each kind, the others as comments."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(  # noqa: S701 - no HTML
        loader=PackageLoader("levilab.bench", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    # TOML's strings are JSON's; jinja's own filter would escape signs of HTML
    environment.policies["json.dumps_function"] = lambda value, **_: _quoted(value)
    by_kind = {kind: [one for one in found if one.kind == kind] for kind in KINDS}
    about = {
        kind: {"what": what, "address": address, "model": next(iter(DRIVERS[kind])), "models": ", ".join(DRIVERS[kind])}
        for kind, (what, address) in KINDS.items()
    }
    return environment.get_template("bench.toml.j2").render(
        library=library,
        kinds=about,
        chosen={kind: ones[0] if ones else None for kind, ones in by_kind.items()},
        others={kind: ones[1:] for kind, ones in by_kind.items()},
        unknown=[one for one in found if one.identity and not one.kind],
    )


def _quoted(value: str) -> str:
    import json

    return json.dumps(value, ensure_ascii=False)


def refuse_to_overwrite(path: Path) -> None:
    """Raise WouldOverwrite if there is such a file, CannotWrite if there is no folder for it."""
    from levilab.files import CannotWrite

    if not path.parent.is_dir():
        raise CannotWrite(f"{path.parent} is no folder: give another name with --out")
    if path.exists():
        raise WouldOverwrite(f"{path} is there already: give another name with --out, or --force to replace it")


def write_bench(path: Path, text: str) -> None:
    """Write the file.  Raises CannotWrite."""
    from levilab.files import CannotWrite, replace_atomically

    try:
        replace_atomically(path, text)
    except OSError as error:
        raise CannotWrite(f"{path} cannot be written ({error.strerror}): give another name with --out") from error
