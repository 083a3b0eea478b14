"""A driver, its virtual instrument and a wire that may be faulty between them, over each way within the process."""

import contextlib
import itertools
import math
import re
import struct
from dataclasses import dataclass
from unittest import mock

import numpy as np
import serial

from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.drivers.oscilloscope.siglent_sds1000xe import SiglentSDS1000XE
from instruments.drivers.oscilloscope.tektronix_tds2000 import TektronixTDS2000
from instruments.drivers.scpi import ScpiInstrument
from instruments.errors import CommandRefused, InstrumentError, NotConnected
from instruments.ieee488 import PLAIN_BLOCK, BlockForm, block_of
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.serial_line import benches
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.parser import ScpiError
from support import hostile
from support.models import FAMILIES, KIND_OF, PREPARE, ROWS
from support.wire_faults import FaultyBench, Tapped, Wire

NETWORK, SOCKET, SERIAL = "TCPIP0::box::inst0::INSTR", "TCPIP0::box::5025::SOCKET", "ASRLbox::INSTR"


# --- what is asked of each driver, and what is right ---


@dataclass(frozen=True)
class Operation:
    """What a program does with a driver.

    act: with the driver, gives a value; right: whether the value is, given the pair; ready: what is done to the
    instrument before; remakes: whether an error in the middle leaves the instrument to be prepared anew.
    """

    act: object
    right: object
    ready: object = None
    remakes: bool = False


def _same_settings(pair, _):
    return pair.is_prepared()


def _setting(name):
    return Operation(
        lambda driver: getattr(driver, name),
        lambda pair, value: value == getattr(pair.side, name) or _follows_the_signal(pair, name, value),
    )


def _follows_the_signal(pair, name, value):
    """Whether this is an automatic level, as it left the instrument in this attempt: it is another one soon after."""
    return (
        name == "trigger_level"
        and getattr(pair.side, "automatic_level", False)
        and any([value] == _numbers(answer) for answer in pair.answers(r"INP1:LEV1?\?"))
    )


def _are_the_settings(pair, values):
    wanted = pair.side.settings()
    level = values.get("trigger_level_v")
    if level != wanted.get("trigger_level_v") and _follows_the_signal(pair, "trigger_level", level):
        wanted["trigger_level_v"] = level
    return values == wanted


def _channel_setting(name):
    def ask(driver):
        return getattr(driver.CHANNEL(driver, 1), name)

    return Operation(ask, lambda pair, value: value == ask(pair.side))


def _set(name, value):
    return Operation(
        lambda driver: setattr(driver, name, value), lambda pair, _: getattr(pair.side, name) == value, remakes=True
    )


def _numbers(answer):
    return [float(part) for part in answer.decode().strip().split(",")]


def _reading(question):
    return Operation(
        lambda driver: driver.frequency(),
        lambda pair, value: any([value] == _numbers(answer) for answer in pair.answers(question)),
    )


def _readings(question, act):
    return Operation(
        act,
        lambda pair, values: any(values.ravel().tolist() == _numbers(answer) for answer in pair.answers(question)),
        remakes=True,
    )


def _queue(driver):
    """The error queue, as a list of its entries."""
    try:
        driver.raise_errors("a test")
    except CommandRefused as refused:
        return refused.entries
    return ()


def _report_one(pair):
    with pair.bench.lock:
        pair.tap.device.parser.report(ScpiError(-222))
    pair.waiting = True


def _report_none(pair):
    pair.waiting = bool(pair.tap.device.parser.errors)


def _errors(ready):
    # an entry that is invented is an error like any other; one that is overlooked is not
    return Operation(_queue, lambda pair, entries: bool(entries) or not pair.waiting, ready)


ANY = {
    "identity": Operation(lambda driver: driver.identity(), lambda pair, value: value == pair.tap.device.identity),
    "settings": Operation(lambda driver: driver.settings(), _are_the_settings),
}
QUEUE = {"an empty error queue": _errors(_report_none), "an error in the queue": _errors(_report_one)}


def _operations(driver, of_its_kind):
    """Those of every driver, those of its kind, and asking for each of its settings."""
    has_queue = driver.HAS_ERROR_QUEUE and driver.raise_errors is ScpiInstrument.raise_errors
    found = {f"setting {row.name}": _setting(row.name) for row in driver.declared_settings() if not row.on_demand}
    for row in driver.CHANNEL.declared_settings() if hasattr(driver, "CHANNEL") else ():
        found[f"setting channel1_{row.name}"] = _channel_setting(row.name)
    return ANY | (QUEUE if has_queue else {}) | of_its_kind | found


#: The questions by which the counters of both makers give a series.
_SERIES = r"(DATA:REM|FETC:ARR)\?.*|READ\?"


def _counter(driver):
    timed = {"timed readings": _readings(_SERIES, lambda driver: driver.timed_readings(3))}
    return {
        "prepare": Operation(PREPARE["counter"], _same_settings, remakes=True),
        "set gate": _set("gate", (driver.gate.values or (0.25,))[-1]),
        "reading": _reading(r"READ\?"),
        "readings": _readings(_SERIES, lambda driver: driver.readings(3)),
    } | (timed if hasattr(driver, "timed_readings") else {})


