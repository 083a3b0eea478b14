"""Make the sample data: spin-downs, limits, oscilloscope records, a scan and, on demand, a sweep, as run folders.

The thesis prints the constants of four spin-downs, C₁ and C₂ of unweighted straight lines, but none of their
readings.  These readings are made up so that they give those constants: the law of a laminar disc from about
40 Hz, a reading each 10 s, noise N(0, 0.03 Hz), start and constant solved for so that the straight lines
return the published C₁ and C₂, rounded to 0.01 Hz.  They are not the author's data.

The files in scope-files/ all hold the same synthetic half second of a tape that passes a phototransistor 30 times a
second, written as several makers' oscilloscopes would.

The records, the held spins and the scan are written by `levilab acquire` on the virtual bench, without times and values
that differ between computers.

Run it from anywhere: ``python sample_data/make.py``.  It writes the same bytes each time.

``python sample_data/make.py --full-motion`` makes the sweep of the drive, too: ``levilab acquire precession --mock``
with records of the phase, the upper limits of a sound top and of one whose washers slip under the tape, tops simulated
in full motion, and the track of a swaying top.  Their last digits depend on the processor.

``python sample_data/make.py --sound`` makes the sounds of phones, too; their bytes depend on the version of FFmpeg.
"""

import json
import math
import shutil
import subprocess
import sys
import tempfile
import wave
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.crosscheck.subjects.sway import field_of_top
from levilab.crosscheck.subjects.tune import draw_world, keep_diary
from levilab.pipelines.tune.owner import write_owner
from levilab.present.progress import Display
from levilab.reproduce.spindown import NOISE_HZ, READINGS, solve
from levilab.runs.events import RunEvent
from levilab.runs.run import RunRecord
from levilab.simulator import preset, simulate
from levilab.simulator.published.printed import several
from levilab.texts.text import Text, text_from

HERE = Path(__file__).parent
#: (C₁ [1/s], |C₂| [1/rad], readings): the thesis's four runs, C₁ printed to six decimals, C₂ to eight.
PUBLISHED = tuple(
    (c1.value, c2.value, n)
    for c1, c2, n in zip(several("thesis", "spindown.c1"), several("thesis", "spindown.c2"), READINGS, strict=True)
)
LOWER_LIMITS_HZ = tuple(one.value for one in several("thesis", "measured.limits"))

Array = NDArray[np.float64]

CHANNELS = [
    {"name": "time_s", "unit": "s", "source": "made up, from the moment the drive is off"},
    {"name": "spin_frequency_hz", "unit": "Hz", "source": "made up, law of a laminar disc and noise"},
    {"name": "spin_frequency_u_hz", "unit": "Hz", "source": "standard deviation of the noise"},
]
HOW = (
    "not the author's data: disc law from {start:.4f} Hz with C32 = {c32:.4e} (rad/s)^-1/2/s, noise N(0, 0.03 Hz) of "
    "seed {seed}, both solved for so that unweighted straight lines return the published C1 = {c1:n} 1/s and "
    "C2 = {c2:n} 1/rad; rounded to 0.01 Hz; made by sample_data/make.py"
)


def synthetic(said: str) -> dict[str, Any]:
    """Return the fields of a record that say how it was made."""
    says = said.as_table() if isinstance(said, Text) else None
    return {"synthetic": True, "synthetic_how": f"SYNTHETIC: {said}", "synthetic_says": says}


def made_by(record: RunRecord, command: str = "sample_data/make.py") -> str:
    """Return how a run was made, and by which command."""
    how = text_from(record.synthetic_says, record.synthetic_how or "")
    return Text("{how}; made by {command:s}", how=how, command=command)


