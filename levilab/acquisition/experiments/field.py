"""The Hall scan: flux density on the base's axis, at one height after the other."""

import math
import re
from itertools import pairwise
from typing import Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from levilab.acquisition.experiment import Experiment, ExperimentSettings
from levilab.acquisition.session import ExperimentFailed, Row, Session
from levilab.bench.config import Limits
from levilab.bench.person import PlaceProbe, ShieldProbe
from levilab.formats.ranges import problem_of
from levilab.present.numbers import with_sign
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: More heights than a person has the patience for: a step in the wrong unit.
_MOST_HEIGHTS = 1000
#: As many as the model has parameters of its own.
_FEWEST_HEIGHTS = 4
#: How a person types a height.
_TYPED = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*(mm|cm|m)?", re.IGNORECASE)
_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
#: Before the first height there is only a guess of how long one takes [s].
_USUAL_S = 10.0

#: More than a zero that was set elsewhere is off by, twenty times the earth's field, and less than a base has anywhere
#: near its axis [T]; times that the person is asked to shield the probe.
_MOST_IN_CHAMBER_T, _TRIES_TO_SHIELD = 1e-3, 3
#: A larger drift [u] is hardly chance: one scan in 400 has it.
_MOST_DRIFT_U = 3.0


class FieldSettings(ExperimentSettings):
    """Heights, readings, and what calliper and data sheets say beside: the analysis reads that from the run.

    Heights are counted as the person counts them; base_origin_m is the height of the middle of the ring magnet's
    thickness on that scale.
    """

    lowest_m: float = Field(default=0.03, description="put the probe at this height,")
    highest_m: float = Field(default=0.11, description="go on up to this one")
    step_m: PositiveFloat = Field(default=0.005, description="in such steps;")
    readings: PositiveInt = Field(default=10, ge=2, description="number of readings at each height")
    interval_s: PositiveFloat = Field(default=0.2, description="time from one reading to the next")
    settle_s: NonNegativeFloat = Field(default=1.0, description="pause before the first one, for the filter")
    range_t: NonNegativeFloat = Field(default=0.035, description="range of the magnetometer; 0: as it chooses")
    height_u_m: NonNegativeFloat = Field(default=2e-4, description="standard uncertainty of setting a height")
    gain_u: NonNegativeFloat = Field(
        default=0.0012, description="of the magnetometer's scale, relative (0.2 % of reading: 0.2 %/√3)"
    )
    background_u_t: NonNegativeFloat = Field(
        default=5e-5, description="of what all readings are off by: zero, earth's field"
    )
    base_inner_radius_m: PositiveFloat = Field(default=0.030, description="the ring magnet by the calliper,")
    base_inner_radius_u_m: NonNegativeFloat = 1e-4
    base_outer_radius_m: PositiveFloat = 0.055
    base_outer_radius_u_m: NonNegativeFloat = 1e-4
    base_thickness_m: NonNegativeFloat = 0.015
    base_thickness_u_m: NonNegativeFloat = 2e-4
    base_origin_m: float = Field(default=0.0, description="its middle, where heights are counted from")
    base_origin_u_m: NonNegativeFloat = 1e-3
    top_moment_a_m2: PositiveFloat | None = Field(
        default=None, description="the top that is to float, where its moment is known: the mass to set goes with it"
    )
    top_moment_u_a_m2: NonNegativeFloat = 0.0

    @property
    def heights_m(self) -> list[float]:
        """Where the probe is put, one after the other [m]."""
        return [round(self.lowest_m + k * self.step_m, 9) for k in range(self._count)]

    @property
    def _count(self) -> int:
        # the last step may be missed by rounding
        return math.floor((self.highest_m - self.lowest_m) / self.step_m + 1e-6) + 1

    @model_validator(mode="after")
    def _heights_make_a_scan(self) -> Self:
        if not _FEWEST_HEIGHTS <= (self._count if math.isfinite(self.highest_m / self.step_m) else 0) <= _MOST_HEIGHTS:
            raise ValueError(Text(
                "lowest_m = {low:g}, highest_m = {high:g} and step_m = {step:g} make {count} heights, "
                "{least} to {most} are expected",
                low=self.lowest_m, high=self.highest_m, step=self.step_m, count=max(self._count, 0),
                least=_FEWEST_HEIGHTS, most=_MOST_HEIGHTS,
            ))  # fmt: skip
        return self

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for radii that no ring has."""
        if self.base_inner_radius_m >= self.base_outer_radius_m:
            said = (
                "{table:s}.base_inner_radius_m = {base_inner_radius_m:g} must be less than "
                "{table:s}.base_outer_radius_m = {base_outer_radius_m:g}"
            )
            raise self.refusal(table, said, "base_inner_radius_m", "base_outer_radius_m")


def channels(settings: FieldSettings) -> tuple[Channel, ...]:
    """Return the channels, with all uncertainties known and that of the mean, the only one of a reading's own."""
    return (
        Channel("time_s", "s", "bench clock, from the zero of the probe"),
        Channel("height_m", "m", "of the probe on the axis, as the person set or typed it"),
        Channel("height_u_m", "m", "standard uncertainty of setting a height, from the configuration"),
        Channel("flux_density_t", "T", f"mean of {settings.readings} readings of the magnetometer"),
        Channel("flux_density_u_t", "T", "standard uncertainty: scatter, scale and zero of the instrument"),
        Channel("flux_density_mean_u_t", "T", "the part of it from the scatter and the last digit, each reading's own"),
    )


