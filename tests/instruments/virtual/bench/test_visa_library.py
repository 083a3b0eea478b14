"""The virtual bench as a PyVISA library: what any program that speaks PyVISA sees of it."""

import contextlib
import subprocess
import sys
import time

import pytest
import pyvisa
from pyvisa.constants import EventMechanism, EventType, StatusCode

from instruments.clock import VirtualClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import Fault
from instruments.virtual.bench.visa_library import LevilabVisaLibrary, library_for
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.rows import Ask
from levilab.bench.config import ConfigError
from support.waiting import HANG_GUARD_S

COUNTER = "TCPIP0::counter.levilab::inst0::INSTR"
GENERATOR = "TCPIP0::generator.levilab::inst0::INSTR"
OSCILLOSCOPE = "TCPIP0::oscilloscope.levilab::inst0::INSTR"
MAGNETOMETER = "ASRLmagnetometer.levilab::INSTR"
BLOCKS = "TCPIP0::blocks.levilab::inst0::INSTR"

#: Every byte there is, line feeds and the end of a chunk of PyVISA's included.
ANY_BYTES = bytes(range(256)) * 100


class Blocks(VirtualInstrument):
    """Answers ``DATA?`` with a definite-length block (IEEE 488.2, 8.7.9)."""

    ROWS = (Ask("DATA", lambda _d: f"#5{len(ANY_BYTES):05d}" + ANY_BYTES.decode("latin-1")),)


@pytest.fixture
def manager():
    manager = pyvisa.ResourceManager("@levilab")
    yield manager
    manager.close()


@pytest.fixture
def blocks():
    clock = VirtualClock()
    manager = pyvisa.ResourceManager(library_for(VirtualBench({BLOCKS: Blocks(clock)})))
    resource = manager.open_resource(BLOCKS)
    resource.clock = clock
    yield resource
    manager.close()


def test_the_instruments_of_the_bench_are_listed(manager):
    assert manager.list_resources() == (COUNTER, GENERATOR, OSCILLOSCOPE, MAGNETOMETER)
    assert manager.list_resources("?*generator?*") == (GENERATOR,)
    assert manager.list_resources("GPIB?*::INSTR") == ()
    assert manager.list_resources("(GPIB|TCPIP)?*") == (COUNTER, GENERATOR, OSCILLOSCOPE)
    assert manager.list_resources("ASRL[a-m]?*") == (MAGNETOMETER,)


def test_a_program_that_waits_for_an_event_hears_that_there_are_none(manager):
    request, queue = EventType.service_request, EventMechanism.queue
    with manager.open_resource(GENERATOR) as generator:
        for act in (
            lambda: generator.enable_event(request, queue),
            lambda: generator.wait_on_event(request, 10),
            lambda: generator.install_handler(request, lambda *_: None),
        ):
            with pytest.raises(pyvisa.VisaIOError) as refused:
                act()
            assert refused.value.error_code == StatusCode.error_invalid_event
        generator.discard_events(request, queue)
        generator.disable_event(request, queue)


@pytest.mark.parametrize("address", [GENERATOR, GENERATOR.lower(), GENERATOR.upper()])
def test_a_resource_opens_in_any_case(manager, address):
    with manager.open_resource(address, read_termination="\n") as generator:
        assert generator.query("*IDN?").split(",")[1] == "33522B"


@pytest.mark.parametrize(
    ("plugged_in", "asked_for"),
    [
        ("USB0::0x14EB::0x0091::123456::INSTR", "USB0::0x14EB::0x0091::123456::INSTR"),
        ("USB0::0x14EB::0x0091::123456::INSTR", "USB::0x14eb::0x0091::123456::0::INSTR"),
        ("GPIB0::10::INSTR", "GPIB::10"),
        ("TCPIP0::box::inst0::INSTR", "TCPIP::box"),
    ],
)
def test_a_resource_opens_by_every_spelling_of_its_name(plugged_in, asked_for):
    manager = pyvisa.ResourceManager(library_for(VirtualBench({plugged_in: Blocks(VirtualClock())})))
    assert manager.open_resource(asked_for).query("*OPC?").strip() == "1"


def test_a_resource_that_is_not_there_is_not_found(manager):
    with pytest.raises(pyvisa.VisaIOError) as missing:
        manager.open_resource("TCPIP0::absent::inst0::INSTR")
    assert missing.value.error_code == StatusCode.error_resource_not_found


@pytest.mark.parametrize("chunk", [1, 7, 1024, 20 * 1024, 1 << 20])
def test_a_block_of_any_bytes_is_read_whole_in_chunks_of_any_size(blocks, chunk):
    blocks.write("DATA?")
    answer = blocks.read_raw(chunk)
    assert answer == b"#525600" + ANY_BYTES + b"\n"


def test_a_chunk_says_whether_more_is_to_come(blocks):
    blocks.write("*OPC?")
    with blocks.ignore_warning(StatusCode.success_max_count_read):
        assert blocks.visalib.read(blocks.session, 1) == (b"1", StatusCode.success_max_count_read)
    assert blocks.visalib.read(blocks.session, 1) == (b"\n", StatusCode.success)


def test_a_time_out_is_visas_and_as_long_as_it_was_set(blocks):
    blocks.timeout = 1_500_000
    before = blocks.clock.now()
    with pytest.raises(pyvisa.VisaIOError) as silence:
        blocks.query("FOO?")
    assert silence.value.error_code == StatusCode.error_timeout
    assert blocks.clock.now() - before == pytest.approx(1500.0, abs=1e-9)


def test_a_fresh_resource_waits_as_long_as_visa_prescribes(blocks):
    assert blocks.timeout == 2000  # ms; VPP-4.3, attribute VI_ATTR_TMO_VALUE