def write(folder: Path, header: str, rows: list[str], record: dict[str, Any]) -> None:
    """Make a run folder."""
    folder.mkdir(exist_ok=True)
    common = {
        "schema": "levilab-run/1",
        "status": "finished",
        "ended_utc": None,
        "time_zero_utc": None,
        "command_line": ["python", "sample_data/make.py"],
        "configuration": {},
        "instruments": {},
        "software": {},
        "seed": None,
    }
    text = json.dumps(common | record, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    (folder / "run.json").write_text(text, encoding="utf-8", newline="\n")
    (folder / "readings.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8", newline="\n")


# --- the same half second as several scopes write it ---------------------------------------------------

#: Samples per second, their number, and the time of the first [s].
RATE_HZ, SAMPLES, START_S = 4000, 2000, -0.25
#: Spin at time 0 [Hz], its rate of change [Hz/s], turns at time 0, and the pulse: part of a turn at half height.
SPIN_HZ, CHIRP_HZ_S, PHASE, DUTY = 30.0, -0.095, 0.3, 0.03
#: Light without tape, with tape on top, noise, and the step of an 8-bit scope [V].
DARK_V, PULSE_V, NOISE_V, DIGIT_V = 0.1, 1.0, 0.02, 0.01


def turns(t: Array) -> Array:
    """Return the turns of the top since time 0, beginning at PHASE."""
    return PHASE + SPIN_HZ * t + CHIRP_HZ_S * t**2 / 2


def tape(t: Array | None = None) -> tuple[Array, Array]:
    """Time [s] and signal [V] of the phototransistor."""
    t = START_S + np.arange(SAMPLES) / RATE_HZ if t is None else t
    off = (turns(t) + 0.5) % 1 - 0.5
    pulse = PULSE_V * np.exp(-0.5 * (off / (DUTY / 2.3548)) ** 2)
    noise = np.random.default_rng(30).normal(0, NOISE_V, t.size)
    return t, np.round((DARK_V + pulse + noise) / DIGIT_V) * DIGIT_V


def pulse_times(n: int = 60) -> Array:
    """Return the times at which the tape passes, with a jitter of 20 µs [s]."""
    k = np.arange(n)
    t = (-SPIN_HZ + np.sqrt(SPIN_HZ**2 + 2 * CHIRP_HZ_S * (k + 1 - PHASE))) / CHIRP_HZ_S
    return t + np.random.default_rng(31).normal(0, 20e-6, n)


def engineering(x: float, digits: int = 4) -> str:
    """Return a number as Keysight writes it: +158.6506E-03."""
    power = 0 if x == 0 else 3 * math.floor(math.log10(abs(x)) / 3)
    return f"{x / 10.0**power:+.{digits}f}E{power:+03d}"


def rigol(_: Array, u: Array) -> list[str]:
    """DS1000Z: the samples numbered, start and increment in the second row."""
    head = ["X,CH1,CH2,Start,Increment,", f"Sequence,Volt,Volt,{START_S:.6e},{1 / RATE_HZ:.6e}"]
    return head + [f"{k},{x:.2e},{0.02 * (k // 40 % 2):.2e}," for k, x in enumerate(u)]


def rigol_screen(_: Array, u: Array) -> list[str]:
    """DS1000Z, the screen: neither times nor numbers."""
    return ["CH1,Start,Increment,", f"Volt,{START_S:.6e},{1 / RATE_HZ:.6e}", *(f"{x:.2e}," for x in u)]


def rigol_times(t: Array, u: Array) -> list[str]:
    """DS1000E: times of three digits, no increment."""
    return ["X,CH1,", "Second,Volt,", *(f"{x:.2E},{y:.2E}," for x, y in zip(t, u, strict=True))]


def keysight(t: Array, u: Array) -> list[str]:
    """DSOX."""
    return ["x-axis,1", "second,Volt", *(f"{engineering(x)},{engineering(y)}" for x, y in zip(t, u, strict=True))]


def siglent(t: Array, u: Array) -> list[str]:
    """SDS1202X-E: twelve lines of header."""
    head = [
        f"Record Length,Analog:{SAMPLES}", f"Sample Interval,Analog:{1 / RATE_HZ:.12f}", "Vertical Units,CH1:V",
        "Vertical Scale,CH1:0.20", "Vertical Offset,CH1:-0.60000", "Horizontal Units,s", "Horizontal Scale,0.05",
        "Model Number,SDS1202X-E", "Serial Number,SYNTHETIC", "Software Version,made by sample_data/make.py",
        "Source,CH1", "Second,Volt",
    ]  # fmt: skip
    return head + [f"{x:.11f},{y:.5f}" for x, y in zip(t, u, strict=True)]


def siglent_rate(t: Array, u: Array) -> list[str]:
    """SDS1104X-E: the sample rate in the place of the interval."""
    head = [f"Record Length,Analog:{SAMPLES}", f"Sample Rate,{RATE_HZ:.1f}", "Vertical Scale,CH1: 0.20",
            "Vertical Offset,CH1:-0.60000", "Horizontal Scale, 0.050000000", "Second,Volt"]  # fmt: skip
    return head + [f"{x:.11f},{y:.5f}" for x, y in zip(t, u, strict=True)]


def tektronix_beside(t: Array, u: Array) -> list[str]:
    """TDS2000C: the header beside the first 18 rows."""
    head = [
        f"Record Length,{SAMPLES:.6e}", f"Sample Interval,{1 / RATE_HZ:.6e}", "Trigger Point,1.000000000000e+03",
        ",", ",", ",", "Source,CH1", "Vertical Units,V", "Vertical Scale,2.000000e-01", "Vertical Offset,0.000000e+00",
        "Horizontal Units,s", "Horizontal Scale,5.000000e-02", "Pt Fmt,Y", "Yzero,0.000000e+00",
        "Probe Atten,1.000000e+00", "Model Number,TDS2001C", "Serial Number,SYNTHETIC", "Firmware Version,FV:v24.26",
    ]  # fmt: skip
    head += [","] * (SAMPLES - len(head))
    return [f"{key},,{x:018.12f},{y:10.5f}," for key, x, y in zip(head, t, u, strict=True)]


def tektronix(t: Array, u: Array) -> list[str]:
    """MDO3000: a key a line, then TIME and the channel."""
    head = [
        "Model,MDO3014", "Firmware Version,1.26", "", "Waveform Type,ANALOG", "Point Format,Y", "Horizontal Units,s",
        "Horizontal Scale,0.05", "Horizontal Delay,0", f"Sample Interval,{1 / RATE_HZ:g}",
        f"Record Length,{SAMPLES}", "Gating,0.0% to 100.0%", "Probe Attenuation,1", "Vertical Units,V",
        "Vertical Offset,0", "Vertical Scale,0.2", "Vertical Position,-3", ",", ",", ",", "Label,", "TIME,CH1",
    ]  # fmt: skip
    return head + [f"{x:.7e},{y:g}" for x, y in zip(t, u, strict=True)]


def picoscope(t: Array, u: Array) -> list[str]:
    """PicoScope 6: units in brackets below the names, then an empty line."""
    return ["Time,Channel A", "(ms),(V)", "", *(f"{1e3 * x:.8f},{y:.8f}" for x, y in zip(t, u, strict=True))]


def waveforms(t: Array, u: Array) -> list[str]:
    """WaveForms, of the Analog Discovery: comments above the titles."""
    head = [
        "#Digilent WaveForms Oscilloscope Acquisition", "#Device Name: Discovery2", "#Serial Number: SYNTHETIC",
        f"#Sample rate: {RATE_HZ}Hz", f"#Samples: {SAMPLES}", "#Channel 1: Range: 200 mV/div Offset: -0.6 V", "",
        "Time (s),Channel 1 (V)",
    ]  # fmt: skip
    return head + [f"{x:.6e},{y:.6f}" for x, y in zip(t, u, strict=True)]


def owon(_: Array, u: Array) -> list[str]:
    """HDS200: a key and a value a line, the samples numbered."""
    head = ["Channel\t\t\t  :,CH1", "Frequency\t\t\t  :,F=30.00Hz", "Probe attenuation\t  :,1X",
            f"Time interval\t\t  :,{1e6 / RATE_HZ:.2f}uS", "", "index,CH1_Voltage(mV)"]  # fmt: skip
    return head + [f"{k},{1e3 * y:.2f}" for k, y in enumerate(u)]


def hantek(t: Array, u: Array) -> list[str]:
    """DSO5000P: times with six digits, from the first sample on."""
    head = ["#timebase=50000000000(ps)", ",#voltbase=200000(uV)", f"#size={SAMPLES}"]
    return head + [f"{x - START_S:.5E},{y:.3f}" for x, y in zip(t, u, strict=True)]


def rigol_5000(_: Array, u: Array) -> list[str]:
    """MSO5000, the memory: start and increment behind the name."""
    return [f"CH1V,t0={START_S:.3e},tInc={1 / RATE_HZ:.3e},", *(f"{y:.4e},," for y in u)]


def pulseview(t: Array, u: Array) -> list[str]:
    """PulseView: comments, units in the place of titles."""
    head = ["; CSV generated by libsigrok 0.5.2", "; from SYNTHETIC", "; Channels (1/1): A0",
            f"; Samplerate: {RATE_HZ / 1000:g} kHz", "microseconds,V DC"]  # fmt: skip
    return head + [f"{1e6 * (x - START_S):.0f},{y:.5f}" for x, y in zip(t, u, strict=True)]


def dsview(head: list[str], rows: list[str]) -> list[str]:
    """DSView (libsigrok4DSL/output/csv.c): comments, then times and levels, or voltages alone."""
    return ["; CSV, generated by libsigrok4DSL 0.2.0 on Mon Nov 23 14:05:12 2026", *head, *rows]


def dsview_scope(_: Array, u: Array) -> list[str]:
    """DSView of a DSCope: no times, the unit beside each name."""
    head = ["; Channels (2/2)", f"; Sample rate: {RATE_HZ // 1000} kHz", "; Sample count: 2 K Samples"]
    rows = [f"{1e3 * x:.5f},{0.02 * (k // 40 % 2):.5f}" for k, x in enumerate(u)]
    return dsview(head, [" 0 (Unit: mV), 1 (Unit: V)", *rows])


def dsview_logic(_: Array, __: Array) -> list[str]:
    """DSView of a DSLogic: a row for each change, which the tape makes high for 1 ms."""
    head = ["; Channels (1/16)", "; Sample rate: 1 MHz", "; Sample count: 2 M Samples"]
    rows = [f"{round(x, 6):.15g},{level}" for y in pulse_times() for x, level in ((y, 1), (y + 1e-3, 0))]
    return dsview(head, ["Time(s), 0", "0,0", *rows])


def red_pitaya(_: Array, __: Array) -> list[str]:
    """Red Pitaya's oscilloscope in the browser: 1024 samples, 50 ms a division, and times that fall from row to row."""
    t = START_S + np.arange(1024) / 2048
    _, u = tape(t)
    return ["TIME ms, IN1", *(f"{round(-1e3 * x, 3):g}, {y:.2f}" for x, y in zip(t, u, strict=True))]


def saleae(_: Array, __: Array) -> list[str]:
    """Logic 2: a row for each change of a level, which the tape makes high for 1 ms."""
    rows = [(x, level) for y in pulse_times() for x, level in ((y, 1), (y + 1e-3, 0))]
    return ["Time [s],Channel 0", "0.000000000,0", *(f"{x:.9f},{level}" for x, level in rows)]


def microcontroller(_: Array, __: Array) -> list[str]:
    """Print times of micros() and readings of ten bits, 1 ms apart but for what else the loop did."""
    random = np.random.default_rng(32)
    t = START_S + np.cumsum(
        random.uniform(0.7e-3, 1.3e-3, 2 * SAMPLES) + 3e-3 * (random.uniform(size=2 * SAMPLES) < 0.02)
    )
    _, u = tape(t)
    return ["t [us],A0", *(f"{1e6 * (x - START_S):.0f},{1023 * y / 2:.0f}" for x, y in zip(t, u, strict=True))]


def two_columns(t: Array, u: Array) -> list[str]:
    """Write a spreadsheet of a German Windows: semicolons, decimal commas, milliseconds and millivolts."""
    rows = (f"{1e3 * x:.2f};{1e3 * y:.0f}".replace(".", ",") for x, y in zip(t, u, strict=True))
    return ["Zeit [ms];Spannung [mV]", *rows]


#: File → its lines and its line ends.
TEXTS: dict[str, tuple[Callable[[Array, Array], list[str]], str]] = {
    "rigol-ds1000z.csv": (rigol, "\n"),
    "rigol-ds1000z-screen.csv": (rigol_screen, "\n"),
    "rigol-ds1000e.csv": (rigol_times, "\r\n"),
    "keysight-dsox.csv": (keysight, "\r\n"),
    "siglent-sds1202x-e.csv": (siglent, "\n"),
    "siglent-sds1104x-e.csv": (siglent_rate, "\r\n"),
    "tektronix-tds2000c.csv": (tektronix_beside, "\n"),
    "tektronix-mdo3000.csv": (tektronix, "\n"),
    "two-columns-german.csv": (two_columns, "\r\n"),
    "picoscope.csv": (picoscope, "\r\n"),
    "waveforms-analog-discovery.csv": (waveforms, "\n"),
    "owon-hds242.csv": (owon, "\r\n"),
    "hantek-dso5102p.csv": (hantek, "\n"),
    "rigol-mso5000.csv": (rigol_5000, "\n"),
    "pulseview.csv": (pulseview, "\n"),
    "saleae-logic.csv": (saleae, "\n"),
    "dsview-dscope.csv": (dsview_scope, "\n"),
    "dsview-dslogic.csv": (dsview_logic, "\n"),
    "red-pitaya.csv": (red_pitaya, "\n"),
    "microcontroller.csv": (microcontroller, "\r\n"),
}


def write_scope_files(folder: Path) -> None:
    """Write the files of scope-files/."""
    folder.mkdir(exist_ok=True)
    t, u = tape()
    for name, (lines, end) in TEXTS.items():
        (folder / name).write_text(end.join([*lines(t, u), ""]), encoding="utf-8", newline="")
    np.save(folder / "samples-4000hz.npy", u.astype("<f4"), allow_pickle=False)
    with wave.open(str(folder / "recording.wav"), "wb") as sound:
        sound.setparams((1, 2, RATE_HZ, SAMPLES, "NONE", "not compressed"))
        sound.writeframes(as_codes(u))
    write_sigrok(folder / "pulseview.sr", u)
    lines = ["pulse time [s]", *(f"{x:.7f}" for x in pulse_times())]
    (folder / "pulse-times.txt").write_text("\n".join([*lines, ""]), encoding="utf-8", newline="")
    (folder / "README.md").write_text(SCOPE_FILES, encoding="utf-8", newline="\n")


def write_sigrok(path: Path, u: Array) -> None:
    """Write a capture as PulseView does: the level above 0.5 V, and the voltage in two pieces."""
    metadata = [
        "[global]", "sigrok version=0.5.2", "", "[device 1]", "capturefile=logic-1", "total probes=1",
        f"samplerate={RATE_HZ / 1000:g} kHz", "total analog=1", "probe1=D0", "analog2=A0", "unitsize=1", "",
    ]  # fmt: skip
    half = SAMPLES // 2
    members = {
        "version": b"2", "metadata": "\n".join(metadata).encode(), "logic-1-1": (u > 0.5).astype("u1").tobytes(),
        "analog-1-2-1": u[:half].astype("<f4").tobytes(), "analog-1-2-2": u[half:].astype("<f4").tobytes(),
    }  # fmt: skip
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)  # of 1980
            info.create_system = 3  # on Windows, too
            archive.writestr(info, content)


