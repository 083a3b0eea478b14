"""The bench, opened and left: whatever happens, the drive is off and everything is closed."""

from functools import partial
from unittest.mock import Mock

import pytest
import pyvisa

from instruments.catalogue import COUNTERS
from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, NotConnected, Occupied, OutOfRange, WrongInstrument
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from levilab.acquisition.experiments.spin import SpinSettings
from levilab.acquisition.table import Configuration, settings_of
from levilab.bench.bench import OutputMayBeOn, open_bench
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings, Limits, read_bench
from levilab.bench.wiring import described_wiring
from levilab.errors import LevilabError
from levilab.interruption import Interrupted
from levilab.world.bench import VIRTUAL, VIRTUAL_MODELS, _connect_generator, virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld
from support.waiting import HANG_GUARD_S

#: A link at a bench in real time waits for so long, however busy the machine is.
PATIENCE_MS = 1000 * HANG_GUARD_S

KINDS = ("counter", "generator")


class World(SpinWorld):
    """A world that remembers what the coil did."""

    def __init__(self):
        self.coil = []
        super().__init__(SpinScene(), VirtualClock())

    def drive(self, time, output):
        self.coil.append((output.waveform, output.frequency, output.amplitude))
        super().drive(time, output)

    @property
    def field(self):
        return self.coil[-1][2]


class Faulty(Virtual33500B):
    """A generator that stays silent for its next answers, or takes no notice of being switched off."""

    silent, stuck = 0, False

    def steps(self, message):
        answer = yield from super().steps(message.replace("OUTP1 OFF", "*WAI") if Faulty.stuck else message)
        if answer and Faulty.silent:
            Faulty.silent -= 1
            return None
        return answer


@pytest.fixture
def world():
    return World()


@pytest.fixture
def faulty(monkeypatch):
    """The virtual bench with a generator whose faults a test can switch on."""
    monkeypatch.setattr(Faulty, "silent", 0)
    monkeypatch.setattr(Faulty, "stuck", False)
    monkeypatch.setitem(VIRTUAL_MODELS["generator"], "33500B", partial(_connect_generator, Faulty))
    return Faulty


def drive(bench, **changes):
    bench.generator.prepare(**{"waveform": "SIN", "frequency_hz": 30.0, "amplitude_vpp": 10.0} | changes)
    bench.generator.output = True


def drive_and(world, end):
    """The bench, opened, driving, and left by what `end` does; the world keeps it to look at."""
    with open_bench(virtual_wiring(world), KINDS) as bench:
        world.bench = bench
        drive(bench)
        end()


def assert_closed(bench):
    assert set(bench.instruments) == set(KINDS)
    for instrument in bench.instruments.values():
        with pytest.raises(NotConnected):
            instrument.identity()


# --- on every way out ---


def test_drive_and_light_are_joined_by_one_world(world):
    with open_bench(virtual_wiring(world), KINDS) as bench:
        bench.counter.prepare(gate_s=1.0, trigger_level_v=0.6)
        drive(bench)
        assert bench.clock is world.clock
        # 10 Vpp make 0.4 mT, which holds the top at 30 Hz; a reading scatters by 0.03 Hz
        assert world.coil[-1] == ("SIN", 30.0, pytest.approx(0.4e-3))
        bench.clock.sleep(20.0)
        assert bench.counter.frequency() == pytest.approx(30.0, abs=0.15)


def test_after_a_normal_end_the_drive_is_off_and_all_is_closed(world):
    drive_and(world, lambda: None)
    assert max(field for *_, field in world.coil) > 0
    assert world.field == 0
    assert_closed(world.bench)


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("physics"), Interrupted("SIGINT"), KeyboardInterrupt(), SystemExit()], ids=repr
)
def test_after_any_error_the_drive_is_off_and_the_error_is_reported(world, error):
    with pytest.raises(type(error)) as raised:
        drive_and(world, Mock(side_effect=error))
    assert raised.value is error
    assert world.field == 0
    assert_closed(world.bench)


def test_an_error_of_any_kind_in_the_first_try_does_not_keep_the_drive_on(world, monkeypatch):
    with open_bench(virtual_wiring(world), KINDS) as bench:
        drive(bench)
        switch_off, tries = bench.generator.off, []

        def interrupted_once():
            tries.append(1)
            if len(tries) == 1:
                raise EOFError  # of a protocol below PyVISA
            switch_off()

        monkeypatch.setattr(bench.generator, "off", interrupted_once)
    assert len(tries) == 2
    assert world.field == 0


