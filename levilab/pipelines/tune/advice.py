"""Which washers to take next, with what chances, and why: for people and for programs."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from analysis.numbers import digits, with_minus
from analysis.tuning import Outcome, Posterior, Prior, combinations, learn
from analysis.uncertainty import Estimate
from levilab.errors import UsageError
from levilab.files import finite
from levilab.pipelines.document import values_of
from levilab.pipelines.row import Quantity
from levilab.pipelines.tune.owner import Owner, in_grams, washers_text
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.present.tables import Row, Table, table
from levilab.texts.text import Sentences, Text

SCHEMA = "levilab-tune/1"
#: Without a scan the middle lies within the reach of the washers, and this share of the mass beyond.
_BEYOND = 0.01
#: Fewer changes of washers are taken for this much less promise, which is from 0 to 2.
_SAME = 0.02
#: Rows of the table of chances; and the chance of failing the same way beyond which no washers will do.
_ROWS, _OUT_OF_REACH = 5, 0.8
#: Chance of a trial's outcome, by the other trials, below which it is named: that of a lapse is 0.02, and more beside
#: soft edges.
_UNLIKELY = 0.05
#: A difference of temperature that is worth a word [K].
_NOTABLE_K = 0.3
MET = {
    Outcome.RISES: "It rose at {mass:n} and {t:g} °C.",
    Outcome.FLOATS: "It floated at {mass:n} and {t:g} °C.",
    Outcome.SINKS: "It sank at {mass:n} and {t:g} °C.",
    Outcome.SIDEWAYS: "It slid off sideways at {mass:n} and {t:g} °C.",
}


@dataclass(frozen=True)
class Choice:
    """Some of the owner's washers, the top's mass with them, and the probabilities of the outcomes."""

    washers_kg: tuple[float, ...]
    mass_kg: float
    rises: float
    floats: float
    sinks: float


@dataclass(frozen=True, eq=False)
class Advice:
    """Washers to try next.

    Attributes:
        owner: of the top.
        temperature: today's [°C].
        posterior: of the window.
        best: to try next.
        choices: the likeliest to float, the lightest first.
    """

    owner: Owner
    temperature: float
    posterior: Posterior
    best: Choice
    choices: tuple[Choice, ...]

    @cached_property
    def values(self) -> dict[str, Estimate]:
        """The numbers at today's temperature."""
        return self.posterior.values(self.temperature)

    def _show(self, name: str) -> str:
        return _in_people_units(self.values[name])

    @property
    def text(self) -> str:
        """The next step, in a sentence."""
        said = "{step}: the top then weighs {mass:n} and floats with a chance of {chance}."
        return Text(said, step=self._step, mass=in_grams(self.best.mass_kg), chance=_percent(self.best.floats))

    @property
    def _step(self) -> str:
        last = self.owner.attempts[-1] if self.owner.attempts else None
        if last and last.outcome is Outcome.SIDEWAYS and last.washers == self.best.washers_kg:
            return "Raise the base on the side to which the top slid, and leave the washers as they are"
        if last is None or last.washers is None:
            put_on = Text("Put on {washers}", washers=_named(self.best.washers_kg))
            return put_on if self.best.washers_kg else "Take no washers"
        on, wanted = Counter(last.washers), Counter(self.best.washers_kg)
        off, more = (_named([*some.elements()]) for some in (on - wanted, wanted - on))
        if off:
            return Text("Take off {off} and add {on}" if more else "Take off {off}", off=off, on=more)
        return Text("Add {on}", on=more) if more else "Leave the washers as they are"

    @property
    def why(self) -> str:
        """The reason, in one or two sentences."""
        middle = Text("The middle of the window is now estimated at {mass:n}.", mass=self._show("mass_to_set"))
        return Sentences(*self._reasons, middle, self._likelier, self._beyond_reach)

    @property
    def _likelier(self) -> str:
        """Return why another choice of the table is not the best; empty where none is."""
        most = max(self.choices, key=lambda one: one.floats)
        chance = _percent(most.floats)
        if chance == _percent(self.best.floats):
            return ""
        on = self.owner.attempts[-1].washers if self.owner.attempts else None
        few = _changes(on, self.best.washers_kg) < _changes(on, most.washers_kg)
        said = "{washers:n} floats with {chance}, but takes more changes."
        said = said if few else "{washers:n} floats with {chance}, but leaves less to try next if it fails."
        return Text(said, washers=washers_text(most.washers_kg), chance=chance)

    @property
    def _reasons(self) -> Iterator[str]:
        """Yield the last trial, the change of temperature and the scan, as sentences."""
        scan, last = self.owner.scan, self.owner.attempts[-1] if self.owner.attempts else None
        if last:
            yield Text(MET[last.outcome], mass=in_grams(last.mass), t=last.temperature)
            if abs(warmer := self.temperature - last.temperature) >= _NOTABLE_K:
                change = with_minus(f"{1e3 * warmer * (self.values['mass_per_kelvin'].value or 0.0):+.2f}")
                said = "Today is {kelvin:n} K warmer, which moves the window by {change:n} g."
                said = said if warmer > 0 else "Today is {kelvin:n} K colder, which moves the window by {change:n} g."
                yield Text(said, kelvin=digits(abs(warmer)), change=change)
        if scan:
            said = "By the scan the middle was {mass:n} at {t:g} °C."
            yield Text(said, mass=_in_people_units(scan.middle), t=scan.temperature_c)
        elif not last:
            yield "Nothing is known yet, and a mass in the middle of the washers' reach tells most."

    @property
    def _beyond_reach(self) -> str:
        """Return the mass beyond the reach of the washers, as a sentence; empty within it."""
        middle, top = self.values["mass_to_set"].value or 0.0, self.owner.top or 0.0
        heaviest = top + sum(self.owner.washers)
        if self.best.rises > _OUT_OF_REACH and middle > heaviest:
            more = "Even with all washers it would rise: {g:n} g more are needed."
            return Text(more, g=digits(1e3 * (middle - heaviest)))
        if self.best.sinks > _OUT_OF_REACH and middle < top:
            less = "Even without washers it would sink: it is {g:n} g too heavy today."
            return Text(less, g=digits(1e3 * (top - middle)))
        return ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Trials that the others, the scan and the temperature make unlikely."""
        texts = []
        for number, one in enumerate(self.owner.attempts, 1):
            if one.outcome is not Outcome.SIDEWAYS and self.posterior.chance_by_others(one) < _UNLIKELY:
                said = (
                    "trial {number} ({trial:s}) does not go with the other trials or the scan: was it let go badly, or "
                    "is a mass, a temperature or the scan wrong?"
                )
                texts.append(Text(said, number=number, trial=one.text))
        return tuple(texts)

    @property
    def window(self) -> str:
        """The window, in numbers."""
        width, smallest = self.values["window_width"], min(self.owner.washers, default=0.0)
        of_washers = ""
        if smallest:
            n = Estimate((width.value or 0.0) / smallest, (width.u or 0.0) / smallest, "1")
            of_washers = Text(" ({n:n} washers of {mass:n})", n=with_uncertainty(n), mass=in_grams(smallest))
        mass, wide, moves = map(self._show, ("mass_to_set", "window_width", "mass_per_kelvin"))
        said = "Mass to set at {t:g} °C: {mass:n}; the window is {wide:n} wide{washers} and moves by {moves:n}."
        return Text(said, t=self.temperature, mass=mass, wide=wide, washers=of_washers, moves=moves)

    @property
    def table(self) -> Table:
        """The chances of the best choices."""
        heads = ("washers", "mass", "rises", "floats", "sinks")
        rows = [
            Row((
                Text("{washers:n}", washers=washers_text(one.washers_kg)), in_grams(one.mass_kg),
                *map(_percent, (one.rises, one.floats, one.sinks)),
            ), "best" * (one is self.best))
            for one in self.choices
        ]  # fmt: skip
        return table(Text("Which washers at {t:g} °C", t=self.temperature), heads, rows, numbers=heads[1:])

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in SI, for JSON."""
        owner = self.owner
        document: dict[str, Any] = finite({
            "schema": SCHEMA,
            "temperature_c": self.temperature,
            "top_kg": owner.top,
            "washers_kg": list(owner.washers),
            "trials": [
                {"mass_kg": one.mass, "temperature_c": one.temperature, "outcome": one.outcome.value}
                for one in owner.attempts
            ],
            "scan": owner.scan.model_dump() if owner.scan else None,
            "values": values_of(self.values),
            "best": vars(self.best),
            "choices": [vars(one) for one in self.choices],
            "text": self.text,
            "why": self.why,
            "warnings": list(self.warnings),
        })  # fmt: skip
        return document