#: Sound of a phone → how it is encoded: FLAC at a lower rate, and a film with pictures of 16 × 16.
SOUNDS = {
    "phone.m4a": "-b:a 96k",
    "phone.mp3": "-b:a 64k",
    "phone.ogg": "-c:a libvorbis -b:a 64k",
    "phone.flac": "-ar 11025 -sample_fmt s16",
    "phone.mp4": "-f lavfi -i color=black:s=16x16:r=5 -c:v mpeg4 -c:a aac -b:a 64k -shortest",
}


def write_sound() -> None:
    """Write the sounds of phones at a light sensor, two seconds; their bytes depend on the version of FFmpeg."""
    import imageio_ffmpeg

    _, u = tape(START_S + np.arange(2 * 44_100) / 44_100)
    encode = imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", "-f", "s16le", "-ar", "44100", "-i", "pipe:0"
    for name, options in SOUNDS.items():
        made = HERE / "scope-files" / name
        words = [*encode, *options.split(), "-fflags", "+bitexact", made]
        subprocess.run(words, input=as_codes(u), check=True)  # noqa: S603


def as_codes(u: Array) -> bytes:
    """Return 16 bits a sample, 2 V at full scale."""
    return np.round(u / 2 * 32767).astype("<i2").tobytes()


SCOPE_FILES = f"""SYNTHETIC: none of these files came from an instrument, they were made up by sample_data/make.py.

Most hold the same half second of a tape that passes a phototransistor once per turn, {RATE_HZ} samples per second:
{SPIN_HZ:g} Hz at time 0 of the scopes, which is the middle of the record, falling by {-CHIRP_HZ_S:g} Hz per second;
pulses of {PULSE_V:g} V, {100 * DUTY:g} % of a turn wide at half height, on {DARK_V:g} V; noise N(0, {NOISE_V:g} V);
rounded to {DIGIT_V:g} V.  recording.wav has 2 V at full scale.  Of the same top, pulse-times.txt and saleae-logic.csv
hold {len(pulse_times())} passages from time 0 on, with a jitter of 20 us; microcontroller.csv four seconds at uneven
times, from 0.25 s before time 0 on; the sounds phone.* two seconds from there on, 44100 samples per second, phone.flac
11025.  red-pitaya.csv has times that fall, as its oscilloscope writes them: --rate 2048.
dsview-dslogic.csv has the same passages as saleae-logic.csv.
"""