def test_a_generator_that_stays_silent_is_reported_by_name_and_all_is_closed(world, faulty):
    with pytest.raises(OutputMayBeOn) as alarm:
        drive_and(world, lambda: setattr(faulty, "silent", 1000))
    assert alarm.value.address == VIRTUAL["generator"].address
    assert "THE DRIVE MAY STILL BE ON" in str(alarm.value)
    assert "generator.levilab" in str(alarm.value)
    assert isinstance(alarm.value, InstrumentError)
    assert_closed(world.bench)


def test_the_alarm_keeps_what_went_wrong_before_it(world, faulty):
    def end():
        faulty.silent = 1000
        raise ZeroDivisionError

    with pytest.raises(OutputMayBeOn) as alarm:
        drive_and(world, end)
    chain = [alarm.value]
    while chain[-1].__context__:
        chain.append(chain[-1].__context__)
    assert any(isinstance(error, ZeroDivisionError) for error in chain)


def test_an_output_that_does_not_go_off_is_reported(world, faulty):
    with pytest.raises(OutputMayBeOn, match="still on"):
        drive_and(world, lambda: setattr(faulty, "stuck", True))
    assert world.field > 0  # it was no false alarm


def test_a_generator_that_never_answered_is_silent_rather_than_perhaps_on(world, faulty):
    faulty.silent = 1000
    with pytest.raises(InstrumentError, match="no answer") as silence, open_bench(virtual_wiring(world), KINDS):
        pass
    assert not isinstance(silence.value, OutputMayBeOn)


def test_a_bench_without_a_drive_needs_nothing_switched_off(world):
    with open_bench(virtual_wiring(world), ("counter",)) as bench:
        assert set(bench.instruments) == {"counter"}
        bench.outputs_off()
    assert world.coil == []


def test_the_wire_log_reaches_every_instrument(world):
    traffic = []
    with open_bench(virtual_wiring(world), KINDS, log=lambda *line: traffic.append(line)):
        pass
    assert {address for address, *_ in traffic} == {VIRTUAL[kind].address for kind in KINDS}
    assert (VIRTUAL["generator"].address, ">", b"OUTP1 OFF\n") in traffic


def test_the_second_output_is_off_as_soon_as_the_bench_is_open_and_when_it_is_left(world, monkeypatch):
    made = []

    class LeftOn(Virtual33500B):
        """A generator that an earlier user has left on, on both channels."""

        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            self.settings |= {"1:output": True, "2:output": True}
            made.append(self)

    monkeypatch.setitem(VIRTUAL_MODELS["generator"], "33500B", partial(_connect_generator, LeftOn))
    with open_bench(virtual_wiring(world), KINDS):
        assert (made[0].settings["1:output"], made[0].settings["2:output"]) == (False, False)
        made[0].settings["2:output"] = True
    assert made[0].settings["2:output"] is False


# --- limits ---

TIGHT = Limits(drive_amplitude_vpp=4.0, drive_offset_v=1.0, drive_frequency_hz=50.0, drive_lowest_hz=5.0)


@pytest.mark.parametrize(
    ("name", "value"), [("amplitude", 4.1), ("offset", 1.1), ("frequency", 51.0), ("load", 50.0), ("output", True)]
)
def test_the_generator_of_an_open_bench_keeps_to_its_limits_by_itself(world, name, value):
    with open_bench(virtual_wiring(world, TIGHT), KINDS) as bench:
        with pytest.raises(OutOfRange, match=r"limits\.drive_\w+ in the bench file"):
            setattr(bench.generator, name, value)
        assert all(field == 0 for *_, field in world.coil)


def test_a_drive_with_an_offset_is_put_on_the_coil(world):
    with open_bench(virtual_wiring(world, TIGHT), KINDS) as bench:
        drive(bench, waveform="SQU", amplitude_vpp=4.0, offset_v=-1.0)
        assert (bench.generator.amplitude, bench.generator.offset, bench.generator.output) == (4.0, -1.0, True)


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        (Limits(drive_lowest_hz=41.0), r"= 40 is less than this bench allows, limits\.drive_lowest_hz = 41"),
        (Limits(drive_frequency_hz=39.0), r"= 40 is more than this bench allows, limits\.drive_frequency_hz = 39"),
        (Limits(drive_amplitude_vpp=9.0), r"= 10 is more than this bench allows, limits\.drive_amplitude_vpp = 9"),
    ],
)
def test_a_spin_down_that_the_bench_does_not_stand_is_refused_beforehand(limits, says):
    with pytest.raises(ConfigError, match=says):
        SpinSettings().check("spin", limits)
    SpinSettings().check("spin", Limits())