def run(session: Session[FieldSettings]) -> None:
    """Zero the probe, measure at one height after the other, and at one of them again; a resumed run goes on."""
    heights = session.settings.heights_m
    _set_up(session)
    _zero(session)
    session.begin(lambda: session.progress("probe zeroed", 1.0), resumed="the probe was zeroed again")
    done, since = len(session.rows), session.now()
    for k in range(done, len(heights)):
        height = _place(session, heights[k], Text("{number} of {all}", number=k + 1, all=len(heights)))
        row = _measure(session, height)
        each = (session.now() - since) / (k + 1 - done) or _USUAL_S
        session.keep(row, time_left_s=each * (len(heights) - k))
    _read_again(session)
    session.event(RunEvent.SCANNED, Text("{count} heights are measured", count=len(session.rows)))


def _read_again(session: Session[FieldSettings]) -> None:
    """Read a height of the first half again: by hand a scan takes a quarter of an hour, in which base and probe drift.

    Ferrite loses 0.2 % of its field per kelvin; half a kelvin moves origin and background of the fit by their u, and
    nothing else in the readings shows it.  It shows best where the field is strong and hardly changes with the height:
    the lowest height, where the field is about 0 and steep, would show nothing.
    """
    rows = session.rows
    k = max(range((len(rows) + 1) // 2), key=lambda k: abs(rows[k]["flux_density_t"]) / _u_of_setting(session, k))
    before = rows[k]
    height = _place(session, before["height_m"], Text("{number} again, as the last", number=k + 1))
    row = _measure(session, height)
    drift = row["flux_density_t"] - before["flux_density_t"] - _slope(session, k) * (height - before["height_m"])
    u = math.hypot(row["flux_density_mean_u_t"], _u_of_setting(session, k))
    size = Text(
        "{drift:n} µT at the end of the scan, {in_u:.2g} u", drift=with_sign(1e6 * drift, 1), in_u=abs(drift) / u
    )
    text = Text("the field at {height:.1f} mm changed by {size}", height=1e3 * height, size=size)
    session.event(RunEvent.HEIGHT_READ_AGAIN, text, drift_t=drift, u_t=u)
    if abs(drift) > _MOST_DRIFT_U * u:
        session.warn(
            "base or probe drifted: {drift}, at most {most:g} u are expected; let both come to"
            " one temperature, and scan again in less than {minutes} min",
            drift=text,
            most=_MOST_DRIFT_U,
            minutes=math.ceil(session.now() / 60),
        )


def _slope(session: Session[FieldSettings], k: int) -> float:
    """Return how the field changes with the height [T/m], from the rows beside one."""
    rows = session.rows
    low, high = rows[max(k - 1, 0)], rows[min(k + 1, len(rows) - 1)]
    rise = high["height_m"] - low["height_m"]
    return (high["flux_density_t"] - low["flux_density_t"]) / rise if rise else 0.0


def _u_of_setting(session: Session[FieldSettings], k: int) -> float:
    """Return the u of a difference of two readings at one height by setting that twice, and by its last digit [T]."""
    by_setting = math.sqrt(2) * _slope(session, k) * session.settings.height_u_m
    return math.hypot(by_setting, session.rows[k]["flux_density_mean_u_t"])


def _set_up(session: Session[FieldSettings]) -> None:
    session.bench.magnetometer.prepare(range_t=session.settings.range_t or None)
    if session.settings.range_t:  # else the instrument itself changes its range on the way
        session.bench.record_settings("magnetometer")


def _zero(session: Session[FieldSettings]) -> None:
    """Zero the probe in its chamber.  Each start does that: the instrument may have been off meanwhile."""
    magnetometer, text = session.bench.magnetometer, "Put the probe into its zero-gauss chamber."
    for _ in range(_TRIES_TO_SHIELD):
        session.ask(ShieldProbe(text))
        session.wait(session.settings.settle_s)
        seen = session.insist("magnetometer", magnetometer.flux_density, lambda: _set_up(session))
        if seen is not None and abs(seen) <= _MOST_IN_CHAMBER_T:
            break
        size = "a field beyond its range" if seen is None else Text("{field:.1f} mT", field=1e3 * seen)
        text = Text("The probe sees {size}, and none in its zero-gauss chamber: put it there.", size=size)
    else:
        session.warn(
            "the probe showed {size} before it was zeroed: if it was not in its chamber, all fields are off by that; "
            "scan again",
            size=size,
        )
    session.insist("magnetometer", magnetometer.zero, lambda: _set_up(session))


# --- the heights ---


def _place(session: Session[FieldSettings], height: float, which: str) -> float:
    """Have the probe put at a height; returns the one at which it stands [m]."""
    text = Text("Height {which}: {height:.1f} mm.", which=which, height=1e3 * height)
    while True:
        answer = session.ask(PlaceProbe(text, height))
        if not answer:
            return height
        typed = parse_height(answer)
        if typed is not None:
            session.event(
                RunEvent.ANOTHER_HEIGHT, Text("the probe stands at {height:.2f} mm", height=1e3 * typed), height_m=typed
            )
            return typed
        session.event(
            RunEvent.NOT_UNDERSTOOD,
            Text("{typed} is no height: a number in mm is expected, as 61.5", typed=repr(answer[:40])),
        )


def parse_height(answer: str) -> float | None:
    """Return a height as a person types it, in mm where no unit is said [m]; None for what is none.

    >>> parse_height("61,5"), parse_height("6.15 cm"), parse_height("high")
    (0.0615, 0.0615, None)
    """
    match = _TYPED.fullmatch(answer.strip())
    if match is None:
        return None
    height = float(match[1].replace(",", ".")) * _METRES[(match[2] or "mm").lower()]
    return None if problem_of("height_m", height) else round(height, 9)


# --- the readings ---


def _measure(session: Session[FieldSettings], height: float) -> Row:
    """Return the mean of the readings at a height; set up a magnetometer that fails again, and read again."""

    def measure() -> Row:
        session.wait(session.settings.settle_s)
        begin = session.now()
        values = [_read(session, height) for _ in range(session.settings.readings)]
        session.check_settings("magnetometer")
        return {"time_s": (begin + session.now()) / 2, "height_m": height} | _mean(session.settings, values)

    return session.insist("magnetometer", measure, lambda: _set_up(session))


def _read(session: Session[FieldSettings], height: float) -> float:
    """Return one reading [T], after the interval.  Raises ExperimentFailed beyond the range."""
    session.wait(session.settings.interval_s)
    flux_density = session.bench.magnetometer.flux_density()
    if flux_density is None:
        limit = session.settings.range_t
        seen = Text("beyond the range of {range:g} mT", 1e3 * limit) if limit else "beyond what the probe can measure"
        raise ExperimentFailed(
            "the flux density at {height:.1f} mm is {seen}: choose a larger one (field.range_t in the "
            "bench file), or begin higher up (field.lowest_m)",
            height=1e3 * height,
            seen=seen,
        )
    session.saw("flux_density_t", flux_density)
    return flux_density


def _mean(settings: FieldSettings, values: list[float]) -> Row:
    """Return mean and standard uncertainties [T]; readings that are all equal are known to half of the last digit."""
    n = len(values)
    mean = math.fsum(values) / n
    scatter = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (n - 1) / n)
    own = math.hypot(scatter, _digit(values) / math.sqrt(12))
    whole = math.hypot(own, settings.gain_u * mean, settings.background_u_t)
    return {
        "height_u_m": settings.height_u_m,
        "flux_density_t": mean,
        "flux_density_u_t": whole,
        "flux_density_mean_u_t": own,
    }


def _digit(values: list[float]) -> float:
    """Return the last digit of the instrument [T]: the least step between readings, or that of six digits."""
    different = sorted(set(values))
    steps = [b - a for a, b in pairwise(different)]
    largest = max(abs(value) for value in values)
    return min(steps) if steps else 10.0 ** (math.floor(math.log10(largest)) - 5) if largest else 1e-7


EXPERIMENT = Experiment(
    name="field",
    about="the base's flux density on its axis, at one height after the other",
    instruments=("magnetometer",),
    settings=FieldSettings,
    channels=channels,
    run=run,
)