def precession_sweep() -> None:
    """Make a sweep of the drive on the virtual bench, without the times of the day at which it was made."""
    folder, seed = HERE / "precession-sweep", 1
    with tempfile.TemporaryDirectory() as out:
        bench = Path(out) / "bench.toml"
        bench.write_text("[precession]\nrecord_s = 6.0\n", encoding="utf-8")
        options = AcquisitionOptions(mock=True, bench=bench, out=Path(out), seed=seed)
        run = acquire(request_for("precession", options), Display())
        readings = run.readings().frame.round(6)
        write(
            folder,
            ",".join(readings.columns),
            [",".join(f"{value:.10g}" for value in row) for row in readings.to_numpy().tolist()],
            {
                "experiment": "precession",
                "started_utc": None,
                "channels": run.record.channels,
                "configuration": {name: run.record.configuration[name] for name in ("precession", "scene")},
                "seed": seed,
                "note": "a sweep from 44 Hz down to 28 Hz",
            }
            | synthetic(made_by(run.record, "sample_data/make.py --full-motion")),
        )
        events = [{key: value for key, value in event.items() if key != "utc"} for event in run.events()]
        lines = [json.dumps(event, ensure_ascii=False, sort_keys=True) + "\n" for event in events]
        (folder / "events.jsonl").write_text("".join(lines), encoding="utf-8", newline="\n")
        shutil.copytree(run.folder / "traces", folder / "traces", dirs_exist_ok=True)
        shutil.copy(run.folder / "traces.jsonl", folder)
    print("precession-sweep")


