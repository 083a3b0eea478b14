"""Answers of virtual generators as numbers and as entries."""

from support.wire import ask


def number(device, question):
    """The answer as a number."""
    return float(ask(device, question))


def entries(device):
    """The error queue as text."""
    return list(iter(lambda: ask(device, "SYST:ERR?"), device.no_error))
