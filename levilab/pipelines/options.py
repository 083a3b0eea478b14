"""The options of the analyses: one field each, from which the command line, the notebook and reports take them.

Nothing heavy is imported here: the help of the command line reads these fields.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, get_args

from levilab.errors import UsageError, list_known
from levilab.formats.ranges import WithUnit, problem_of
from levilab.present.units import split

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from os import PathLike

    from levilab.formats.device import Device

Tilt = Literal["auto", "none", "fitted"]
Correlation = Literal["fitted", "none"]
Method = Literal["auto", "edges", "matched", "likelihood"]


@dataclass(frozen=True)
class Option:
    """An option.

    Attributes:
        help: for people.
        kind: type of the value on the command line.
        metavar: its placeholder there.
        unit: of the value there.
        factor: from that unit to that of the field.
        low, high: least and greatest value, in the unit of the field.
        above: the value is greater than this.
        choices: the values; empty: any.
        default_text: the default where it is no value.
        needs: the field of the option that it goes with.
        read: from a given value to the field's; raises UsageError, DataError.
    """

    help: str
    kind: type = str
    metavar: str | None = None
    unit: str = ""
    factor: float = 1.0
    low: float = -math.inf
    high: float = math.inf
    above: float | None = None
    choices: tuple[str, ...] = ()
    default_text: str | None = None
    needs: str = ""
    read: Callable[[Any], Any] | None = None

    @property
    def expected(self) -> str:
        """The values that are allowed, with the unit of the command line."""
        if self.choices:
            return f"{', '.join(self.choices)} are known"
        unit = f" [{self.unit}]" if self.unit else ""
        if self.above is not None:
            return f"a number above {self.above:g}{unit} is expected"
        return f"a number from {self.low / self.factor:g} to {self.high / self.factor:g}{unit} is expected"

    def allows(self, value: Any) -> bool:
        """Return whether a value, in the unit of the field, is allowed."""
        if self.choices:
            return value in self.choices
        if self.kind is not float:
            return True
        if not isinstance(value, Real):
            return False
        number = float(value)
        return self.low <= number <= self.high and math.isfinite(number) and (self.above is None or number > self.above)


def _about(help: str, **more: Any) -> dict[str, Option]:  # noqa: A002 - as the attribute
    """Return the metadata of a field of options; see `Option`."""
    return {"option": Option(help, **more)}


def _read_columns(given: Mapping[str, str | int] | str) -> dict[str, str] | None:
    """Return the names of columns; None where none is named: those of an earlier result count."""
    from levilab.formats.table import parse_columns

    return parse_columns(given) or None


def _read_between(given: str | Sequence[float]) -> tuple[float, float]:
    """Return two spins [Hz], the lower one first.  Raises UsageError."""
    try:
        low, high = sorted(map(float, given.split(":") if isinstance(given, str) else given))
    except (TypeError, ValueError):
        low, high = math.nan, math.nan
    if not 0 <= low < high < math.inf:
        raise UsageError("between", "two spins [Hz] are expected, as 30:24", value=given)
    return low, high


def _read_laws(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return names of drag laws, in the order of their table.  Raises UsageError."""
    from analysis.spindown.drag import LAWS

    names = {name.strip() for name in (given.split(",") if isinstance(given, str) else given)}
    if unknown := sorted(names - LAWS.keys() - {""}):
        raise UsageError("laws", list_known(unknown[0], LAWS), value=given)
    if not names & LAWS.keys():
        raise UsageError("laws", "some of {names:s} are expected, as disc,stokes", ", ".join(LAWS), value=given)
    return tuple(name for name in LAWS if name in names)


def _read_device(path: str | PathLike[str]) -> Device:
    from levilab.formats.device import read_device

    return read_device(Path(path))


