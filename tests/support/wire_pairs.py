"""A driver, its virtual instrument and a wire that may be faulty between them, over each way there is."""

import contextlib
import itertools
import math
import re
from dataclasses import dataclass
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pyvisa_py.protocols.hislip
import pyvisa_py.protocols.rpc
import pyvisa_py.tcpip
import serial.urlhandler.protocol_socket

import instruments.virtual.servers.hislip
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import CommandRefused, InstrumentError, NotConnected
from instruments.ieee488 import PLAIN_BLOCK, block_of
from instruments.links.serial_port import SerialTransport
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bus import Bus
from instruments.virtual.bench.serial_line import benches
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.servers.serial_port import HAS_PSEUDO_TERMINALS
from instruments.virtual.servers.server import BenchServer
from support import hostile
from support.proxy import LOOPBACK, Proxy
from support.waiting import HANG_GUARD_S
from support.wire_faults import FaultyBus, Tapped, Wire

#: A time-out that a fault may make a program wait for, and one that only a failure reaches [s].
SHORT, AT_MOST = 0.03, HANG_GUARD_S

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
        lambda driver: setattr(driver, name, value),
        lambda pair, _: getattr(pair.side, name) == value,
        remakes=True,
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
    with pair.bus.lock:
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
SCPI = ANY | {"an empty error queue": _errors(_report_none), "an error in the queue": _errors(_report_one)}


def _with_settings(driver, operations):
    found = {f"setting {row.name}": _setting(row.name) for row in driver.declared()}
    for row in driver.CHANNEL.declared() if hasattr(driver, "CHANNEL") else ():
        found[f"setting channel1_{row.name}"] = _channel_setting(row.name)
    return operations | found


def _counter(driver, question, block):
    timed = {"timed readings": _readings(block, lambda driver: driver.timed_readings(3))}
    return _with_settings(
        driver,
        SCPI
        | {
            "prepare": Operation(_prepare_counter, _same_settings, remakes=True),
            "set gate": _set("gate", 0.25),
            "reading": _reading(question),
            "readings": _readings(block, lambda driver: driver.readings(3)),
        }
        | (timed if hasattr(driver, "timed_readings") else {}),
    )


def _prepare_counter(driver):
    driver.prepare(gate_s=0.5, trigger_level_v=0.6)


def _switch_on(pair):
    with pair.bus.lock:
        pair.tap.device.execute(f"{pair.driver.OUTPUT} ON")


def _prepare_generator(driver):
    driver.prepare(waveform="TRI", frequency_hz=25.0, amplitude_vpp=2.0, offset_v=0.5)


def _generator(driver):
    return _with_settings(
        driver,
        SCPI
        | {
            "prepare": Operation(_prepare_generator, _same_settings, remakes=True),
            "set frequency": _set("frequency", 31.5),
            "on": _set("output", value=True),
            "off": Operation(
                lambda driver: driver.off(),
                lambda pair, _: pair.side.output is False,
                _switch_on,
                remakes=True,
            ),
        },
    )


def _prepare_scope(driver):
    driver.prepare(channels=[1], duration_s=0.1, points=1000, volts_per_division=0.5, trigger_level_v=0.6)


def _acquire(driver):
    driver.acquire(timeout_s=1.0)


def _has_record(pair, _):
    return pair.has_done("SING") and not pair.is_running()


def _is_trace(pair, trace):
    """Every code of it, and its scaling, as they left the instrument in this attempt."""
    return any(
        np.array_equal(trace.codes, np.frombuffer(block_of(block), np.uint8)) for block in pair.answers(r":WAV:DATA\?")
    ) and any(
        (trace.dt_s, trace.t0_s, trace.volts_per_code, trace.offset_v)
        == (n[4], n[5], n[7], pair.offset(per_code=n[7], origin=n[8], reference=n[9]))
        for n in map(_numbers, pair.answers(r":WAV:PRE\?"))
    )


def _are_blocks(pair, codes):
    return any(codes == block_of(block) for block in pair.answers(r":WAV:DATA\?"))


def _scope(driver):
    return _with_settings(
        driver,
        SCPI
        | {
            "prepare": Operation(_prepare_scope, _same_settings, remakes=True),
            "set level": _set("trigger_level", 0.3),
            "acquire": Operation(_acquire, _has_record, remakes=True),
            "trace": Operation(lambda driver: driver.trace(1), _is_trace, remakes=True),
            "blocks": Operation(
                lambda driver: b"".join(piece.tobytes() for piece in driver.blocks(1)), _are_blocks, remakes=True
            ),
        },
    )


def _prepare_magnetometer(driver):
    driver.prepare(range_t=0.035)


