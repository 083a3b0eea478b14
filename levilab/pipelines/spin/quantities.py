"""The quantities of a spin frequency, and frequency against time as columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from analysis.uncertainty import Estimate
from levilab.pipelines.row import Column, Quantity, columns_of, entry

if TYPE_CHECKING:
    from collections.abc import Callable

    from analysis.pulses.result import SpinFrequency
    from levilab.pipelines.spin.analysis import SpinRun


def _correlation(k: int) -> Callable[[SpinFrequency], Any]:
    """Return a function to the correlation of a pair; None without a bend, which needs no such."""
    return lambda spin: spin.correlations[k] if spin.bend else None


#: With a bend the frequency at another time has an uncertainty that needs these.
CORRELATIONS = ("correlation_frequency_chirp", "correlation_frequency_bend", "correlation_chirp_bend")
#: Of `analysis.pulses.result.SpinFrequency`.
QUANTITIES = (
    Quantity("frequency", "Hz", "spin at reference_time_s; of a long record or of several, in the middle one"),
    Quantity("chirp", "Hz/s", "its change with time", "slope"),
    Quantity("bend", "Hz/s^2", "the change of the chirp, where a third degree was fitted", optional=True),
    Quantity("phase", "1", "turns at the reference time", column=False),
    Quantity("reference_time", "s", "time of the frequency", has_u=False),
    Quantity("bound", "Hz", "Cramér–Rao bound of the frequency's uncertainty", has_u=False),
    Quantity("scatter", "s", "standard deviation of one pulse's time", has_u=False),
    Quantity("snr", "dB", "signal to noise", of="snr_db", has_u=False),
    *(
        Quantity(name, "1", "", of=_correlation(k), has_u=False, optional=True, column=False)
        for k, name in enumerate(CORRELATIONS)
    ),
)


def _axis(k: int) -> Callable[[SpinRun], Estimate | None]:
    """Return a function to the amplitude in an axis; None where the record lacks it."""

    def amplitude(run: SpinRun) -> Estimate | None:
        line = run.line
        return Estimate(line.amplitude[k], line.u_amplitude[k], "T") if line and k < len(line.amplitude) else None

    return amplitude


#: Of a run; all but the last of a magnetometer.
OF_A_RUN = (
    *(
        Quantity(
            f"amplitude_{k}",
            "T",
            f"of the turning field, axis {k}",
            of=_axis(k - 1),
            optional=True,
            fine=True,
        )
        for k in (1, 2, 3)
    ),
    Quantity("transverse_moment", "A m^2", "the part of the moment that turns", "μ_t", of="transverse", optional=True),
    Quantity("moment_tilt", "rad", "angle between moment and axis", "tilt", of="tilt", optional=True),
    Quantity("drive_offset", "Hz", "spin less the frequency of the drive, while it is held", "ν − ν_d", optional=True),
)

SPIN_ROW = (
    *columns_of(QUANTITIES),
    entry("method", "text", "how the pulses were found"),
    entry("pulses", "count", "pulses that were found", "result.spin.pulses"),
    entry("missing", "count", "pulses that are missing", "result.spin.missing"),
    entry("doubled", "count", "pulses that were counted twice", "result.spin.doubled"),
    entry("records", "count", "windows or records with a frequency each", "result.series.time"),
    Column("notes", "text", "names of the findings",
           lambda part: " ".join(note["name"] for note in part["result"]["notes"])),
)  # fmt: skip
