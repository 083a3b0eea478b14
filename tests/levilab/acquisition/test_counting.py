"""Counts of a coasting top, one after another, and which of them are readings."""

from types import SimpleNamespace

import pytest

from levilab.acquisition.counting import AnotherTop, FreeTop, Missed
from levilab.texts.text import Text


class Bench:
    """A counter that counts these spins [Hz], one each 10 s, and what was said of them."""

    last, SIGNAL = None, SimpleNamespace(name="light pulses")

    def __init__(self, *spins):
        self.spins, self.time = iter(spins), 90.0
        self.takes, self.events, self.warnings = [], [], []

    def frequency(self):
        self.time += self.takes.pop(0) if self.takes else 5.0
        return next(self.spins)

    def top(self, *before):
        session = SimpleNamespace(
            bench=SimpleNamespace(counter=self),
            settings=SimpleNamespace(reading_u_hz=None, gate_s=5.0),
            now=lambda: self.time,
            check_settings=lambda _: None,
            event=lambda kind, text, **_: self.events.append((kind, text)),
            warn=lambda text, **values: self.warnings.append(Text(text, **values)),
            saw=lambda *_: None,
        )
        return FreeTop(session, [{"time_s": time, "spin_frequency_hz": spin} for time, spin in before])


def test_a_top_that_was_set_spinning_meanwhile_is_recognised():
    """As after a resume: 31 Hz, then 39 Hz twice; a single pair of such counts may be a disturbance."""
    bench = Bench(39.0, 39.0, 30.3, 39.0, 39.0, 38.9, 38.8, 38.7, 38.6)
    top = bench.top((70.0, 31.6), (80.0, 31.3), (90.0, 31.0))
    assert top.read() is None
    assert top.missed == [Missed.FASTER]
    assert top.read()["spin_frequency_hz"] == 30.3
    assert (top.read(), top.read()) == (None, None)
    with pytest.raises(AnotherTop, match=r"38\.6 Hz, \d+ s after 30\.3 Hz.*coasts gains no spin.*begin a new run"):
        top.read()
    assert top.fall() == ""


def test_counts_of_twice_the_spin_are_no_readings_and_warned_of_once():
    bench = Bench(61.8, 61.7, 61.4, 61.3, 30.1)
    top = bench.top((90.0, 31.0))
    assert (top.read(), top.read()) == (None, None)
    assert top.missed == [Missed.MULTIPLE] * 2
    assert top.fall() == ""  # it is up
    (warning,) = bench.warnings
    assert "61.7 Hz after 31 Hz, 2 times what follows" in warning
    assert "second bright mark" in warning
    assert top.read()["spin_frequency_hz"] == 30.1


def test_after_a_miscount_the_true_spin_is_taken_again():
    """15.5 Hz could be; 30.8 Hz twice after it shows that it was not."""
    bench = Bench(30.8, 30.7, 30.4)
    top = bench.top((80.0, 31.2), (90.0, 15.5))
    reading = top.read()
    assert reading["spin_frequency_hz"] == 30.7
    assert bench.events[-1] == ("miscounted", "the reading before, 15.5 Hz, was a miscount")
    assert top.read()


def test_a_lower_spin_that_two_counts_agree_on_is_a_reading():
    top = Bench(12.0, 12.0).top((90.0, 31.0))  # touched
    assert top.read()["spin_frequency_hz"] == 12.0


@pytest.mark.parametrize(("spin", "taken"), [(31.9, True), (15.4, True), (15.0, False), (32.6, False), (40.0, False)])
def test_a_first_count_is_taken_from_half_of_the_last_spin_to_five_per_cent_more(spin, taken):
    """The gate's middle is 2.5 s after the last reading: a top loses half at once, and half again each 100 s."""
    bench = Bench(spin, None)
    reading = bench.top((90.0, 31.0)).read()
    assert (reading is not None) is taken
    assert bool(bench.events) is not taken


@pytest.mark.parametrize(("dark_s", "by"), [(8.0, 104), (30.0, 126)])  # the second with its lid closed for 22 s
def test_a_top_fell_before_the_end_of_the_count_that_misses_it(dark_s, by):
    """A count takes 7 s, since a multimeter settles first; nothing is waited for longer."""
    bench = Bench(30.9, None, None)
    bench.takes = [7.0, dark_s, 8.0]
    top = bench.top((80.0, 31.0))
    assert top.read()["time_s"] == pytest.approx(97.0 - 2.5, abs=0.02)
    assert top.read() is None
    assert f"the top fell between 94.5 s and {by}.0 s" in top.fall()


def test_a_count_during_which_the_computer_stood_still_is_made_again():
    """Its time is not known: of a top that loses 0.1 Hz/s, 9 s are 30 u of a reading."""
    bench = Bench(30.9, 30.8, 30.7)
    bench.takes = [5.0, 14.0, 5.0]
    top = bench.top((90.0, 31.0))
    first, second = top.read(), top.read()
    assert (first["spin_frequency_hz"], second["spin_frequency_hz"]) == (30.9, 30.7)
    ((kind, text),) = bench.events
    assert kind == "left out"
    assert "took 14.0 s, 5.0 s at most are usual: the computer stood still" in text


def test_a_counter_that_is_always_slow_is_believed():
    bench = Bench(30.4, 30.3, 30.2, 29.9)
    bench.takes = [20.0, 20.0, 20.0, 5.0]
    top = bench.top((90.0, 31.0))
    assert top.read()
    assert top.read()
