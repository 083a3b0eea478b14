"""Any file with samples or pulse times, recognised by its first bytes."""

from collections.abc import Mapping
from pathlib import Path

from levilab.errors import UsageError
from levilab.formats.kinds import AUDIO, kind_of_bytes
from levilab.formats.layout import ALIGNED
from levilab.formats.table import file_errors
from levilab.formats.texts import SPREADSHEETS, TEXTS, locate, texts_of
from levilab.formats.waveforms.audio import read_audio
from levilab.formats.waveforms.header import NoWaveform, dialect_of, says_its_step
from levilab.formats.waveforms.npy import read_npy
from levilab.formats.waveforms.pulse_times import OTHER_COLUMNS, read_column
from levilab.formats.waveforms.rows import read_head
from levilab.formats.waveforms.samples import read_samples
from levilab.formats.waveforms.scope_binary import SUFFIXES, read_scope_binary
from levilab.formats.waveforms.sigrok import is_sigrok, read_sigrok
from levilab.formats.waveforms.wav import read_wav
from levilab.formats.waveforms.waveform import PulseTimes, Waveform

#: How names of files end that may hold samples, readings or pulse times, where a folder is searched.
SEARCHED = TEXTS | SPREADSHEETS | SUFFIXES | {".wav", ".npy", ".zip", ".sr", *AUDIO.suffixes}


def read_record(
    path: Path, *, columns: Mapping[str, str] | None = None, rate: float | None = None, guess: bool = True
) -> Waveform | PulseTimes:
    """Read samples or pulse times: sound, NumPy, a scope's CSV or binary file, CSV with times, a column of times.

    Args:
        path: the file.
        columns: `t` names the column of times of a table whose titles are not known; `f` that of times from pulse to
            pulse, with their unit: 1 [us].
        rate: samples per second [Hz]; goes before what the file says.
        guess: whether one column without a title is taken for pulse times.

    Raises:
        NoWaveform: it is sound perhaps, but holds neither.
        TableError: it is damaged, contradicts itself, or needs what is missing.
        UsageError: the rate is none.
    """
    if rate is not None and not 0 < rate < 1e15:
        raise UsageError("rate", "samples per second are expected, a number above 0 [Hz]", value=rate)
    with file_errors(path):
        file, inside = locate(path)
        record = None if inside else _read_binary(path, rate)
        if record is not None:
            return record
        texts = [text for text in texts_of(file) if not inside or text.path == path]
        if len(texts) != 1 or texts[0].titles:
            what = "is read for readings alone, as several sheets or runs and serial logs are: save samples as CSV"
            raise NoWaveform(path, what)
        head = read_head(path, texts[0])
        dialect = ALIGNED if texts[0].aligned else dialect_of(head)
        alone = dialect.separator is None and all(len(dialect.split(line)) < 2 for line in head.lines[-20:])
        if alone and not says_its_step(head, dialect):
            return read_column(head, dialect, rate, columns=columns or {}, guess=guess)
        if set(columns or ()) - {"t", "time_s"}:
            raise NoWaveform(path, OTHER_COLUMNS)
        return read_samples(head, dialect, columns=columns or {}, rate=rate)


def _read_binary(path: Path, rate: float | None) -> Waveform | PulseTimes | None:
    """Read a file that is no text; None: it may be text."""
    with path.open("rb") as stream:
        magic = stream.read(64)
    if magic.startswith(b"\x93NUMPY"):
        return read_npy(path, rate)
    if magic[:4] in {b"RIFF", b"RIFX", b"RF64"} and magic[8:12] == b"WAVE":
        read = read_wav
    elif kind_of_bytes(magic) is AUDIO:
        read = read_audio
    elif magic.startswith(b"PK") and is_sigrok(path):
        read = read_sigrok
    elif path.suffix.casefold() in SUFFIXES:
        read = read_scope_binary
    else:
        return None
    return read(path).at_rate(rate)