#: Name → the scene, None for a top that only spins; lines of the bench file; a note.
TRACES: dict[str, tuple[str | None, str, str]] = {
    "trace-tape": (None, "records = 5", "the tape of a top that spins down: five records, 10 s apart"),
    "trace-laser": (
        "driven",
        "channels = [1, 3]\nshows = ['tape', 'laser']\ndrive_frequency_hz = 30.0\nrecords = 5\ninterval_s = 2.0",
        "tape and laser of the thesis's driven top: five records, 2 s apart",
    ),
}


def write_traces(name: str, scene: str | None, settings: str, note: str) -> None:
    """Make a run folder with records of the oscilloscope, acquired on the virtual bench."""
    with tempfile.TemporaryDirectory() as place:
        bench = Path(place) / "bench.toml"
        bench.write_text(f"[trace]\n{settings}\n", encoding="utf-8")
        options = AcquisitionOptions(
            mock=True, bench=bench, out=Path(place), seed=1, scene=scene, note=f"SYNTHETIC, {note}"
        )
        run = acquire(request_for("trace", options), Display())
        count = run.count()
        shutil.rmtree(HERE / name, ignore_errors=True)
        shutil.copytree(run.folder, HERE / name, ignore=shutil.ignore_patterns("datapackage.json", "run.lock"))
    path = HERE / name / "run.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    kept = ("limits", "oscilloscope", "generator", "scene", "trace")  # what the run has used
    record["configuration"] = {key: value for key, value in record["configuration"].items() if key in kept}
    record |= {"started_utc": None, "ended_utc": None, "time_zero_utc": None, "software": {}}
    record["command_line"] = ["python", "sample_data/make.py"]
    record |= synthetic(made_by(run.record))
    text = json.dumps(record, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    path.write_text(text, encoding="utf-8", newline="\n")
    events = HERE / name / "events.jsonl"
    if events.exists():
        lines = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()]
        texts = [json.dumps({k: v for k, v in line.items() if k != "utc"}, ensure_ascii=False) for line in lines]
        events.write_text("".join(f"{line}\n" for line in texts), encoding="utf-8", newline="\n")
    print(f"{name}: {count} records")


