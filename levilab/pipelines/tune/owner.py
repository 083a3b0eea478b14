"""The owner's file, tune.toml: the top, the washers, the trials and a scan of the base.

It is read and written as a person would write it: "24.98 g", "0.06 + 0.1 g, 20.5 °C, rises".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import PositiveFloat, ValidationError

from analysis.tuning import Outcome, Trial
from analysis.uncertainty import Estimate
from levilab.errors import DataError, UsageError
from levilab.files import parse_toml, replace_atomically, toml_value, writing
from levilab.formats.typed import read_mass, read_masses, read_temperature
from levilab.pipelines.options import read_options
from levilab.pipelines.recall import recall_suiting
from levilab.runs.find import find_run
from levilab.settings import Settings, in_one_line
from levilab.texts.text import ENGLISH, Text, in_language, spoken

_HEAD = "# Kept by levilab tune; a trial that is wrong may be corrected here, or its line deleted.\n"
_TRIAL = (
    'a mass or washers, a temperature and an outcome, such as "0.06 + 0.1 g, 20.5 C, rises", are expected; the '
    "outcome is one of {names}"
)
#: A lone mass is that of the whole top from this share of the bare top's on, and else that of a washer.
_WHOLE = 0.5


@dataclass(frozen=True)
class Attempt(Trial):
    """A trial with its washers.

    Attributes:
        washers: on it [kg]; None: not known.
    """

    washers: tuple[float, ...] | None = None

    @property
    def text(self) -> str:
        """The trial as it is typed."""
        what = in_grams(self.mass) if self.washers is None else washers_text(self.washers)
        return f"{what}, {self.temperature:g} °C, {self.outcome.value}"


class Scan(Settings):
    """The window of small motions above the base.

    Attributes:
        path: of the scan.
        temperature_c: of the base during the scan.
        mass_to_set_kg, mass_to_set_u_kg: the middle.
        lightest_kg, heaviest_kg: its ends.
    """

    path: str
    temperature_c: float
    mass_to_set_kg: PositiveFloat
    mass_to_set_u_kg: PositiveFloat
    lightest_kg: PositiveFloat
    heaviest_kg: PositiveFloat

    @property
    def middle(self) -> Estimate:
        """The middle with its u."""
        return Estimate(self.mass_to_set_kg, self.mass_to_set_u_kg, "kg")


@dataclass(frozen=True)
class Owner:
    """An owner's top, washers and trials.

    Attributes:
        top: mass without washers [kg]; None: not known.
        washers: masses of all washers [kg].
        attempts: in their order.
        scan: of the base.
    """

    top: float | None = None
    washers: tuple[float, ...] = ()
    attempts: tuple[Attempt, ...] = ()
    scan: Scan | None = None

    def with_washers(self, masses: Sequence[float]) -> Owner:
        """Return the owner with these washers [kg].  Raises ValueError where one is as heavy as a top."""
        heaviest = max(masses, default=0.0)
        if self.top is not None and heaviest >= _WHOLE * self.top:
            said = "a washer of {washer:n} on a top of {top:n}? mg are typed as 60 mg, kg as 0.0249 kg"
            raise ValueError(Text(said, washer=in_grams(heaviest), top=in_grams(self.top)))
        return replace(self, washers=tuple(sorted(masses)))

    def with_trial(self, text: str) -> Owner:
        """Return the owner with one more trial.  Raises ValueError."""
        return replace(self, attempts=(*self.attempts, self._attempt(text)))

    def _attempt(self, text: str) -> Attempt:
        *masses, temperature, did = (piece.strip() for piece in ("," * (2 - text.count(",")) + text).split(","))
        names = [(one, in_language(one.value, code)) for code in {ENGLISH, spoken()} for one in Outcome]
        outcomes = [*dict.fromkeys(one for one, name in names if did and name.startswith(did.casefold()))]
        if len(outcomes) != 1 or not masses[0]:
            raise ValueError(Text(_TRIAL, names=tuple(one.value for one in Outcome)))
        typed, degrees = read_masses(",".join(masses)), read_temperature(temperature)
        if self.top is None:
            raise ValueError("the mass of the top without washers is needed first: `top`")
        if len(typed) == 1 and typed[0] >= _WHOLE * self.top:
            return Attempt(typed[0], degrees, outcomes[0])
        if sum(typed) >= _WHOLE * self.top:
            said = "washers of {washers:n} on a top of {top:n}? mg are typed as 60 mg, kg as 0.0249 kg"
            raise ValueError(Text(said, washers=in_grams(sum(typed)), top=in_grams(self.top)))
        return Attempt(self.top + sum(typed), degrees, outcomes[0], tuple(sorted(typed)))


def in_grams(mass: float) -> str:
    """Return a mass [kg] as text, to 0.1 mg.

    >>> in_grams(0.02498), in_grams(0.0001)
    ('24.98 g', '0.1 g')
    """
    return f"{round(1e3 * mass, 4):.7g} g"


def washers_text(washers: Sequence[float]) -> str:
    """Return washers [kg] as a sum.

    >>> washers_text([6e-5, 1e-4]), washers_text([])
    ('0.06 + 0.1 g', 'none')
    """
    return " + ".join(in_grams(one).removesuffix(" g") for one in washers) + " g" if washers else "none"


# --- the file ---


class _Table(Settings):
    top: str | None = None
    washers: tuple[str, ...] = ()
    trials: tuple[str, ...] = ()
    scan: Scan | None = None


def read_owner(path: Path) -> Owner:
    """Return the owner in a file; without a file, one of whom nothing is known.  Raises DataError."""
    if not path.exists():
        return Owner()
    where = ""
    try:
        table = _Table.model_validate(parse_toml(path.read_text(encoding="utf-8")))
        where = "top, washers: "
        washers = tuple(sorted(map(read_mass, table.washers)))
        owner = Owner(read_mass(table.top) if table.top else None, washers, scan=table.scan)
        for number, text in enumerate(table.trials, 1):
            where = f"trials, number {number} ({text[:60]!r}): "
            owner = owner.with_trial(text)
    except ValidationError as error:
        raise DataError(
            '{path:s}: {fault}; top, washers and trials are texts, as "24.98 g"',
            path=path, fault=in_one_line(error, _Table),
        ) from error  # fmt: skip
    except ValueError as error:
        what = "{path:s}: {where:s}{error}: correct it, or delete the file and begin again"
        raise DataError(what, path=path, where=where, error=error) from error
    return owner


def write_owner(path: Path, owner: Owner) -> None:
    """Write the file, whole or not at all.  Raises CannotWrite."""
    lines = [_HEAD]
    if owner.top is not None:
        lines.append(f"top = {toml_value(in_grams(owner.top))}  # without washers\n")
    lines.append(f"washers = [{', '.join(toml_value(in_grams(one)) for one in owner.washers)}]\n")
    lines.append("trials = [\n" + "".join(f"  {toml_value(one.text)},\n" for one in owner.attempts) + "]\n")
    if owner.scan:
        lines += ["\n[scan]\n", *(f"{key} = {toml_value(value)}\n" for key, value in owner.scan)]
    with writing(path, "choose another place with `file`"):
        replace_atomically(path, "".join(lines))


# --- the scan ---


#: Relative error of the mass from taking a magnet for a point: 0 to 4 % (`analysis.field.magnet`).
_POINT_U = 0.02


def read_scan(path: Path, temperature: float | None, device: Path | None, tell: Callable[[str], None]) -> Scan:
    """Return the window of a Hall scan, by its result beside it or analyzed now.

    Args:
        path: of the run or the data file.
        temperature: of the base at the time [°C]; None: as the run recorded it.
        device: file that describes base and top; None: as the result has it.
        tell: called with each warning of the analysis.

    Raises:
        DataError: it is no scan, or says nothing of this top.
        UsageError: the temperature is not known.
    """
    results = recall_suiting([path], read_options({"device": device}, typed=True))
    found = next((result for one, result in results if one.name == "field"), None)
    if found is None:
        raise DataError("{path:s}: is no Hall scan, a run of field or a table of heights and field", path=path)
    if "mass_to_set" not in found.values:
        raise DataError("{path:s}: no top floats above this base, see levilab analyze field", path=path)
    (source, *_), (run, *_) = found.sources, found.runs
    if not run.top.weighed and not run.top.moment.u:
        raise DataError(
            "{path:s}: the moment of your top and its u are not known, so no mass follows: give them with `device`, or "
            "first levilab analyze field with --device and --height, where a top floats",
            path=path,
        )
    noted = source.run.record.temperature_c if source.run else None
    if temperature is None and noted is None:
        raise UsageError("scan_temperature", "is needed with `scan`: the temperature of the base at the scan")
    for text in run.warnings:
        tell(Text("note: {text}", text=text))
    mass, lightest, heaviest = (found.values[name] for name in ("mass_to_set", "lightest_mass", "heaviest_mass"))
    value = float(mass.value or 0.0)
    u = math.hypot(mass.u or 0.0, 0.0 if run.top.weighed or run.top.magnet else _POINT_U * value)
    return Scan(
        path=str(find_run(path)),
        temperature_c=float(noted or 0.0) if temperature is None else temperature,
        mass_to_set_kg=value,
        mass_to_set_u_kg=u,
        lightest_kg=lightest.value,
        heaviest_kg=heaviest.value,
    )