def test_a_drive_at_the_limits_is_allowed(world):
    limits = Limits(drive_amplitude_vpp=4.0, drive_frequency_hz=50.0)
    with open_bench(virtual_wiring(world, limits), KINDS) as bench:
        drive(bench, frequency_hz=50.0, amplitude_vpp=4.0)
        assert world.coil[-1] == ("SIN", 50.0, pytest.approx(4.0 / 2 * 0.08e-3))  # 0.08 mT/V


# --- the bench that is described ---


def described(**instruments):
    """A bench as bench.toml describes it, its addresses leading to the virtual one."""
    return described_wiring(BenchConfig(visa_library="@levilab", **instruments))


@pytest.fixture
def another_program():
    """Another program's link to the counter of the described bench."""
    with pyvisa.ResourceManager("realtime@levilab").open_resource(
        VIRTUAL["counter"].address, timeout=PATIENCE_MS
    ) as other:
        yield other


def test_while_it_is_open_no_other_program_gets_in_not_even_after_a_link_was_made_anew(another_program):
    with open_bench(described(**VIRTUAL), KINDS) as bench:
        for _ in range(2):
            with pytest.raises(pyvisa.VisaIOError) as refused:
                another_program.write("SENS:FREQ:GATE:TIME 100")
            assert refused.value.error_code == pyvisa.constants.StatusCode.error_resource_locked
            bench.reopen("counter")
    assert "53230A" in another_program.query("*IDN?")


def test_the_generator_stays_open_until_it_is_switched_off():
    with (
        open_bench(described(**VIRTUAL), KINDS),
        pyvisa.ResourceManager("realtime@levilab").open_resource(
            VIRTUAL["generator"].address, timeout=PATIENCE_MS
        ) as other,
    ):
        other.write("OUTP1 OFF")
        assert other.query("OUTP1?").strip() == "0"


def test_an_instrument_that_another_program_has_locked_is_reported_and_left_alone(another_program):
    another_program.lock_excl()
    with pytest.raises(Occupied, match="locked"), open_bench(described(**VIRTUAL), KINDS):
        pass
    assert another_program.query("SYST:ERR?").startswith("+0")


def test_an_instrument_that_is_not_described_is_asked_for_by_name():
    with (
        pytest.raises(ConfigError, match=r"add a table \[generator\]"),
        open_bench(described(counter=VIRTUAL["counter"]), KINDS),
    ):
        pass


def test_an_unknown_model_is_reported_with_its_key_and_the_known_ones():
    config = described(counter=InstrumentSettings(model="SR620", address="GPIB0::10::INSTR"))
    with pytest.raises(ConfigError, match=r"counter\.model = 'SR620'") as unknown, open_bench(config, ("counter",)):
        pass
    assert all(model.name in str(unknown.value) for model in COUNTERS)


def test_an_address_that_leads_to_another_instrument_is_reported_and_that_one_left_alone():
    swapped = InstrumentSettings(model="33500B", address=VIRTUAL["counter"].address)
    with (
        pytest.raises(WrongInstrument, match="check the address"),
        open_bench(described(counter=VIRTUAL["counter"], generator=swapped), KINDS),
    ):
        pass


def test_an_address_where_nothing_is_is_reported_after_the_drive_was_switched_off():
    traffic = []
    nowhere = InstrumentSettings(model="53230A", address="TCPIP0::absent::inst0::INSTR")
    with (
        pytest.raises(NotConnected, match="absent"),
        open_bench(
            described(counter=nowhere, generator=VIRTUAL["generator"]),
            ("generator", "counter"),
            log=lambda *line: traffic.append(line[1:]),
        ),
    ):
        pass
    assert (">", b"OUTP1 OFF\n") in traffic


# --- bench.toml ---


def written(folder, text, encoding="utf-8"):
    path = folder / "bench.toml"
    path.write_bytes(text.encode(encoding))
    return path