def from_the_virtual_bench(
    experiment: str,
    folder: str,
    seed: int,
    note: str,
    *,
    settings: tuple[str, ...] = (),
    scene: str | None = None,
    kept: frozenset[str] = frozenset({RunEvent.GAIN}),
) -> None:
    """Make a run of the virtual bench that is the same each time.  kept: kinds of its events that stay."""
    with tempfile.TemporaryDirectory() as out:
        options = AcquisitionOptions(mock=True, out=Path(out), seed=seed, settings=settings, scene=scene)
        run = acquire(request_for(experiment, options), Display())
        events = [{k: v for k, v in one.items() if k != "utc"} for one in run.events() if one["kind"] in kept]
        header, *rows = (run.folder / "readings.csv").read_text(encoding="utf-8").splitlines()
    record, command = run.record, "sample_data/make.py" + " --full-motion" * bool(scene)
    write(
        HERE / folder,
        header,
        rows,
        {
            "experiment": experiment,
            "started_utc": None,
            "channels": record.channels,
            "configuration": {name: record.configuration[name] for name in (experiment, *["scene"] * bool(scene))},
            "seed": seed,
            "note": note,
        }
        | synthetic(made_by(record, command)),
    )
    if events:
        lines = [json.dumps(one, ensure_ascii=False) + "\n" for one in events]
        (HERE / folder / "events.jsonl").write_text("".join(lines), encoding="utf-8", newline="\n")
    print(f"{folder}: {record.synthetic_how}")


