"""Phase lock: against tables, closed forms and signals that are made up."""

import numpy as np
import pytest

from analysis.errors import TooFewReadings
from analysis.precession.coherence import coherence, pulse_times, rayleigh_p

DT, DRIVE_HZ, PHASE = 1e-3, 30.013, 0.7
TIME = DT * np.arange(6000)
DRIVE = 5 * np.cos(2 * np.pi * DRIVE_HZ * TIME + PHASE)


def pulses(frequency, jitter=0.0, delay=0.004):
    """Pulses that follow the drive's maxima by a delay [s], with a jitter in turns."""
    count = int(5.9 * frequency)
    turns = np.arange(1, count) + jitter * np.random.default_rng(4).standard_normal(count - 1)
    return (turns - PHASE / (2 * np.pi)) / frequency + delay


def test_rayleighs_p_is_that_of_the_tables():
    # Zar, Biostatistical Analysis (1999), Table B.34: critical n R² for p = 0.05
    for n, critical in ((10, 2.919), (20, 2.957), (50, 2.981)):
        assert rayleigh_p((critical / n) ** 0.5, n) == pytest.approx(0.05, abs=5e-4)
    assert rayleigh_p(1.0, 200) < 1e-80


def test_the_mean_vector_of_jittering_pulses_is_that_of_their_distribution():
    found = coherence(pulses(DRIVE_HZ, jitter=0.05), DRIVE, DT, 30.0)
    # characteristic function of a normal phase: e^(−σ²/2), σ = 2π·0.05
    assert found.length == pytest.approx(np.exp(-((2 * np.pi * 0.05) ** 2) / 2), abs=0.01)
    assert found.drive_hz == pytest.approx(DRIVE_HZ, abs=1e-6)
    assert found.phase_rad == pytest.approx(2 * np.pi * DRIVE_HZ * 0.004, abs=0.08)  # 0.31/√177 rad, three of them
    assert abs(found.drift_hz) < 3 * found.u_drift_hz
    assert found.locked


def test_pulses_beside_the_drives_frequency_drift():
    found = coherence(pulses(DRIVE_HZ + 0.3, jitter=0.02), DRIVE, DT, 30.0)
    assert found.drift_hz == pytest.approx(0.3, abs=3 * found.u_drift_hz)
    assert not found.locked
    assert coherence(pulses(DRIVE_HZ + 1.0), DRIVE, DT, 30.0).p_random > 0.1
    with pytest.raises(TooFewReadings):
        coherence(np.arange(4.0), DRIVE, DT, 30.0)


def test_a_locked_top_may_swing_far_about_its_drive():
    regular = pulses(DRIVE_HZ)
    swinging = regular + 0.3 * np.sin(2 * np.pi * 0.27 * regular) / DRIVE_HZ  # by ±0.3 of a turn, in 3.7 s
    found = coherence(swinging, DRIVE, DT, 30.0)
    assert found.locked
    assert found.excursion_turns == pytest.approx(0.6, abs=0.05)


def test_a_doubled_and_a_missing_pulse_do_not_look_like_a_drift():
    regular = pulses(DRIVE_HZ, jitter=0.02)
    wrong = np.sort(np.append(np.delete(regular, 40), regular[100] + 0.4 / DRIVE_HZ))
    found = coherence(wrong, DRIVE, DT, 30.0)
    assert found.locked
    assert abs(found.drift_hz) < 3 * found.u_drift_hz


def test_cuts_of_a_noisy_beam_are_found_once_each():
    true = pulses(25.0, jitter=0.01)
    signal = sum(np.exp(-0.5 * ((TIME - t) / 0.003) ** 2) for t in true)
    signal = 1.2 - signal + 0.03 * np.random.default_rng(2).standard_normal(TIME.size)
    inside = true[(true > 0.02) & (true < TIME[-1] - 0.02)]
    found = pulse_times(signal, DT, start=-3.0) + 3.0
    found = found[(found > 0.02) & (found < TIME[-1] - 0.02)]
    # noise over the slope of a flank at half height, by two flanks: 0.03/(0.2/ms)/√2 = 0.1 ms; five of them
    np.testing.assert_allclose(found, inside, atol=5e-4)


def test_missing_samples_do_not_shift_the_pulses():
    beam = 1.0 - (np.cos(2 * np.pi * DRIVE_HZ * TIME + PHASE - 0.5) > 0.8)
    whole = coherence(pulse_times(beam, DT), DRIVE, DT, 30.0)
    holed, drive = beam.copy(), DRIVE.copy()
    holed[1000:1010] = drive[3000:3777] = np.nan
    found = coherence(pulse_times(holed, DT), drive, DT, 30.0)
    assert whole.pulses - 1 <= found.pulses <= whole.pulses
    assert found.phase_rad == pytest.approx(whole.phase_rad, abs=0.002)  # samples left out would shift it by a radian
    assert found.length == pytest.approx(whole.length, abs=0.002)
    for signal, beside in ((np.full_like(beam, np.nan), DRIVE), (beam, np.full_like(DRIVE, np.nan))):
        with pytest.raises(TooFewReadings):
            coherence(pulse_times(signal, DT), beside, DT, 30.0)


def test_a_last_pulse_half_a_turn_late_is_one_of_many_in_its_window():
    # against some dozen others it shortens their mean vector, and does not turn it
    regular = pulses(DRIVE_HZ)
    late = np.append(regular, regular[-1] + 1.5 / DRIVE_HZ)
    assert coherence(late, DRIVE, DT, 30.0).excursion_turns < 1e-3
