"""A spin frequency as a row of a table."""

from __future__ import annotations

from levilab.pipelines.row import Column, entry, estimate, value

SPIN_ROW = (
    *estimate("frequency", "Hz", "spin at reference_time_s; of a long record or of several, in the middle one"),
    *estimate("chirp", "Hz/s", "its change with time"),
    *estimate("bend", "Hz/s^2", "the change of the chirp, where a third degree was fitted"),
    value("reference_time", "s", "time of the frequency"),
    value("bound", "Hz", "Cramér–Rao bound of the frequency's uncertainty"),
    value("scatter", "s", "of one pulse's time"),
    value("snr", "dB", "signal to noise"),
    entry("method", "text", "how the pulses were found"),
    entry("pulses", "count", "pulses that were found", "result.spin.pulses"),
    entry("missing", "count", "pulses that are missing", "result.spin.missing"),
    entry("doubled", "count", "pulses that were counted twice", "result.spin.doubled"),
    entry("records", "count", "windows or records with a frequency each", "result.series.time"),
    Column("notes", "text", "names of the findings",
           lambda part: " ".join(note["name"] for note in part["result"]["notes"])),
)  # fmt: skip