#: One of each unit of UNIT? in tesla.
_UNITS_T = {"1": 1e-4, "2": 1.0, "3": 1e-4, "4": 4e-7 * math.pi}


def _is_field(pair, value):
    answers = (answer.decode().split(";") for answer in pair.answers(r"UNIT\?;RDGFIELD\?;.*"))
    return any(value == float(field) * _UNITS_T[unit] for unit, field, *_ in answers)


def _magnetometer(driver):
    return _with_settings(
        driver,
        ANY
        | {
            "prepare": Operation(_prepare_magnetometer, _same_settings, remakes=True),
            "set unit": _set("unit", "GAUSS"),
            "reading": Operation(lambda driver: driver.flux_density(), _is_field),
            "probe": Operation(lambda driver: driver.probe(), lambda pair, value: value == pair.side.probe()),
        },
    )


@dataclass(frozen=True)
class Kind:
    """A driver, how it is prepared, and its operations."""

    driver: type
    prepare: object
    operations: dict


KINDS = {
    "53230A": Kind(Keysight53230A, _prepare_counter, _counter(Keysight53230A, r"READ\?", r"DATA:REM\?.*")),
    "CNT-91": Kind(PendulumCNT91, _prepare_counter, _counter(PendulumCNT91, r"READ\?", r"FETC:ARR\?.*")),
    "33500B": Kind(Keysight33500B, _prepare_generator, _generator(Keysight33500B)),
    "33220A": Kind(Agilent33220A, _prepare_generator, _generator(Agilent33220A)),
    "DS1000Z": Kind(RigolDS1000Z, _prepare_scope, _scope(RigolDS1000Z)),
    "DSOX1000": Kind(KeysightDSOX, _prepare_scope, _scope(KeysightDSOX)),
    "425": Kind(LakeShore425, _prepare_magnetometer, _magnetometer(LakeShore425)),
    "475": Kind(LakeShore475, _prepare_magnetometer, _magnetometer(LakeShore475)),
}
SCOPES, MAGNETOMETERS = ("DS1000Z", "DSOX1000"), ("425", "475")

#: Way → the models that go it.  The first four lie within the process, on the bench's clock; the others are proxied.
WAYS = {
    "messages": tuple(KINDS),
    "stream": tuple(KINDS),
    "line": MAGNETOMETERS,
    "levilab": MAGNETOMETERS,
    "socket": tuple(KINDS),
    "hislip": tuple(KINDS),
    "vxi11": tuple(KINDS),
    "serial": MAGNETOMETERS,
    **({"pty": MAGNETOMETERS} if HAS_PSEUDO_TERMINALS else {}),
}
WITHIN = ("messages", "stream", "line", "levilab")
#: Those without frames: a line feed ends a message.
FRAMED = ("hislip", "vxi11")
STREAMS = ("stream", "line", "levilab", "socket", "serial", "pty")
#: Those that carry seven bits of a byte.
SEVEN_BITS = ("line", "levilab")
_bench_numbers = itertools.count()


class _Hasty(VisaTransport):
    """The bench's clock jumps to each answer: a measurement takes no longer than any answer."""

    def query(self, message, *, patience=0.0):
        return super().query(message)

    def query_block(self, message, *, patience=0.0, form=PLAIN_BLOCK):
        return super().query_block(message, form=form)


class _HastySerial(SerialTransport):
    def query(self, message, *, patience=0.0):
        return super().query(message)


class _Bound:
    """How long pyvisa-py's VXI-11 waits: its own bounds are seconds longer than the time-out."""

    seconds = AT_MOST


