"""Talks of drivers as rows: who, the lines that go to and fro, what is done, and what comes of it.

The lines are those of support.conversation, and all of them must have been said in the end.
"""

import dataclasses

import pytest

from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from support.conversation import conversation


@dataclasses.dataclass(frozen=True)
class Raises:
    """What comes of it is an error: its kind, what is found in its text, and attributes that it has."""

    kind: type[Exception]
    match: str = ""
    has: dict = dataclasses.field(default_factory=dict)


def talks(rows):
    """Parametrize a test with a table: sentence → (driver, lines, act, what act returns for the driver or raises)."""
    return pytest.mark.parametrize(("driver", "lines", "act", "end"), rows.values(), ids=rows)


def talk(driver, lines, act, end):
    """Let a driver act while its instrument says these lines."""
    with conversation(driver, *lines) as it:
        if not isinstance(end, Raises):
            assert act(it) == end
            return
        with pytest.raises(end.kind, match=end.match or None) as caught:
            act(it)
        assert {name: getattr(caught.value, name) for name in end.has} == end.has


def connected(driver, device, address="TCPIP0::instrument::inst0::INSTR", **options):
    """A driver at a virtual instrument; a clock that it wants is the instrument's."""
    return driver(open_link(address, library=library_for(VirtualBench({address: device}))), **options)