_READING_U = _about(
    "Standard uncertainty of every reading; goes before what the data say.",
    kind=float, metavar="HZ", unit="Hz", above=0.0,
)  # fmt: skip
_KEEP_OUTLIERS = _about("Fit readings that look like miscounts, too.", kind=bool)
_DEVICE = _about(
    "Describes base and top, as sample_data/device.toml does; see levilab top.",
    kind=Path, metavar="FILE", read=_read_device,
)  # fmt: skip
_NEAR = _about(
    "About where the spin is at first, to 10 %, where a magnetometer's samples or a film's pictures leave a choice.",
    kind=float, metavar="HZ", unit="Hz", above=0.0,
)  # fmt: skip
_RATE = _about(
    "Samples per second, of files that do not say it, as .npy; goes before the file's.  Of a film in slow motion the "
    "true number of pictures.",
    kind=float, metavar="HZ", unit="Hz", above=0.0,
)  # fmt: skip
_HEIGHT = _about(
    "Height at which the top floats; with a scan its moment follows, if its mass is known.  Of the rim, with --camera.",
    kind=float, metavar="MM", unit="mm", factor=1e-3, above=0.0,
)  # fmt: skip
_START = _about(
    "Time from which readings count, or from which the top of a film floats.",
    kind=float, metavar="S", unit="s", low=0.0,
)  # fmt: skip
_STOP = _about(
    "Time until which readings count, or until which the top of a film floats.",
    kind=float, metavar="S", unit="s", above=0.0,
)  # fmt: skip
_CLOCK_U = _about(
    "Relative standard uncertainty of the clock that counts or samples, as 2e-6, from its manual; the budgets show "
    "what it does, it is in no u.",
    kind=float, metavar="PART", above=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class InputOptions:
    """Options of every analysis.

    Attributes:
        guess: whether a file without titles is taken for what it looks like.
    """

    columns: Mapping[str, str] | None = field(default=None, metadata=_about(
        'Columns of your file: "t=Zeit,f=Kanal2" or "t=1,f=3"; with a unit in brackets: "f=Drehzahl [rpm]".',
        metavar="NAME=COLUMN,…", read=_read_columns,
    ))  # fmt: skip
    skip_doubtful: bool | None = field(default=None, metadata=_about(
        "Leave out the rows of a table in which a cell is no plain number, as 35.8? or ca. 40.", kind=bool,
    ))  # fmt: skip
    channel: str | None = None
    rate: float | None = None
    guess: bool = True
    near: float | None = None

    @property
    def of_tables(self) -> dict[str, Any]:
        """The arguments of `levilab.formats.table.read_table` that are options."""
        return {name: getattr(self, name) for name in ("columns", "guess", "skip_doubtful")}


@dataclass(frozen=True)
class RecordOptions(InputOptions):
    """Options of analyses that read records of a detector."""

    channel: str | None = field(default=None, metadata=_about(
        "Channel of a record with several, by its name or number.", metavar="NAME",
    ))  # fmt: skip
    rate: float | None = field(default=None, metadata=_RATE)


@dataclass(frozen=True)
class SpinDownOptions(RecordOptions):
    """Options of spin-downs."""

    reading_u: float | None = field(default=None, metadata=_READING_U)
    keep_outliers: bool = field(default=False, metadata=_KEEP_OUTLIERS)
    tilt: Tilt = field(default="auto", metadata=_about(
        "Whether counts hold the tilt of the top's moment.  auto: as fitted, but for a mock run whose top only spins.  "
        "none: a top that only spins.",
        choices=get_args(Tilt),
    ))  # fmt: skip
    correlation: Correlation = field(default="fitted", metadata=_about(
        "Whether the noise of neighbouring readings may be correlated.  none: it is white, as you know.",
        choices=get_args(Correlation),
    ))  # fmt: skip
    between: tuple[float, float] | None = field(default=None, metadata=_about(
        "Fit only the readings between two spins, as 30:24.", metavar="HZ:HZ", unit="Hz", read=_read_between,
    ))  # fmt: skip
    start_s: float | None = field(default=None, metadata=_START)
    stop_s: float | None = field(default=None, metadata=_STOP)
    laws: tuple[str, ...] | None = field(default=None, metadata=_about(
        'Fit only these drag laws, as "disc,stokes".', metavar="LAW,…", default_text="all", read=_read_laws,
    ))  # fmt: skip
    device: Device | None = field(default=None, metadata=_DEVICE)
    clock_u: float | None = field(default=None, metadata=_CLOCK_U)
    near: float | None = field(default=None, metadata=_NEAR)


@dataclass(frozen=True)
class SpinOptions(RecordOptions):
    """Options of spin frequencies; see `analysis.pulses.spin_of_trace`."""

    method: Method = field(default="auto", metadata=_about(
        "How pulses are found: edges is the fastest, likelihood for weak ones.", choices=get_args(Method),
    ))  # fmt: skip
    clock_u: float | None = field(default=None, metadata=_CLOCK_U)
    near: float | None = field(default=None, metadata=_NEAR)
    drive: float | None = field(default=None, metadata=_about(
        "Frequency of the drive meanwhile: is the top locked to it?",
        kind=float, metavar="HZ", unit="Hz", above=0.0,
    ))  # fmt: skip
    distance_m: float | None = field(default=None, metadata=_about(
        "Distance of a magnetometer from the axis of the top, horizontally; the tilt of its moment follows.",
        kind=float, metavar="M", unit="m", above=0.0,
    ))  # fmt: skip
    distance_u_m: float | None = field(default=None, metadata=_about(
        "Standard uncertainty of --distance, and of --below.", default_text="0.005", needs="distance_m",
        kind=float, metavar="M", unit="m", above=0.0,
    ))  # fmt: skip
    below_m: float | None = field(default=None, metadata=_about(
        "Height of the top above the magnetometer.", default_text="0, the same height", needs="distance_m",
        kind=float, metavar="M", unit="m",
    ))  # fmt: skip
    moment_a_m2: float | None = field(default=None, metadata=_about(
        "Moment of the top, as levilab analyze field finds it; the angle of its tilt follows.", needs="distance_m",
        kind=float, metavar="A_M2", unit="A m^2", above=0.0,
    ))  # fmt: skip


@dataclass(frozen=True)
class FieldOptions(InputOptions):
    """Options of scans of the field."""

    device: Device | None = field(default=None, metadata=_DEVICE)
    height_m: float | None = field(default=None, metadata=_HEIGHT)
    height_u_m: float | None = field(default=None, metadata=_about(
        "Standard uncertainty of --height.", default_text="that of the scan's heights", needs="height_m",
        kind=float, metavar="MM", unit="mm", factor=1e-3, low=0.0, high=2.0,
    ))  # fmt: skip


@dataclass(frozen=True)
class PrecessionOptions(InputOptions):
    """Options of sweeps of the drive."""

    reading_u: float | None = field(default=None, metadata=_READING_U)
    keep_outliers: bool = field(default=False, metadata=_KEEP_OUTLIERS)
    orthogonal: bool = field(default=False, metadata=_about(
        "Use the uncertainty of the drive's frequency, too.", kind=bool,
    ))  # fmt: skip
    clock_u: float | None = field(default=None, metadata=_CLOCK_U)


@dataclass(frozen=True)
class LimitOptions(InputOptions):
    """Options of limits of the spin."""

    reading_u: float | None = field(default=None, metadata=_READING_U)
    clock_u: float | None = field(default=None, metadata=_CLOCK_U)
    near: float | None = field(default=None, metadata=_NEAR)


def _length(text: str) -> Any:
    """Return the field of a length [m] that is typed in millimetres."""
    return field(default=None, metadata=_about(text, kind=float, metavar="MM", unit="mm", factor=1e-3, above=0.0))


@dataclass(frozen=True)
class SwayOptions(InputOptions):
    """Options of the slow swings of a top."""

    device: Device | None = field(default=None, metadata=_DEVICE)
    scan: Path | None = field(default=None, metadata=_about(
        "A Hall scan of the base, a run or a file; without one the radii of --device count.", kind=Path, metavar="PATH",
        read=Path,
    ))  # fmt: skip
    side: Path | None = field(default=None, metadata=_about(
        "The track of a film from beside, of the same time, for the heights; the spins in both tell their times.",
        kind=Path, metavar="TRACKS.csv", read=Path,
    ))  # fmt: skip
    spin_hz: float | None = field(default=None, metadata=_about(
        "Spin of the top, where no column has it.", kind=float, metavar="HZ", unit="Hz", above=0.0,
    ))  # fmt: skip
    sensor_m: float | None = _length(
        "Of a record of the field: distance of the top from the phone above it, or from two vertical probes beside it."
    )


@dataclass(frozen=True)
class HoldOptions(InputOptions):
    """Options of held spins."""

    spindown: Path | None = field(default=None, metadata=_about(
        "A spin-down of the same top, a run or a file: its drag is compared, and the tilt of its moment counts.",
        kind=Path, metavar="PATH", read=Path,
    ))  # fmt: skip


@dataclass(frozen=True)
class VideoOptions(InputOptions):
    """Options of films of a top."""

    rim_m: float | None = _length("Scale: diameter of the top's rim, which is best.")
    base_m: float | None = _length("Scale: outer diameter of a round base.")
    scale_m: float | None = field(default=None, metadata=_about(
        "Scale: metres in a pixel, at the top.", kind=float, metavar="M", unit="m", above=0.0,
    ))  # fmt: skip
    camera_m: float | None = _length("With --height: distance of the camera from the base.")
    beside: bool = field(default=False, metadata=_about(
        "The camera is beside the top, at its height: it shows one coordinate, the height and the lean.", kind=bool,
    ))  # fmt: skip
    stem_m: float | None = _length("Height above the rim of a light dot on the stem, which shows the tilt.")
    height_m: float | None = field(default=None, metadata=_HEIGHT)
    start_s: float | None = field(default=None, metadata=_START)
    stop_s: float | None = field(default=None, metadata=_STOP)
    line_time_s: float | None = field(default=None, metadata=_about(
        "Rolling shutter: µs from a row of the picture to the next.",
        kind=float, metavar="US", unit="us", factor=1e-6, low=0.0, high=1e-3,
    ))  # fmt: skip
    rate: float | None = field(default=None, metadata=_RATE)
    near: float | None = field(default=None, metadata=_NEAR)


def options_of(kind: type[InputOptions]) -> dict[str, Option]:
    """Return the options of an analysis by the names of their fields."""
    return {one.name: one.metadata["option"] for one in fields(kind) if "option" in one.metadata}


#: Name of the analysis → its options.
KINDS: Mapping[str, type[InputOptions]] = MappingProxyType({
    "spindown": SpinDownOptions, "spin": SpinOptions, "field": FieldOptions, "precession": PrecessionOptions,
    "limit": LimitOptions, "sway": SwayOptions, "hold": HoldOptions, "video": VideoOptions,
})  # fmt: skip
#: All options by the names of their fields.
OPTIONS: Mapping[str, Option] = MappingProxyType(
    {name: one for kind in KINDS.values() for name, one in options_of(kind).items()}
)
#: Their values where none is given.
DEFAULTS: Mapping[str, Any] = MappingProxyType(
    {one.name: one.default for kind in KINDS.values() for one in fields(kind) if one.name in OPTIONS}
)
#: Those that say how a data file is read.
OF_FILES = ("columns", "skip_doubtful", "channel", "rate")
#: Those that `levilab report` has, too.
OF_REPORT = (*OF_FILES, "reading_u", "keep_outliers")


def typed_name(name: str) -> str:
    """Return the name of an option on the command line, without dashes.

    >>> typed_name("height_m"), typed_name("reading_u")
    ('height', 'reading_u')
    """
    return split(name)[0]


#: What people write for none.
_OFF = ("none", "false", "off", "no")


def read_options(given: Mapping[str, Any], *, typed: bool = False) -> dict[str, Any]:
    """Return options as analyses take them, without those that are None.

    Args:
        given: values by the names of the fields, in SI.
        typed: the names and units are those of the command line.

    Raises:
        UsageError: a value is not allowed, or goes with another option alone.
        DataError: of a file that an option names.
    """
    names = {typed_name(name) if typed else name: name for name in OPTIONS}
    found: dict[str, Any] = {}
    for shown, value in given.items():
        one = OPTIONS[names[shown]]
        off = value != "none" and str(value).casefold() in _OFF
        if off and not typed and "none" in one.choices:
            *others, last = (repr(choice) for choice in one.choices if choice != "none")
            said = "'none' in quotation marks is expected, or {others:s} or {last:s}"
            raise UsageError(shown, said, tuple(others), last, value=str(value))
        if value is None:
            continue
        if one.needs and given.get(typed_name(one.needs) if typed else one.needs) is None:
            raise UsageError(shown, "goes with `{name:s}` alone", typed_name(one.needs) if typed else one.needs)
        has_unit = isinstance(value, WithUnit)
        shown_value = value.text if has_unit else value
        in_si = value * one.factor if typed and one.factor != 1 else float(value) if has_unit else value
        if not one.allows(in_si):
            raise UsageError(shown, one.expected, value=shown_value)
        factor = one.factor if typed else 1.0
        if one.kind is float and (problem := problem_of(names[shown], in_si, factor, asks=not has_unit)):
            raise UsageError(shown, problem, value=shown_value)
        read = one.read(in_si) if one.read else str(in_si) if one.choices else in_si
        if read is not None:
            found[names[shown]] = read
    return found