def _switch_on(pair):
    with pair.bench.lock:
        pair.tap.device.execute(f"{pair.driver.OUTPUT} ON")


def _generator(_driver):
    return {
        "prepare": Operation(PREPARE["generator"], _same_settings, remakes=True),
        "set frequency": _set("frequency", 31.5),
        "on": _set("output", value=True),
        "off": Operation(
            lambda driver: driver.off(), lambda pair, _: pair.side.output is False, _switch_on, remakes=True
        ),
    }


def _acquire(driver):
    driver.acquire(timeout_s=1.0)


@dataclass(frozen=True)
class Reading:
    """How the scopes of a maker are read, after its manual.

    block, scaling: the questions for the codes and for what they mean (regular expressions); form: of the block; zero:
    code 0 of the wire; numbers: of an answer to the latter: time between samples, first time, volts a code, volts at
    code 0.
    """

    numbers: object
    block: str = r":WAV:DATA\?"
    scaling: str = r":WAV:PRE\?"
    form: BlockForm = PLAIN_BLOCK
    zero: int = 0

    def codes(self, answer):
        """The codes in a block as it came."""
        return np.frombuffer(block_of(answer, self.form), np.uint8) ^ np.uint8(self.zero)


def _rigol_numbers(answer):
    *_, step, first, _, per_code, origin, reference = _numbers(answer)
    return step, first, per_code, -(origin + reference) * per_code


def _keysight_numbers(answer):
    *_, step, first, _, per_code, origin, reference = _numbers(answer)
    return step, first, per_code, origin - reference * per_code


_LECROY = BlockForm(longest_head=16, ends=2)


def _siglent_numbers(answer):
    """WAVEDESC: the count of points at 116, volts a division and offset at 156, the step at 176; seven digits."""
    descriptor = block_of(answer, _LECROY)
    (count,), (step,) = struct.unpack_from("<i", descriptor, 116), struct.unpack_from("<f", descriptor, 176)
    step, division, offset = (float(f"{v:.7g}") for v in (step, *struct.unpack_from("<ff", descriptor, 156)))
    return step, -count * step / 2, division / 25, -128 * (division / 25) - offset


def _tektronix_numbers(answer):
    """WFMPre?: step, first time, volts a code, volts at the code of 0 V and that code, by their places."""
    fields = answer.decode().split(";")
    step, first, per_code, zero, offset = (float(fields[place]) for place in (8, 10, 12, 13, 14))
    return step, first, per_code, zero - (offset + 128) * per_code


READINGS = {
    RigolDS1000Z: Reading(_rigol_numbers),
    KeysightDSOX: Reading(_keysight_numbers),
    SiglentSDS1000XE: Reading(_siglent_numbers, r"C1:WF\? DAT2", r"C1:WF\? DESC", _LECROY, 128),
    TektronixTDS2000: Reading(_tektronix_numbers, r"CURV\?", r"WFMP\?", zero=128),
}


def _is_trace(pair, trace):
    """Every code of it, and its scaling, as they left the instrument in this attempt."""
    reading = READINGS[pair.kind.driver]
    return any(np.array_equal(trace.codes, reading.codes(block)) for block in pair.answers(reading.block)) and any(
        (trace.dt_s, trace.t0_s, trace.volts_per_code, trace.offset_v) == reading.numbers(answer)
        for answer in pair.answers(reading.scaling)
    )


def _are_blocks(pair, codes):
    reading = READINGS[pair.kind.driver]
    return any(codes == reading.codes(block).tobytes() for block in pair.answers(reading.block))


def _scope(_driver):
    return {
        "prepare": Operation(PREPARE["oscilloscope"], _same_settings, remakes=True),
        "set level": _set("trigger_level", 0.3),
        "acquire": Operation(_acquire, lambda pair, _: pair.has_new_record(), remakes=True),
        "trace": Operation(lambda driver: driver.trace(1), _is_trace, remakes=True),
        "blocks": Operation(
            lambda driver: b"".join(piece.tobytes() for piece in driver.blocks(1)), _are_blocks, remakes=True
        ),
    }


#: One of each unit of UNIT? in tesla.
_UNITS_T = {"1": 1e-4, "2": 1.0, "3": 1e-4, "4": 4e-7 * math.pi}


def _is_field(pair, value):
    answers = (answer.decode().split(";") for answer in pair.answers(r"UNIT\?;RDGFIELD\?;.*"))
    return any(value == float(field) * _UNITS_T[unit] for unit, field, *_ in answers)


def _magnetometer(_driver):
    return {
        "prepare": Operation(PREPARE["magnetometer"], _same_settings, remakes=True),
        "set unit": _set("unit", "GAUSS"),
        "reading": Operation(lambda driver: driver.flux_density(), _is_field),
        "probe": Operation(lambda driver: driver.probe(), lambda pair, value: value == pair.side.probe()),
    }


@dataclass(frozen=True)
class Kind:
    """A driver, how it is prepared, and its operations."""

    driver: type
    prepare: object
    operations: dict