#: Spins at which one top was held [Hz].
HELD = (26, 32, 38, 45)


def held_spins() -> None:
    """Make runs of one top of the virtual bench that is held at several spins."""
    (HERE / "hold").mkdir(exist_ok=True)
    (HERE / "hold" / ".levilab-skip").touch()
    for spin in HELD:
        settings = (f"drive_frequency_hz={spin}", "longest_s=120")
        from_the_virtual_bench("hold", f"hold/{spin}-hz", 3, f"a top held at {spin} Hz", settings=settings)


#: Folder → scene, seed and note of a run of upper limits.
UPPER_LIMITS = {
    "upper-limits": ("spindown", 1, "how far the drive takes the top"),
    "loose-washers": ("loose-washers", 2, "a locked top whose washers are loose"),
}
#: Events that say how a top was held and lost.
OF_LIMITS = frozenset({RunEvent.HELD, RunEvent.LOCK_LOST, RunEvent.WARNING})


def upper_limits() -> None:
    """Make runs of upper limits on the virtual bench."""
    settings = ("which=upper", "repetitions=8")
    for folder, (scene, seed, note) in UPPER_LIMITS.items():
        from_the_virtual_bench("limit", folder, seed, note, settings=settings, scene=scene, kept=OF_LIMITS)


#: A film of 60 frames per second, with an error of each coordinate, of a top that was pushed.
TRACK_S, FRAMES, FILM_NOISE_MM = 100.0, 60.0, 0.1
TRACK_SCENE = {
    "top.mass_kg": 0.0253,
    "drag.law": "disc",
    "start.place": "given",
    "start.position_m": [4e-4, 0.0, 0.0727],
    "start.velocity_m_s": [0.0, 1.5e-3, 0.0],
    "start.spin_hz": 40.0,
}


def write_track() -> None:
    """Make the places of a top as a film gives them, with its spin; its last digits depend on the processor."""
    motion = simulate(preset("undriven").changed(TRACK_SCENE), TRACK_S, rate=FRAMES, tolerance=1e-6)
    noise = np.random.default_rng(23).normal(0, FILM_NOISE_MM, (len(motion.time), 2))
    places = 1e3 * motion.position[:, :2] + noise
    rows = [
        f"{t:.4f},{x:.2f},{y:.2f},{spin:.3f}"
        for t, (x, y), spin in zip(motion.time[:-1], places, motion.spin_hz, strict=False)
    ]
    (HERE / "sway").mkdir(exist_ok=True)
    (HERE / "sway" / ".levilab-skip").touch()
    text = "\n".join(["# SYNTHETIC, made by sample_data/make.py", "t [s],x [mm],y [mm],spin [Hz]", *rows, ""])
    (HERE / "sway" / "track.csv").write_text(text, encoding="utf-8", newline="\n")
    print(f"sway: {len(rows)} frames")


