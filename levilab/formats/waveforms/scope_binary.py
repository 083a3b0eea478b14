"""Binary records of oscilloscopes, through RigolWFM, an extra."""

import contextlib
import io
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from levilab.formats.columns import TableError
from levilab.formats.waveforms.waveform import Signal, Waveform, check_count, check_step
from levilab.software import how_to_install
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: How the names of such files end.
SUFFIXES = frozenset({".wfm", ".bin", ".isf", ".trc", ".wvf"})
#: Evenly spaced to this part of a step.
_EVEN = 0.01


def read_scope_binary(path: Path) -> Waveform:
    """Read a scope's own file: Rigol, Tektronix, Keysight, Siglent, LeCroy, Rohde & Schwarz, Yokogawa.

    The file is read into memory as a whole: RigolWFM knows no other way.

    Raises:
        TableError: RigolWFM is not installed, or does not read the file.
    """
    try:
        from RigolWFM.wfm import Wfm  # with matplotlib and requests
    except ImportError as error:
        what = "is a scope's file, and needs the extra scope (RigolWFM, which is not installed): {how}, or export CSV"
        raise TableError(path, what, how_to_install("scope")) from error
    try:
        with warnings.catch_warnings(action="ignore"), contextlib.redirect_stdout(io.StringIO()) as _, \
                contextlib.redirect_stderr(io.StringIO()):  # fmt: skip
            record = Wfm.from_file(str(path))
            channels = [(c, np.asarray(c.volts, np.float64)) for c in record.channels if c.volts is not None]
    except Exception as error:
        raise TableError(path, "is not read by RigolWFM: export it as CSV") from error
    channels = [(c, volts) for c, volts in channels if volts.size]
    if not channels:
        raise TableError(path, "holds no channel that was on: export it as CSV")
    first, volts = channels[0]
    counts = {len(volts) for _, volts in channels}
    step = float(first.seconds_per_point)
    if len(counts) > 1:
        raise TableError(path, "has channels of {a} and {b} samples: export it as CSV", min(counts), max(counts))
    check_count(path, len(volts))
    check_step(path, step)
    times = np.asarray(first.times, np.float64)
    start = float(times[0]) if times.size else 0.0
    samples = [volts for _, volts in channels]
    if not all(bool(np.isfinite(volts).all()) for volts in samples):
        raise TableError(path, "has samples that are no numbers: export it as CSV")

    def read(signal: int) -> Iterator[Array]:
        yield samples[signal]

    signals = tuple(Signal(f"CH{c.channel_number}") for c, _ in channels)
    remarks = [*_about_times(path, times, step), *_about_volts(path, f"{record.parser_name} {record.header_name}")]
    return Waveform(path, "scope's binary file", start, step, len(volts), signals, read, tuple(remarks))


def _about_times(path: Path, times: Array, step: float) -> list[str]:
    """Return a warning if RigolWFM's times are not as far apart as it says."""
    mean = float(times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else step
    if abs(mean / step - 1) <= _EVEN:
        return []
    said = "{name:s}: RigolWFM says an interval of {step:g} s and gives times {mean:g} s apart: compare with CSV"
    return [of_file("interval", Text(said, path.name, step, mean))]


def _about_volts(path: Path, model: str) -> list[str]:
    """Return the fault found with the volts of a family of scopes."""
    if not any(name in model.casefold() for name in ("1000z", "1054z", "1074z", "1104z")):
        return []
    said = "{name:s}: RigolWFM's volts of a DS1000Z are wrong (by 0.4 V, and 11 %); times hold, for heights export CSV"
    return [of_file("volts", Text(said, path.name))]
