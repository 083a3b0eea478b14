"""A sound card as an oscilloscope: its records, and what may go wrong with them, on its virtual twin."""

import math

import numpy as np
import pytest

from analysis.pulses import spin_of_trace
from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired
from instruments.drivers.oscilloscope.sound import SamplesLost, SilentInput, SoundCard, step_of_arrivals
from instruments.errors import NoAnswer, NotConnected, OutOfRange
from instruments.links.sound import InputDevice, SoundLink, choose_input
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.oscilloscope.sound import VirtualSoundCard
from support.light import pulses

ADDRESS = "sound://oscilloscope.levilab"
RATE = 48_000.0


def waves(start, step, n):
    return 0.5 * np.sin(2 * np.pi * 25.0 * (start + step * np.arange(n)))


class Card:
    """A virtual sound card, and the driver at its link."""

    def __init__(self, seed=0):
        self.clock = VirtualClock()
        self.twin = VirtualSoundCard(self.clock, signals={1: pulses(25.0), 2: waves}, seed=seed)
        self.bench = VirtualBench({ADDRESS: self.twin})
        self.driver = SoundCard(SoundLink(ADDRESS, library=library_for(self.bench), clock=self.clock), clock=self.clock)

    def record(self, channel=1, **changes):
        self.driver.prepare(**{"channels": (1, 2), "duration_s": 2.0} | changes)
        self.driver.acquire(timeout_s=1.0)
        return self.driver.trace(channel)


@pytest.fixture
def card():
    return Card()


def test_a_record_has_its_trigger_in_the_middle(card):
    trace = card.record(duration_s=0.5, trigger_level_v=0.3)
    assert trace.codes.dtype == np.uint16
    assert trace.codes.size == RATE / 2
    middle = round(-trace.t0_s / trace.dt_s)
    assert middle == RATE / 4
    assert trace.volts[middle - 1] < 0.3 <= trace.volts[middle]


def test_both_channels_are_of_the_same_time(card):
    card.record()
    # a sine that passes 0 in the middle of the pulses; the high-pass moves both, up to 40 degrees at 20 Hz
    tape, coil = (spin_of_trace(card.driver.trace(n).volts, 1 / card.driver.trace(n).dt_s) for n in (1, 2))
    assert tape.frequency.value == pytest.approx(coil.frequency.value, abs=1e-3)


def test_a_pulse_is_two_sided_as_the_input_is_coupled_by_a_capacitor(card):
    volts = card.record().volts
    assert np.mean(volts) == pytest.approx(0.0, abs=0.01)
    assert volts.min() < -0.04
    assert 0.5 < volts.max() < 1.1 / card.twin.full_scale_v


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_frequency_is_off_by_the_clock_until_that_is_known(seed):
    card = Card(seed)
    error = card.twin.clock_error
    assert 1e-6 < abs(error) < 2e-4
    # hum is looked for at 50 Hz, twice the spin: that moves it by 1 µHz
    found = spin_of_trace(card.record(duration_s=4.0).volts, RATE).frequency
    assert found.value * (1 + error) == pytest.approx(25.0, abs=max(4 * found.u, 2e-6))
    card.driver.clock_error, card.driver.clock_u = error, 1e-7
    trace = card.record(duration_s=4.0)
    found = spin_of_trace(trace.volts, 1 / trace.dt_s).frequency
    assert found.value == pytest.approx(25.0, abs=max(4 * found.u, 2e-6))
    assert card.driver.settings()["clock_u"] == 1e-7


@pytest.mark.parametrize("says_so", [True, False])
def test_a_record_is_cut_at_a_loss_and_never_joined(card, says_so):
    card.driver.prepare(duration_s=2.0, sweep="auto")
    card.twin.loses = [(1.6, 0.011, says_so)]  # in a record that begins at 0.2 s
    card.driver.acquire(timeout_s=1.0)
    parts = []
    with pytest.raises(SamplesLost, match=r"1\.4\d? s after the beginning.*1\.4\d? of its 2 s are") as lost:
        card.driver.trace(1, lambda part, points: parts.append((part.codes.size, points)))
    assert parts == [(lost.value.kept.codes.size, 2 * RATE)]
    found = spin_of_trace(lost.value.kept.volts, RATE).frequency
    assert found.value * (1 + card.twin.clock_error) == pytest.approx(25.0, abs=4 * found.u)