def advise(owner: Owner, temperature: float) -> Advice:
    """Return the washers to try next at a temperature [°C].

    Raises:
        UsageError: the top's mass is not known.
    """
    if owner.top is None:
        raise UsageError("top", "the mass of the top without washers is needed, such as 24.9 g")
    on = owner.attempts[-1].washers if owner.attempts else None
    different = combinations(owner.washers)
    if on and not Counter(on) - Counter(owner.washers):  # before others of the same mass
        same = min(range(len(different)), key=lambda k: abs(sum(different[k]) - sum(on)))
        different[same] = on
    masses = owner.top + np.array([sum(one) for one in different])
    posterior = learn(owner.attempts, _prior(owner, masses, temperature))
    promise = posterior.promise(masses, temperature)
    best = min(
        np.flatnonzero(promise >= promise.max() - _SAME), key=lambda k: (_changes(on, different[k]), -promise[k])
    )
    shown = sorted({int(best), *np.argsort(-promise, kind="stable")[: _ROWS - 1].tolist()})
    chances = posterior.outcomes(masses[shown], temperature) @ posterior.weight
    rows = tuple(
        Choice(different[k], float(masses[k]), *map(float, of)) for k, of in zip(shown, chances.T, strict=True)
    )
    return Advice(owner, temperature, posterior, rows[shown.index(best)], rows)


def _prior(owner: Owner, masses: np.ndarray, temperature: float) -> Prior:
    if scan := owner.scan:
        return Prior.of_scan(scan.middle, scan.lightest_kg, scan.heaviest_kg, scan.temperature_c)
    reach = [*masses[[0, -1]], *(one.mass for one in owner.attempts)]
    return Prior(min(reach) * (1 - _BEYOND), max(reach) * (1 + _BEYOND), temperature=temperature)


def _changes(on: tuple[float, ...] | None, wanted: Sequence[float]) -> int:
    """Return the number of washers to put on and to take off."""
    now, then = Counter(on or ()), Counter(wanted)
    return (now - then).total() + (then - now).total()


def _named(washers: Sequence[float]) -> str:
    """Return washers with their article.

    >>> _named([6e-5, 6e-5, 1e-4]), _named([1e-4])
    ('2 washers of 0.06 g and the 0.1 g washer', 'the 0.1 g washer')
    """
    return enumeration([
        Text("{n} washers of {mass:n}" if n > 1 else "the {mass:n} washer", n=n, mass=in_grams(one))
        for one, n in sorted(Counter(washers).items())
    ] or [""])  # fmt: skip


def _percent(chance: float) -> str:
    return f"{100 * chance:.0f} %"


def _in_people_units(one: Estimate) -> str:
    return with_uncertainty(Quantity("", one.unit, "").show(one))