_OF_KIND = {"counter": _counter, "generator": _generator, "oscilloscope": _scope, "magnetometer": _magnetometer}


def _kind(name):
    driver, kind = ROWS[name].driver, KIND_OF[name]
    return Kind(driver, PREPARE[kind], _operations(driver, _OF_KIND[kind](driver)))


#: The first model of each driver.
KINDS = {name: _kind(name) for name in sorted({ROWS[name].driver: name for name in reversed(FAMILIES)}.values())}
SCOPES = tuple(name for name in KINDS if KIND_OF[name] == "oscilloscope")
#: Those at a serial line.
ON_A_LINE = tuple(name for name, kind in KINDS.items() if kind.driver.SERIAL)

#: Way → the models that go it, all on the bench's clock.
WAYS = {
    "messages": tuple(KINDS),
    "stream": tuple(KINDS),
    "line": ON_A_LINE,
    "levilab": ON_A_LINE,
}
#: Those on which a line feed ends a message.
STREAMS = ("stream", "line", "levilab")
#: Those that carry seven bits of a byte.
SEVEN_BITS = ("line", "levilab")
_bench_numbers = itertools.count()


def levilab_protocol():
    """Let pyserial find the virtual instruments without an installation of their hook."""
    return mock.patch.object(serial, "protocol_handler_packages", ["serial.urlhandler", "instruments.virtual.bench"])


class Pair:
    """A driver and its virtual instrument over one way; the wire between them is sound until a fault is armed.

    side: the same driver over a link of its own that has no faults: what the instrument holds in truth.
    """

    def __init__(self, way, name):
        self.way, self.name, self.kind = way, name, KINDS[name]
        self.wire, self.room = Wire(), hostile.Room()
        self._opened = contextlib.ExitStack()
        self.waiting = False
        device = hostile.instrument(name, self.room)
        self.tap = Tapped(device, self.wire.heard)
        self.bench, transport = self._link()
        clock = {"clock": self.room.clock} if name in SCOPES else {}
        side = VirtualBench({NETWORK: device}, lock=self.bench.lock)
        self.side = self.kind.driver(open_link(NETWORK, library=library_for(side)), **clock)
        self.driver = self.kind.driver(transport, **clock)
        self._opened.callback(self.side.close)
        self._opened.callback(self.driver.close)
        self._mark, self._since = 0, 0.0
        self.prepare()
        self.reference = self._settings()

    def close(self):
        self._opened.close()

    # --- links ---

    def _link(self):
        address = {"messages": NETWORK, "stream": SOCKET}.get(self.way, SERIAL)
        bench = FaultyBench({address: self.tap}, self.wire)
        line = {key: value for key, value in self.kind.driver.SERIAL.items() if key != "pause"}
        if self.way == "levilab":
            name = f"wire{next(_bench_numbers)}"
            benches[name] = lambda: bench
            self._opened.callback(benches.pop, name)
            return bench, open_link(f"levilab://box?bench={name}", line=line)
        return bench, open_link(address, library=library_for(bench), line=line)

    # --- what the far end knows ---

    def answers(self, pattern):
        """What it has answered to questions of this form in this attempt."""
        heard = list(self.tap.heard)[self._mark :]
        return [answer for message, answer, _ in heard if answer and re.fullmatch(pattern, message)]

    def has_new_record(self):
        """Whether a scope has stopped with a record that it took in this attempt."""
        with self.bench.lock:
            scope = self.tap.device
            latest = None if scope.running() else scope.acquisition.latest
        return latest is not None and latest.trigger >= self._since

    # --- a program's part ---

    def prepare(self):
        """Set the instrument up, with a record for a scope."""
        self.kind.prepare(self.driver)
        if self.name in SCOPES:
            _acquire(self.driver)

    def _settings(self):
        # a scope's sweep is "single" once it has acquired, and what it was set to before
        return {name: value for name, value in self.side.settings().items() if name != "sweep"}

    def is_prepared(self):
        """Whether the instrument is set up as a preparation without faults leaves it."""
        return self._settings() == self.reference

    def begin(self, operation):
        """A new attempt."""
        if operation.ready:
            operation.ready(self)
        self._mark, self._since = len(self.tap.heard), self.room.clock.now()

    def recover(self, *, anew, reset):
        """What a program does after an error: a new link if there is none, the error queue emptied, set up if need be.

        reset: the instrument may have got a command that the program has not sent, and is switched off and on.
        """
        self.wire.arm(None)
        self.room.clock.sleep(60.0)
        with self.bench.lock:
            self.tap.device.parser.errors.clear()
            if reset:
                self.tap.device.reset()
        try:
            self._greet()
        except NotConnected:
            self.driver.transport.reopen()
            self._greet()
        if anew or reset or not self.is_prepared():
            self.prepare()

    def _greet(self):
        self.driver.forget_errors()
        self.driver.identity()


def attempt(pair, operation):
    """Value and error of one attempt; the error is an InstrumentError of one line that names the address."""
    pair.begin(operation)
    try:
        return operation.act(pair.driver), None
    except InstrumentError as error:
        seen = error
    assert seen.address == pair.driver.transport.address
    assert "\n" not in str(seen)
    return None, seen
