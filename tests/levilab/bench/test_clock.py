"""The clock of a sound card, measured and kept."""

import numpy as np
import pytest

from analysis.uncertainty import Estimate
from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope.sound import SamplesLost, SoundCard
from instruments.links.sound import SoundLink
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.oscilloscope.sound import VirtualSoundCard
from levilab.bench.bench import open_bench
from levilab.bench.clock import (
    ClockError,
    ClockTooFarOff,
    NoTone,
    TooFewBlocks,
    by_computer,
    by_tone,
    keep_clock,
    tone_in,
)
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings, read_bench
from levilab.bench.wiring import Wiring, described_wiring
from levilab.world.bench import practice_world, virtual_wiring

ADDRESS = "sound://oscilloscope.levilab"
RATE = 48_000.0
FOUND = ClockError(4.7e-5, 1.1e-6, 1e-8, RATE)


def card_of(seed, tone=1000.0):
    clock = VirtualClock()
    signal = lambda start, step, n: 0.5 * np.sin(2 * np.pi * tone * (start + step * np.arange(n)))  # noqa: E731
    twin = VirtualSoundCard(clock, signals={1: signal}, seed=seed)
    link = SoundLink(ADDRESS, library=library_for(VirtualBench({ADDRESS: twin})), clock=clock)
    return SoundCard(link, clock=clock), twin


def test_a_tone_gives_the_error_and_its_u_the_scatter():
    pulls = []
    for seed in range(20):
        driver, twin = card_of(seed)
        twin.noise = 0.02
        found = by_tone(driver, Estimate(1000.0, 1e-9, "Hz"), 2.0)
        pulls.append((found.value - twin.clock_error) / found.u)
    assert np.std(pulls) == pytest.approx(1.0, abs=0.5)  # three standard errors of 20


def test_the_u_of_the_tone_is_in_the_u_of_the_clock():
    found = by_tone(card_of(1)[0], Estimate(1000.0, 0.01, "Hz"), 2.0)
    assert found.u == pytest.approx(1e-5, rel=1e-3)
    assert found.of_comparison < 1e-7


@pytest.mark.parametrize("seed", [1, 2])
def test_the_clock_of_the_computer_gives_the_same(seed):
    driver, twin = card_of(seed)
    shares = []
    found = by_computer(driver, 60.0, 1e-7, shares.append)
    assert found.value == pytest.approx(twin.clock_error, abs=1e-8)  # no arrival is late on a virtual clock
    assert shares[-1] == 1.0


def test_what_is_no_clock_of_a_sound_card_is_refused():
    with pytest.raises(NoTone, match=r"% of the record's power is at 1000 Hz, at least 50 % are"):
        by_tone(card_of(1, tone=1300.0)[0], Estimate(1000.0, 0.01, "Hz"), 2.0)
    with pytest.raises(ClockTooFarOff, match=r"the clocks differ by -?0\.49 %"):
        by_tone(card_of(1, tone=1005.0)[0], Estimate(1000.0, 0.01, "Hz"), 2.0)
    with pytest.raises(NoTone, match="too short"):
        tone_in(np.zeros(100), RATE, 1000.0)
    driver, twin = card_of(1)
    twin.loses = [(5.0, 0.01, True)]
    with pytest.raises(SamplesLost, match="nothing was kept"):
        by_computer(driver, 60.0, 1e-7, lambda _: None)


@pytest.mark.parametrize("blocks", [0, 1, 3, 8])
def test_too_few_blocks_are_no_clock(blocks, monkeypatch):
    driver, _ = card_of(1)
    half_a_second = np.zeros((24_000, 1), np.int16)
    arrivals = iter([(half_a_second, 0.5 * k, False) for k in range(1, blocks + 1)])
    monkeypatch.setattr(driver.transport.input, "read", lambda _: next(arrivals))
    with pytest.raises(TooFewBlocks, match=f"came in {blocks} blocks, too few: take a longer `duration`"):
        by_computer(driver, 0.5 * blocks, 1e-5, lambda _: None)


SOUND = InstrumentSettings(model="sound", address="sound://USB")


def test_a_clock_is_kept_in_a_new_bench_file(tmp_path):
    path = tmp_path / "bench.toml"
    keep_clock(path, SOUND, FOUND)
    assert read_bench(path, BenchConfig).oscilloscope == SOUND.model_copy(
        update={"clock_error": 4.7e-5, "clock_u": 1.1e-6}
    )


BENCH = """# mine
count_with = "oscilloscope"

[oscilloscope]   # the lamp's
address = "sound://USB"
clock_u = 1e-4
model = "sound"  # cheap

[limits]
drive_offset_v = 1.0
"""


def test_a_clock_that_is_measured_again_replaces_its_lines_alone(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    keep_clock(path, SOUND, FOUND)
    keep_clock(path, SOUND, FOUND)
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if "clock_" not in line]
    assert lines == [line for line in BENCH.splitlines() if "clock_" not in line]
    config = read_bench(path, BenchConfig)
    assert (config.oscilloscope.clock_error, config.oscilloscope.clock_u) == (4.7e-5, 1.1e-6)


def test_where_the_oscilloscope_has_no_table_its_lines_are_said(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text('oscilloscope = {model = "sound", address = "sound://USB"}\n', encoding="utf-8")
    with pytest.raises(ConfigError, match=r"has no line \[oscilloscope\]: add clock_error = 4\.7000e-05 and clock_u"):
        keep_clock(path, SOUND, FOUND)


def test_a_clock_is_not_kept_with_another_instrument(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"its oscilloscope is at 'sound://USB', measured was the clock of sound://"):
        keep_clock(path, InstrumentSettings(model="sound", address="sound://"), FOUND)


def test_a_clock_that_is_known_corrects_the_records_of_a_sound_card_alone():
    wiring = virtual_wiring(practice_world(), models={"oscilloscope": "sound"})
    changed = {"clock_error": 4e-5, "clock_u": 1e-6}

    def with_clock(kind):
        instruments = {**wiring.instruments, kind: wiring.instruments[kind].model_copy(update=changed)}
        return Wiring(instruments, wiring.limits, wiring.library, wiring.clock)

    with open_bench(with_clock("oscilloscope"), ("oscilloscope",)) as bench:
        assert isinstance(bench.oscilloscope, SoundCard)
        assert bench.oscilloscope.rate == RATE * (1 + 4e-5)
    with (
        pytest.raises(ConfigError, match=r"counter\.clock_error = 4e-05 is for a sound card alone"),
        open_bench(with_clock("counter"), ("counter",)),
    ):
        pass


def test_a_bench_without_a_counter_says_that_its_oscilloscope_can_count():
    with pytest.raises(ConfigError, match=r"no counter: add a table \[counter\].*or count_with = \"oscilloscope\""):
        described_wiring(BenchConfig(oscilloscope=SOUND)).describe("counter")
    described = described_wiring(BenchConfig(oscilloscope=SOUND, count_with="oscilloscope"))
    assert described.describe("counter") == SOUND
