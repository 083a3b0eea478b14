"""Lines of made-up signals: found where they are, as high as they are, and none where there is but noise."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from analysis import lines as module
from analysis.errors import NotFinite, TooFewReadings
from analysis.lines import ABOVE_NOISE, amplitude_spectrum, lines_of_signals, spectral_lines


def signal(lines, n=8000, rate=200.0):
    t = np.arange(n) / rate
    return sum((a * np.exp(1j * (2 * np.pi * f * t + phase)) for f, a, phase in lines), np.zeros(n, complex))


@given(st.floats(-99, 99), st.floats(-3, 3))
@example(30.0, 0.0)  # on a bin
def test_a_line_alone_is_found_at_its_place_between_the_bins(frequency, phase):
    found = spectral_lines(signal([(frequency, 0.01, phase)]), 200.0)
    line = found.lines[0]
    # the ratio of two bins is exact up to 1/n² of a bin, 1/40 Hz: 4e-10 Hz
    assert line.frequency == pytest.approx(frequency, abs=2e-9)
    assert line.amplitude == pytest.approx(0.01, rel=1e-7)
    assert np.angle(np.exp(1j * (line.phase - phase))) == pytest.approx(0, abs=1e-6)
    assert len(found.lines) == 1


LEVITRON = [
    (30.0, 4.1e-3, 0.3),
    (7.31, 9.6e-3, 1.0),
    (42.2, 5e-4, 2.0),
    (-0.589, 2e-4, -1.0),
    (0.772, 3e-4, 0.5),
    (30.33, 6e-5, 0.1),
    (29.67, 5e-5, 0.2),
]


def test_lines_of_a_levitron_are_resolved_though_one_is_200_times_weaker():
    found = spectral_lines(signal(LEVITRON), 200.0)
    assert len(found.lines) == len(LEVITRON)
    for line, (frequency, amplitude, _) in zip(found.lines, sorted(LEVITRON, key=lambda line: -line[1]), strict=True):
        assert line.frequency == pytest.approx(frequency, abs=0.01 * found.resolution)
        assert line.amplitude == pytest.approx(amplitude, rel=0.01)


def test_two_lines_in_one_bin_are_not_told_as_two():
    found = spectral_lines(signal([(7.30, 1.0, 0.0), (7.308, 0.9, 0.0)]), 200.0, weakest=0.5)
    assert found.resolution == pytest.approx(2 / 40)
    assert len(found.lines) == 1


def test_a_signal_has_the_same_bits_alone_and_among_others(monkeypatch):
    rng = np.random.default_rng(1)
    signals = np.array([signal(LEVITRON[: k % 8], n=503) + 1e-5 * rng.normal(size=503) for k in range(19)])
    alone = [spectral_lines(one, 200.0) for one in signals]
    for together in (1, 503 * 7, 10**6):
        monkeypatch.setattr(module, "TOGETHER", together)
        assert lines_of_signals(signals, 200.0) == alone


def test_the_shape_that_is_taken_away_is_the_transform_of_a_wave():
    n, bins = 100, np.arange(100)
    for offset in (0.0, 1e-13, 0.37, -0.5):
        wave = np.exp(2j * np.pi * (7 + offset) * np.arange(n) / n) * (1 - np.cos(2 * np.pi * np.arange(n) / n)) / n
        shape = module._shape(np.array(offset), bins - 7, n) * np.exp(1j * np.pi * offset)
        assert shape == pytest.approx(np.fft.fft(wave), abs=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_has_no_line_and_a_line_in_noise_stands_out_alone(seed):
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=8000) + 1j * rng.normal(size=8000)
    assert spectral_lines(noise, 200.0).lines == ()
    # a bin of noise is about √2·√(1.5/8000) = 0.019 high: this line stands at ten times that
    found = spectral_lines(noise + signal([(12.345, 0.2, 0.0)]), 200.0)
    assert [line.frequency for line in found.lines] == [pytest.approx(12.345, abs=0.01)]
    assert ABOVE_NOISE * 0.019 < 0.2


def test_no_more_lines_than_asked_for_and_none_weaker():
    assert len(spectral_lines(signal(LEVITRON), 200.0, most=2).lines) == 2
    assert len(spectral_lines(signal(LEVITRON), 200.0, weakest=0.1).lines) == 2


def test_a_signal_that_is_zero_has_no_line():
    assert spectral_lines(np.zeros(100, complex), 10.0).lines == ()


def test_the_spectrum_shows_a_line_as_high_as_it_is():
    frequency, amplitude = amplitude_spectrum(signal([(-30.0, 0.7, 0.0)]), 200.0)
    assert np.all(np.diff(frequency) > 0)
    assert amplitude.max() == pytest.approx(0.7, rel=1e-9)
    assert frequency[amplitude.argmax()] == pytest.approx(-30.0, abs=1e-9)


def test_what_cannot_be_analyzed_is_refused():
    with pytest.raises(TooFewReadings, match="12"):
        spectral_lines(np.zeros(12, complex), 10.0)
    with pytest.raises(NotFinite):
        spectral_lines(np.array([0.0] * 40 + [np.nan], complex), 10.0)