@contextlib.contextmanager
def hasty_clients():
    """The clients without waits of their own: at a device clear, at the end of a connection, and for its last words.

    The servers send away none that a busy machine delays.
    """
    receive = pyvisa_py.protocols.rpc._recvrecord

    def receive_soon(sock, timeout, **more):
        return receive(sock, min(timeout, _Bound.seconds), **more)

    with (
        mock.patch.object(pyvisa_py.protocols.rpc, "_recvrecord", receive_soon),
        mock.patch.object(pyvisa_py.protocols.hislip, "time", SimpleNamespace(sleep=lambda _: None)),
        mock.patch.object(pyvisa_py.tcpip.Vxi11CoreClient, "destroy_link", return_value=0),
        mock.patch.object(serial.urlhandler.protocol_socket, "time", SimpleNamespace(sleep=lambda _: None)),
        mock.patch.object(serial, "protocol_handler_packages", ["serial.urlhandler", "instruments.virtual.bench"]),
        mock.patch.multiple(instruments.virtual.servers.hislip, FIRST_WORDS=AT_MOST, SECOND_CHANNEL=AT_MOST),
    ):
        yield


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
        self.bus, transport = self._link(device)
        clock = {"clock": self.room.clock} if name in SCOPES else {}
        side = Bus({NETWORK: device}, lock=self.bus.lock)
        self.side = self.kind.driver(VisaTransport(NETWORK, library=library_for(side)), **clock)
        self.driver = self.kind.driver(transport, **clock)
        self._opened.callback(self.side.close)
        self._opened.callback(self.driver.close)
        self._mark = 0
        self.prepare()
        self.reference = self._settings()

    def close(self):
        self._opened.close()

    # --- links ---

    def _link(self, device):
        return self._within(device) if self.way in WITHIN else self._proxied(device)

    def _within(self, device):
        address = {"messages": NETWORK, "stream": SOCKET}.get(self.way, SERIAL)
        self.tap = Tapped(device, self.wire.heard)
        bus = FaultyBus({address: self.tap}, self.wire)
        line = {key: value for key, value in getattr(self.kind.driver, "SERIAL", {}).items() if key != "pause"}
        if self.way == "levilab":
            name = f"wire{next(_bench_numbers)}"
            benches[name] = lambda: bus
            self._opened.callback(benches.pop, name)
            return bus, SerialTransport(f"levilab://box?bench={name}", **line)
        return bus, VisaTransport(address, library=library_for(bus), line=line)

    def _proxied(self, device):
        serial = self.way in {"serial", "pty"}
        self.tap = Tapped(device, self.wire.heard)
        bus = Bus({SERIAL if serial else NETWORK: self.tap})
        server = self._opened.enter_context(BenchServer(bus))
        offer = server.offers[0].resources["socket" if serial else self.way]
        port = int(re.findall(r"(?<=[:,])\d+", offer)[-1])
        framing = "socket" if serial else self.way
        proxy = self._opened.enter_context(Proxy(port, self.wire, framing, terminal=self.way == "pty"))
        if self.way == "pty":
            return bus, _HastySerial(proxy.name, timeout=AT_MOST)
        near = offer.replace(str(port), str(proxy.port))
        if serial:
            return bus, _HastySerial(f"socket://{LOOPBACK}:{proxy.port}", timeout=AT_MOST)
        return bus, _Hasty(near, library="@py", timeout=AT_MOST)

    # --- what the far end knows ---

    def ask(self, question):
        """The instrument's own answer, over the sound link."""
        return self.side.transport.query(question)

    def answers(self, pattern):
        """What it has answered to questions of this form in this attempt."""
        heard = list(self.tap.heard)[self._mark :]
        return [answer for message, answer, _ in heard if answer and re.fullmatch(pattern, message)]

    def has_done(self, command):
        """Whether it has carried this command out in this attempt."""
        heard = list(self.tap.heard)[self._mark :]
        return any(command in message and not complained for message, _, complained in heard)

    def is_running(self):
        """Whether a scope still takes a record."""
        if self.name == "DS1000Z":
            return self.ask(":TRIG:STAT?") != "STOP"
        return bool(int(self.ask(":OPER:COND?")) & 8)

    def offset(self, *, per_code, origin, reference):
        """The voltage of code 0, after each maker's manual."""
        return -(origin + reference) * per_code if self.name == "DS1000Z" else origin - reference * per_code

    # --- a program's part ---

    def hurry(self):
        """Wait no longer than need be: a fault is on the wire."""
        _Bound.seconds = 4 * SHORT
        if self.way not in WITHIN:
            self.driver.transport.timeout = SHORT

    def calm(self):
        """Wait as long as it takes: the wire is sound."""
        self.wire.arm(None)
        _Bound.seconds = AT_MOST
        if self.way not in WITHIN:
            self.driver.transport.timeout = AT_MOST

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
        self._mark = len(self.tap.heard)

    def recover(self, *, anew, reset):
        """What a program does after an error: a new link if there is none, the error queue emptied, set up if need be.

        reset: the instrument may have got a command that the program has not sent, and is switched off and on.
        """
        self.calm()
        self.room.clock.sleep(60.0)
        with self.bus.lock:
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
        if self.way in {"serial", "pty"}:
            self._come_into_step()
        self.driver.forget_errors()
        self.driver.identity()

    def _come_into_step(self):
        """A line has no clear; names that were waited for in vain, and come after all, are known by their form."""
        self.driver.transport.timeout = 10 * SHORT  # names that never come are waited for once so long
        for _ in range(10):
            try:
                if self.driver.identity() == self.tap.device.identity and self.driver.probe() == self.side.probe():
                    break
            except NotConnected:
                self.driver.transport.reopen()
            except InstrumentError:
                pass
        self.driver.transport.timeout = AT_MOST


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
