"""Every row of every virtual instrument: it is found by its header, set, asked, and reset."""

import re

import pytest

from instruments.virtual.core.rows import Number, Switch, Text, Word
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import Quantity
from instruments.virtual.generator.siglent_sdg1000x import VirtualSDG1000X
from instruments.virtual.magnetometer.lakeshore import Fields
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000
from instruments.virtual.oscilloscope.siglent_sds1000xe import VirtualSDS1000XE
from instruments.virtual.oscilloscope.tektronix_tds2000 import VirtualTDS2000
from support import hostile
from support.models import FAMILIES, KIND_OF, ROWS, SERIAL
from support.wire import ask, errors, send

#: Rows that are no settings: what they answer is no parameter, or changes by itself, or ends what goes on.
NO_SETTING = ("*OPC", "CONFigure", "MEASure", "DISPlay:DATA", "C1:(BSWV", "C2:(BSWV", "(SCDP", "HEADer")
#: What ``*RST`` leaves as it is, by twin; the time-out of a 53230A and the form of a Siglent's answers are in memory
#: that keeps, masks of the status are none of its business (IEEE 488.2, 10.32).
KEPT = {Virtual53230A: {"timeout"}, VirtualSDS1000XE: {"header"}, VirtualSDG1000X: {"header"}}
KEPT |= {VirtualTDS2000: {"header", "verbose"}}
MASKS = ("*ESE", "*SRE")
#: Numbers that the instrument moves to the nearest that it can do, by twin.
ADJUSTED = {VirtualDSOX1000: r"CHANnel\d:OFFSet"}
#: Two long forms have this short form.
ONE_SHORT_FORM = {"OPER:COND"}
#: Levels that follow the light, where they are automatic.
FOLLOWS = ("INPut[1]:LEVel", "INPut2:LEVel")


def of_twin(rows, device, default):
    """Return what a table has for the class of a twin."""
    return next((value for twin, value in rows.items() if isinstance(device, twin)), default)


def reset(device):
    send(device, b"*RST\n")
    if isinstance(device, VirtualTDS2000):
        send(device, b"HEAD OFF\n")
    return device


def prepared(name):
    """An instrument in which something was measured, so that there is something to ask for."""
    device = reset(hostile.instrument(name))
    device.clock.sleep(1.0)
    return stopped(device, name)


def stopped(device, name):
    """An oscilloscope does not acquire: then its memory can be set."""
    if KIND_OF[name] == "oscilloscope":
        send(device, ROWS[name].driver.STOP.encode() + b"\n")
    return device


def said(device, header):
    """What is answered, without the header that a Siglent puts before it."""
    answer = ask(device, header + "?")
    return answer.rpartition(" ")[2] if answer and not device.path_memory else answer


def reported(device):
    """The error queue, where there is one, but for what gives way at a generator: another setting (-221)."""
    gives_way = {-221} if isinstance(device, VirtualGenerator) else set()
    return [number for number in errors(device) if number not in gives_way] if device.takes_blocks else []


def values(row, device):
    """What can be sent to set a row, as far as its kind says it; else None."""
    if isinstance(row, Number):
        return [f"{value:.17g}" for value in numbers(row, device)]
    if isinstance(row, Word):
        return [word.removeprefix("*") for word in (row.words(device) if callable(row.words) else row.words).split()]
    if isinstance(row, Switch):
        return ["ON", "OFF"]
    if isinstance(row, Text):
        return ['"A"', '""']
    if isinstance(row, Fields):
        return [",".join(f"{getattr(field, end):g}" for field in row.fields) for end in ("low", "high")]
    return None


def numbers(row, device):
    """The lowest and the highest number, or all of few."""
    return getattr(row, "values", ()) or row.range(device)


def is_same(row, sent, answer):
    """Whether an answer is what was sent, as far as the kind of the row says it."""
    if isinstance(row, Quantity):
        return float(answer) == pytest.approx(float(sent), rel=1e-9)
    if isinstance(row, Number):
        # an instrument rounds to its digits, at least three, or to its steps: then it may be the next one
        return float(answer.rstrip("SV")) == pytest.approx(float(sent), rel=5e-3 if row.rounded is float else 0.5)
    if isinstance(row, Word):
        return answer in {re.sub("[a-z]", "", sent), sent.upper()}
    if isinstance(row, Switch):
        return answer == row.words[sent == "ON"]
    if isinstance(row, Fields):
        return [float(word) for word in answer.split(",")] == [float(word) for word in sent.split(",")]
    return answer == sent


def settings_of(name):
    """The rows of a model that can be set and asked without more ado, by header."""
    device, found = prepared(name), {}
    for row in device.commands.rows:
        header = hostile.spellings(row.header)[0]
        if not row.has(query=False) or not row.has(query=True) or row.header.startswith(NO_SETTING):
            continue
        answer = said(device, header)
        if not reported(device) and answer is not None and "#" not in answer:
            found[header] = row
    return found


@pytest.mark.parametrize("name", FAMILIES)
def test_every_header_finds_its_own_row(name):
    commands = hostile.instrument(name).commands
    for row in commands.rows:
        for header in (word for word in hostile.spellings(row.header) if word.upper() not in ONE_SHORT_FORM):
            assert not row.has(query=False) or commands.find(header) == row.set
            assert not row.has(query=True) or commands.find(header + "?") == row.ask


@pytest.mark.parametrize("name", FAMILIES)
def test_one_row_gives_the_default_of_a_setting(name):
    given = [setting for row in hostile.instrument(name).commands.rows for setting in row.defaults()]
    assert sorted(given) == sorted({*given})


@pytest.mark.parametrize("name", FAMILIES)
def test_every_row_is_set_asked_and_reset(name):
    device, fresh = prepared(name), reset(hostile.instrument(name))
    kept = of_twin(KEPT, device, set())
    adjusted = of_twin(ADJUSTED, device, "")
    assert len(settings_of(name)) >= 4
    for header, row in settings_of(name).items():
        default = said(fresh, header)
        for value in values(row, stopped(reset(device), name)) or [said(device, header)]:
            send(device, f"{header} {value}\n".encode("latin-1"))
            answer = said(device, header)
            assert reported(device) == [], (header, value)
            assert is_same(row, value, answer) or re.fullmatch(adjusted, row.header), (header, value, answer)
            send(device, f"{header} {answer}\n".encode("latin-1"))
            assert (said(device, header), reported(device)) == (answer, []), header
        reset(device)
        if row.header in MASKS or row.defaults().keys() & kept:
            send(device, f"{header} {default}\n".encode("latin-1"))
            continue
        assert {setting: device.settings[setting] for setting in row.defaults()} == row.defaults(), header
        assert said(device, header) == default or row.header.startswith(FOLLOWS), header


@pytest.mark.parametrize("name", sorted(set(FAMILIES) - set(SERIAL)))
def test_every_number_says_its_limits_where_it_is_asked(name):
    device = reset(hostile.instrument(name))
    for row in device.commands.rows:
        if isinstance(row, Number):
            header = hostile.spellings(row.header)[0]
            for word, limit in zip(("MIN", "MAX"), row.range(device), strict=True):
                answer = ask(device, f"{header}? {word}").rpartition(" ")[2]
                assert float(answer.rstrip("SV")) == pytest.approx(limit, rel=5e-3), (header, word)