#: The record of a phone above that top: its length, samples per second, distance and place beside the axis, and the
#: moment across the axis; noise of a sample and field of the base there.
FIELD_S, FIELD_HZ, ABOVE_M, ASIDE_M, ACROSS_A_M2 = 60.0, 100.0, 0.12, 0.003, 0.02
FIELD_NOISE_UT, BASE_UT = 0.12, (36.0, -21.0, 2240.0)


def write_field() -> None:
    """Make the record of a phone that lies above the swaying top; its last digits depend on the processor."""
    motion = simulate(preset("undriven").changed(TRACK_SCENE), FIELD_S, rate=FIELD_HZ, tolerance=1e-6)
    field = 1e6 * field_of_top(motion, ABOVE_M, ASIDE_M, ACROSS_A_M2) + BASE_UT
    field += np.random.default_rng(24).normal(0, FIELD_NOISE_UT, field.shape)
    head = '"Time (s)","Magnetic Field x (µT)","Magnetic Field y (µT)","Magnetic Field z (µT)"'
    rows = [f"{t:.2f},{x:.2f},{y:.2f},{z:.2f}" for t, (x, y, z) in zip(motion.time[:-1], field[:-1], strict=True)]
    text = "\n".join(["# SYNTHETIC, made by sample_data/make.py", head, *rows, ""])
    (HERE / "sway" / "phone.csv").write_text(text, encoding="utf-8", newline="\n")
    print(f"sway: {len(rows)} samples of a phone above it")


def write_diary() -> None:
    """Make the file of an owner who follows `levilab tune` on three days, as the cross-check has one."""
    by = np.random.default_rng(24)
    (HERE / "tune").mkdir(exist_ok=True)
    path = HERE / "tune" / "tune.toml"
    write_owner(path, keep_diary(draw_world(by), by))
    text = path.read_text(encoding="utf-8")
    path.write_text(f"# SYNTHETIC, made by sample_data/make.py\n{text}", encoding="utf-8", newline="\n")
    print("tune")


def main() -> None:
    """Write the run folders and the files of scopes."""
    write_scope_files(HERE / "scope-files")
    for number, (c1, c2, n) in enumerate(PUBLISHED, start=1):
        made = solve(c1, c2, n)
        how = {"start": made.start, "c32": made.c32, "seed": made.seed}
        write(
            HERE / f"spin-down-{number}",
            ",".join(channel["name"] for channel in CHANNELS),
            [f"{x:g},{y:.2f},{NOISE_HZ}" for x, y in zip(made.time, made.spin, strict=True)],
            {
                "experiment": "spin",
                "started_utc": None,
                "channels": CHANNELS,
                "note": f"run {number} of four; a stand-in for the thesis's run {number}",
                "world": "spin",
                "published": {"c1_per_s": c1, "c2_per_rad": c2},
            }
            | synthetic(Text(HOW, c1=str(c1), c2=str(c2), **how)),
        )
        print(f"spin-down-{number}: {how}")
    write(
        HERE / "lower-limits",
        "spin_frequency_hz",
        [f"{limit:.1f}" for limit in LOWER_LIMITS_HZ],
        {
            "experiment": "limit",
            "started_utc": None,
            "channels": [
                {"name": "spin_frequency_hz", "unit": "Hz", "source": "spin at which the top fell, as published"}
            ],
            "note": "the ten lower limits as published in the thesis: mean 21.86, s 0.25, s.e. 0.08 Hz",
            "synthetic": False,
            "synthetic_how": None,
            "configuration": {"limit": {"which": "lower"}},
        },
    )
    for name, how_made in TRACES.items():
        write_traces(name, *how_made)
    from_the_virtual_bench("field", "field-scan", 11, "a base as in device.toml, heights set by hand to 0.2 mm")
    held_spins()
    write_diary()


if __name__ == "__main__":
    main()
    if "--full-motion" in sys.argv[1:]:
        precession_sweep()
        upper_limits()
        write_track()
        write_field()
    if "--sound" in sys.argv[1:]:
        write_sound()