BENCH = """
[counter]
model = "53230A"
address = "TCPIP0::192.0.2.7::5025::SOCKET"

[limits]
drive_amplitude_vpp = 5.0

[spin]
gate_s = 2
"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_bench_is_read_with_or_without_a_byte_order_mark(tmp_path, encoding):
    config = read_bench(written(tmp_path, BENCH.lstrip(), encoding), Configuration)
    assert config.counter == InstrumentSettings(model="53230A", address="TCPIP0::192.0.2.7::5025::SOCKET")
    assert config.generator is None
    assert config.limits == Limits(drive_amplitude_vpp=5.0)
    assert settings_of(config, "spin") == SpinSettings(gate_s=2.0)


def test_an_empty_description_is_a_bench_without_instruments(tmp_path):
    assert read_bench(written(tmp_path, ""), Configuration) == Configuration()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[spin]\ngate = 1.0", "spin.gate is no key known here"),
        ("[conter]\nmodel = '53230A'", "conter"),
        ("[spin]\ngate_s = 'long'", "spin.gate_s = 'long'"),
        ("[spin]\ngate_s = -1", "spin.gate_s = '-1'"),
        ("[spin]\ngate_s = inf", "spin.gate_s = 'inf'"),
        ("[spin]\ndrive_waveform = 'SAW'", "'SIN', 'SQU', 'TRI' or 'NONE'"),
        ("[limits]\ndrive_amplitude_vpp = nan", "limits.drive_amplitude_vpp"),
        ("[counter]\nmodel = '53230A'", "counter.address: is missing"),
        ("counter = 3", "counter = '3'"),
        ("[spin]\ngate = 1\nlevel = 2", "(and 1 more)"),
        ("[spin\n", "; a TOML file is expected, as docs/bench.md describes"),
        ("[spin]\ngate_s = 1,0", "; write a decimal point, not a comma"),
        ("[spin]\ngate_s = 1 s", "; write the number without its unit"),
        ("[spin]\ngate_s = 12", "gate_s = 12 must be shorter than interval_s = 10"),
    ],
)
def test_what_is_wrong_with_a_description_is_reported_in_one_line_with_its_path(tmp_path, text, says):
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as wrong:
        read_bench(path, Configuration)
    message = str(wrong.value)
    assert message.startswith(f"{path}: ")
    assert says in message
    assert "\n" not in message
    assert isinstance(wrong.value, LevilabError)


def test_a_description_that_is_no_text_is_reported(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_bytes(b"\xff\xfe[\x00s\x00")  # UTF-16, as an editor may save it
    with pytest.raises(ConfigError, match="not readable as TOML"):
        read_bench(path, Configuration)


def test_a_description_that_is_missing_is_reported_with_what_to_do(tmp_path):
    with pytest.raises(ConfigError, match=r"no such file.*`mock`"):
        read_bench(tmp_path / "bench.toml", Configuration)


def test_a_description_does_not_change_once_it_is_read():
    with pytest.raises(ValueError, match="frozen"):
        BenchConfig().limits.drive_amplitude_vpp = 20.0


def test_a_described_virtual_bench_keeps_to_the_wall_clock(monkeypatch):
    wall = [1000.0]

    def sleep(duration):
        wall[0] += duration

    # one library serves all programs of a process: a top of its own for this test, whatever others have spun down
    monkeypatch.setattr(pyvisa.ResourceManager("realtime@levilab").visalib, "bench", None)
    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: wall[0])
    monkeypatch.setattr("instruments.clock.time.sleep", sleep)
    with open_bench(described(**VIRTUAL), ("counter",)) as bench:
        bench.counter.prepare(gate_s=0.05, trigger_level_v=0.6)
        assert bench.counter.frequency() == pytest.approx(30, abs=3)
    assert 1000.05 < wall[0] < 1060.0


def test_a_gaussmeter_is_left_alone_between_two_messages_on_the_clock_of_its_bench(world):
    # manual of the 425, page 50: 30 ms
    with open_bench(virtual_wiring(world), ("magnetometer",)) as bench:
        meter = bench.instruments["magnetometer"]
        before = world.clock.now()
        for _ in range(10):
            meter.transport.query("*IDN?")
        assert world.clock.now() - before >= 10 * meter.SERIAL["pause"]
