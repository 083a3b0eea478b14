"""Every row of every virtual instrument is asked, set to what it answers, and reset."""

import pytest

from support import hostile
from support.models import FAMILIES, KIND_OF
from support.wire import ask, errors, send

#: Rows that are no settings: what they answer is no parameter, or changes by itself, or ends what goes on.
NO_SETTING = ("*OPC", "CONFigure", "MEASure", "DISPlay:DATA", "C1:(BSWV", "C2:(BSWV")
#: Levels that follow the light, where they are automatic.
FOLLOWS = "INP:LEV"


def prepared(name):
    """An instrument in which something was measured, so that there is something to ask for."""
    device = hostile.instrument(name)
    if KIND_OF[name] == "oscilloscope":
        device.clock.sleep(1.0)
        send(device, b":STOP\n")
    return device


def said(device, message):
    """What is answered, without the header that a Siglent puts before it."""
    answer = ask(device, message)
    return answer.rpartition(" ")[2] if answer and not device.path_memory else answer


def reported(device):
    """The error queue, where there is one."""
    return errors(device) if device.takes_blocks else []


@pytest.mark.parametrize("name", FAMILIES)
def test_every_row_is_asked_set_and_reset(name):
    device = prepared(name)
    settable = [row for row in device.commands.rows if row.settable and row.askable]
    kept = {}
    for row in settable:
        if row.header.startswith(NO_SETTING):
            continue
        header = hostile.spellings(row.header)[0]
        answer = said(device, header + "?")
        if reported(device) or answer is None or "#" in answer:
            continue  # it needs parameters, or there is nothing to tell
        kept[header] = answer
        send(device, f"{header} {answer}\n".encode("latin-1"))
        assert reported(device) == [], (header, answer)
        assert said(device, header + "?") == answer, header
    assert len(kept) >= 4
    kept.pop(FOLLOWS, None)
    send(device, b"*RST\n")
    fresh = hostile.instrument(name)
    send(fresh, b"*RST\n")
    changed = {header: said(device, header + "?") for header in kept}
    assert changed == {header: said(fresh, header + "?") for header in kept}