def test_a_loss_before_the_trigger_begins_the_record_again(card):
    card.twin.loses = [(0.8, 0.011, True)]
    trace = card.record()  # half of it would have come before 1.2 s
    assert trace.codes.size == 2 * RATE
    found = spin_of_trace(trace.volts, RATE).frequency
    assert found.value * (1 + card.twin.clock_error) == pytest.approx(25.0, abs=4 * found.u)


def test_blocks_that_are_late_for_a_while_are_no_loss():
    ends = 480 * np.arange(1, 501)
    late = np.where((np.arange(500) // 20) % 2, 0.08, 0.0) * np.random.default_rng(1).random(500)
    assert step_of_arrivals(late, ends, RATE) is None
    assert step_of_arrivals(late + 1e-4 * ends / RATE, ends, RATE) is None  # a clock that is 100 ppm off
    assert step_of_arrivals(late[:3], ends[:3], RATE) is None


def test_samples_that_come_twice_are_a_step_too():
    ends = 480 * np.arange(1, 501)
    late = 1e-3 * np.random.default_rng(1).random(500) - 0.01 * (np.arange(500) >= 300)
    assert step_of_arrivals(late, ends, RATE) == 300


def test_an_input_that_vanishes_is_not_connected(card):
    card.record()
    card.twin.unplugged_at = card.clock.now() + 1.0
    with pytest.raises(NotConnected, match=r"no samples for 2 s: is it unplugged"):
        card.record()
    with pytest.raises(NothingAcquired):
        card.driver.trace(1)
    card.twin.unplugged_at = math.inf
    card.driver.transport.reopen()
    assert card.record().codes.size == 2 * RATE


def test_an_input_that_gives_only_zeros_says_who_may_forbid_the_microphone(card):
    card.twin.muted = True
    for sweep in ("normal", "auto"):
        with pytest.raises(SilentInput, match=r"only zeros.*muted\?.*macOS.*Privacy & Security, Microphone"):
            card.record(sweep=sweep)
    card.twin.muted = False
    card.record()
    card.twin.muted = True  # a noise gate gives zeros, too, once the top has fallen
    assert not (card.record(sweep="auto").codes - (1 << 15)).any()
    with pytest.raises(NeverTriggered, match=r"no trigger at 0 V on channel 1 within 1 s"):
        card.record()


def test_samples_beyond_the_range_are_clipped(card):
    card.twin.gain = 3.0
    trace = card.record()
    assert 0.005 < trace.clipped.mean() < 0.1
    assert trace.volts.max() == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    "wanted",
    [{"coupling": "DC"}, {"channels": (3,)}, {"trigger_source": 3}, {"trigger_level_v": 1.2}, {"sweep": "none"}],
)
def test_a_setting_that_a_sound_card_does_not_have_is_refused(card, wanted):
    with pytest.raises(OutOfRange):
        card.record(**wanted)


def test_the_link_knows_its_identity_and_no_other_message(card):
    assert card.driver.transport.query("*IDN?").split(",")[1] == "sound"
    with pytest.raises(NoAnswer):
        card.driver.transport.query(":WAV:DATA?")
    card.driver.close()
    with pytest.raises(NotConnected, match="was closed"):
        card.driver.transport.reopen()


def device(number, name, host="ALSA", *, default=False):
    return InputDevice(number, name, host, 2, RATE, default)


DEVICES = (
    device(0, "Mikrofon (USB)", "MME"),
    device(3, "Mikrofon (USB)", "WASAPI", default=True),
    device(4, "Line In", "WASAPI"),
    device(5, "Line In 2", "WASAPI"),
)


@pytest.mark.parametrize(("name", "number"), [("", 3), ("0", 0), ("mikro", 3), ("Line In", 4), ("in 2", 5)])
def test_an_input_is_named_by_number_or_part_of_its_name(name, number):
    assert choose_input("sound://", name, DEVICES).number == number


@pytest.mark.parametrize(
    ("name", "there", "why"),
    [
        ("lin", DEVICES, "several inputs have 'lin' in their name: name one of 4: Line In .WASAPI.; 5: Line In 2"),
        ("coil", DEVICES, "no input has 'coil' in its name: name one of 0: Mikrofon"),
        ("", (), "no sound input: plug a microphone"),
    ],
)
def test_an_input_that_is_not_one_is_refused_with_those_that_are(name, there, why):
    with pytest.raises(NotConnected, match=why):
        choose_input("sound://", name, there)


def test_an_address_that_is_none_is_refused():
    with pytest.raises(NotConnected, match=r"expected sound://NAME\?rate=48000"):
        SoundLink("sound://x?speed=3", library="@py")