def test_clear_drops_an_answer_that_was_half_read(blocks):
    blocks.write("DATA?")
    assert blocks.read_bytes(3) == b"#52"
    blocks.clear()
    assert blocks.query("*OPC?").strip() == "1"


def test_a_line_end_that_is_sent_twice_or_not_at_all_makes_no_difference(manager):
    with manager.open_resource(GENERATOR, read_termination="\n") as generator:
        for end in ("", "\n", "\r\n"):
            generator.write_termination = ""
            assert generator.query("OUTP?" + end) == "0"


def test_benches_of_their_own_know_nothing_of_each_other():
    first, second = (library_for(VirtualBench({BLOCKS: Blocks(VirtualClock())})) for _ in range(2))
    assert first is not second
    assert isinstance(first, LevilabVisaLibrary)
    resources = [pyvisa.ResourceManager(library).open_resource(BLOCKS) for library in (first, second)]
    resources[0].write("FOO")
    assert [resource.query("SYST:ERR?").strip() for resource in resources] == [
        '-113,"Undefined header;FOO"',
        '+0,"No error"',
    ]


def test_a_bare_program_sets_a_frequency_and_reads_it_back():
    program = """
import pyvisa
manager = pyvisa.ResourceManager("@levilab")
generator = manager.open_resource("TCPIP0::generator.levilab::inst0::INSTR")
generator.write("FREQ 38.5")
print(float(generator.query("FREQ?")))
"""
    # as a process: no import of ours before it, and nothing left to warn of at its end
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        capture_output=True,
        text=True,
        timeout=HANG_GUARD_S,
        check=False,
    )
    assert (ended.stdout.strip(), ended.stderr) == ("38.5", "")


def test_other_models_stand_before_the_name_of_the_library():
    with contextlib.closing(pyvisa.ResourceManager("cnt-91,DSOX2000@levilab")) as manager:
        names = [manager.open_resource(address).query("*IDN?") for address in (COUNTER, OSCILLOSCOPE)]
    assert [name.split(",")[1].strip() for name in names] == ["CNT-91", "DSOX2024A"]
    with (
        contextlib.closing(pyvisa.ResourceManager("realtime,CNT91@levilab")) as manager,
        pytest.raises(ConfigError, match="'CNT91' before @levilab is no model"),
    ):
        manager.open_resource(COUNTER)


def test_a_bench_in_real_time_keeps_to_the_wall_clock():
    with contextlib.closing(pyvisa.ResourceManager("realtime@levilab")) as manager:
        counter = manager.open_resource(COUNTER, read_termination="\n", timeout=1000 * HANG_GUARD_S)
        counter.write("INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 0.6;:SENS:FREQ:GATE:TIME 0.1")
        begin = time.monotonic()
        assert 0 < float(counter.query("READ?")) < 31  # how far it has spun down depends on how busy the machine is
        assert time.monotonic() - begin >= 0.1


# --- what VISA offers beside reading and writing ---


def test_a_status_byte_shows_an_answer_and_errors(blocks):
    assert blocks.read_stb() == 0
    blocks.write("*OPC?")
    blocks.clock.sleep(1.0)
    assert blocks.read_stb() == 16
    blocks.read()
    blocks.write("NONSENSE")
    assert blocks.read_stb() == 4


def test_a_question_before_the_last_answer_was_read_interrupts_it(blocks):
    blocks.write("*IDN?")
    assert blocks.query("*OPC?").strip() == "1"
    assert blocks.query("SYST:ERR?").startswith("-410")


def test_a_shared_lock_is_for_those_who_know_its_key(blocks):
    others = [pyvisa.ResourceManager(blocks.visalib).open_resource(BLOCKS) for _ in range(2)]
    key = blocks.lock(requested_key="ours")
    assert others[0].lock(requested_key=key) == key
    assert others[0].query("*OPC?").strip() == "1"
    with pytest.raises(pyvisa.VisaIOError) as refused:
        others[1].write("*CLS")
    assert refused.value.error_code == StatusCode.error_resource_locked
    for holder in (blocks, others[0]):
        holder.unlock()
    assert others[1].query("*OPC?").strip() == "1"


def test_a_program_that_is_locked_out_can_do_nothing_to_the_instrument(blocks):
    other = pyvisa.ResourceManager(blocks.visalib).open_resource(BLOCKS)
    blocks.lock_excl()
    blocks.write("*OPC?")
    for act in (other.clear, other.assert_trigger, other.read_stb, other.read, lambda: other.write("*RST")):
        with pytest.raises(pyvisa.VisaIOError) as refused:
            act()
        assert refused.value.error_code == StatusCode.error_resource_locked
    assert blocks.read().strip() == "1"


def test_a_resource_that_is_opened_for_oneself_alone_is_locked(blocks):
    alone = pyvisa.constants.AccessModes.exclusive_lock
    mine = pyvisa.ResourceManager(blocks.visalib).open_resource(BLOCKS, access_mode=alone)
    with pytest.raises(pyvisa.VisaIOError):
        blocks.query("*OPC?")
    with pytest.raises(pyvisa.VisaIOError) as refused:
        pyvisa.ResourceManager(blocks.visalib).open_resource(BLOCKS, access_mode=alone)
    assert refused.value.error_code == StatusCode.error_resource_locked
    mine.close()
    assert blocks.query("*OPC?").strip() == "1"


def test_each_call_over_a_lost_link_returns_visas_status(blocks):
    blocks.visalib.bench.faults.append(Fault("disconnected", question=r"DATA\?"))
    blocks.write("DATA?")
    for act in (blocks.read_raw, blocks.read_stb, lambda: blocks.write("*CLS")):
        with pytest.raises(pyvisa.VisaIOError) as lost:
            act()
        assert lost.value.error_code == StatusCode.error_connection_lost
