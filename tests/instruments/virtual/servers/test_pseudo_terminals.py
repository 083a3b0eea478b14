"""Serial lines whose near end is a device file."""

import contextlib

import pytest
import pyvisa

from instruments.virtual.servers.streams import HAS_PSEUDO_TERMINALS
from support.served import Thing, until

pytestmark = pytest.mark.skipif(not HAS_PSEUDO_TERMINALS, reason="no pseudo-terminals here")


def test_a_pseudo_terminal_outlives_a_failing_instrument(served, caplog):
    client = served.open("pty")
    client.write("FAIL?")
    until(lambda: "ZeroDivisionError" in caplog.text)
    assert client.query("*OPC?").strip() == "1"


def test_a_pseudo_terminal_loses_what_no_client_reads(served):
    served.open("pty").write("BLOC?;*OPC?")
    until(lambda: served.serial.blocks == 1)
    client = served.open("pty", timeout=100)

    def answers_again():
        with contextlib.suppress(UnicodeDecodeError, pyvisa.VisaIOError):  # the rest of the block
            return client.query("*IDN?").strip() == Thing.identity

    until(answers_again)
