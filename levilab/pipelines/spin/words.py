"""Findings about pulses and lines, as sentences."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from analysis.numbers import digits
from analysis.pulses import Finding
from analysis.pulses.times import FASTEST_BY_DRIVE_HZ
from levilab.present.numbers import enumeration, filled
from levilab.texts.note import Weight
from levilab.texts.text import Text, how_many

#: Findings that leave open which of several spins is the right one.
_DOUBTS = frozenset({("fast", ""), ("fold-doubt", ""), ("hum", "spin")})
#: About the option `near` where it has no effect.
NEAR_UNUSED = "`near` is not used: only a magnetometer's samples and a film's pictures leave a choice of spins"


def finding_weight(found: Finding) -> Weight:
    """Return the weight of a finding: a top that a drive left above 60 Hz is too fast in its first windows alone."""
    in_part = found.name == "fast" and bool(found.where) and found.where[1] < found.where[2]
    by_drive = in_part and found.values[0] < FASTEST_BY_DRIVE_HZ
    return "doubt" if (found.name, found.of) in _DOUBTS and not by_drive else "warning"


def finding_text(found: Finding, part: str = "window") -> str:
    """Return the sentence of a finding.  part: "window" or "record", several of which were searched.

    >>> finding_text(Finding("missing", values=(1, 40), where=(2, 1, 5)), "record")
    'record 2: 1 turn has no pulse'
    """
    whole = (int(value) if float(value).is_integer() else value for value in found.values)  # a result has 31.0
    said = _SENTENCES[found.name, found.of]
    text = filled(said, whole) if isinstance(said, str) else said(*whole)
    if not found.where:
        return text
    first, number, of = found.where
    if number == 1:
        return Text("{part} {first}: {text}", part=part, first=first, text=text)
    which = Text("all {of}", of=of) if number == of else Text("{number} of {of}", number=number, of=of)
    sample = "in {which} {parts}, as in {part} {first}: {text}"
    return Text(sample, which=which, parts=f"{part}s", part=part, first=first, text=text)


def _hum(*lines: float, said: str = "hum of amplitude {each} was taken off") -> str:
    pairs = zip(lines[::2], lines[1::2], strict=True)
    each = [Text("{size:n} at {hertz:.5g} Hz", size=digits(size), hertz=hertz) for hertz, size in pairs]
    return Text(said, each=enumeration(each))


def _jump(lost_s: float, at_s: float) -> str:
    said = (
        "the record misses {size:n} ms, or that and whole turns, at {at:.5g} s: allowed for"
        if lost_s > 0
        else "the record repeats {size:n} ms, or that and whole turns, at {at:.5g} s: allowed for"
    )
    return Text(said, size=digits(abs(1e3 * lost_s), 3), at=at_s)


def _missing(missing: float, pulses: float) -> str:
    rare = Text(", more than have one: is the spin a part of this?") if missing > pulses else ""
    return Text("{n} turns have no pulse{rare}" if missing > 1 else "{n} turn has no pulse{rare}", n=missing, rare=rare)


def _correlated(what: str) -> Callable[[float], str]:
    def text(inflation: float) -> str:
        alike = (
            "neighbouring {what} resemble each other: variance x {inflation:n}"
            if inflation > 1
            else "neighbouring {what} differ from each other, which averages out: variance x {inflation:n}"
        )
        return Text(alike, what=what, inflation=digits(inflation))

    return text


def _scattered(why: str) -> Callable[[float], str]:
    said = "the pulses come early or late by {turns:n} turns (rms): {why}"
    return lambda turns: Text(said, turns=digits(turns, 2), why=why)


def _fell_back(why: str) -> Callable[..., str]:
    said = "{why}: the greatest likelihood was searched for"
    return lambda *values: Text(said, why=Text(why, **dict(zip("ab", values, strict=False))))


def _double(why: str) -> Callable[[], str]:
    return lambda: Text("every second pulse {why}: two marks a turn, twice the frequency was not taken", why=why)


def _no_pulses(why: str) -> Callable[[float, float], str]:
    said = "{left_out} of {records} records are left out: {why}"
    return lambda left_out, records: Text(said, left_out=left_out, records=records, why=why)


def _unlike(hertz: float, time: float, other_hertz: float, other_time: float, number: float) -> str:
    return Text(
        "neighbouring windows have {hertz:.4g} Hz at {time:.4g} s and {other_hertz:.4g} Hz at {other_time:.4g} s: "
        "pulses are missing or doubled in a pattern{often}",
        hertz=hertz, time=time, other_hertz=other_hertz, other_time=other_time,
        often=Text(" ({number} times)", number) if number > 1 else "",
    )  # fmt: skip


def _choices(folds: tuple[float, ...]) -> str:
    said = f"{folds[0]:.2f}"
    for fold in folds[1:]:
        said = Text("{said:n} or {fold:.2f}", said=said, fold=fold)
    return said


def _fold_doubt(rate: float, *folds: float) -> str:
    return Text(
        "at {rate:.4g} samples/s the spin may be {choices:n} Hz: the times are too even, and the slope "
        "tells too little; choose with `near` = {first:.0f} or {other:.0f}",
        rate=rate, choices=_choices(folds), first=folds[0], other=folds[1],
    )  # fmt: skip


def _folded(rate: float, *folds: float) -> str:
    return Text(
        "{first:.2f} Hz is above half of {rate:.4g} samples/s, where it looks like {choices:n} Hz: if a drive speeds "
        "the top up, choose with `near` = {other:.0f}",
        first=folds[0], rate=rate, choices=_choices(folds[1:]), other=folds[1],
    )  # fmt: skip


def _fold_by_slope(rate: float, *folds: float) -> str:
    return Text(
        "at {rate:.4g} samples/s {choices:n} Hz look alike: the first is taken, since a free spin falls; if a drive "
        "speeds the top up, choose with `near` = {other:.0f}",
        rate=rate, choices=_choices(folds), other=folds[1],
    )  # fmt: skip


#: Name and case of a finding → its sentence, with its values in their order, or what makes one of them.
_SENTENCES: Mapping[tuple[str, str], str | Callable[..., str]] = MappingProxyType({
    ("missing", ""): _missing,
    ("doubled", ""): lambda n: Text("{pulses} beside the turns' own left out", pulses=how_many(n, "pulse")),
    ("wrong", ""): lambda n: Text("{pulses} not at the place of a turn left out", pulses=how_many(n, "pulse")),
    ("jump", ""): _jump,
    ("half", ""): "two equal pulses a turn: half the frequency fitted too, and was not taken",
    ("double", "height"): _double("has another height"),
    ("double", "place"): _double("is not half-way between its neighbours"),
    ("mains", ""): "the frequency is {hertz:g} Hz and stays: is it the mains (a lamp, hum), or a drive locked to them?",
    ("hum", ""): _hum,
    ("hum", "spin"): partial(
        _hum, said="{each} was taken off as hum of the mains, and less is left: is it the spin? Shield the coil, or "
        "measure at another spin"
    ),
    ("hum", "harmonic"): partial(_hum, said="{each} was taken off: hum of the mains, or a harmonic of the spin"),
    ("clipped", ""): "the tops of the pulses are flat: the detector or the converter is saturated",
    ("gap", ""): lambda seconds: Text("the signal is constant for {s:n} s in all", s=digits(seconds, 3)),
    ("not-finite", ""): "{n} samples are no finite numbers and do not count",
    ("wander", ""): "the baseline wanders by {size:n} and was taken off",
    ("coarse", ""): "a turn has {n:n} samples only: a faster top may look the same",
    ("fast", ""): "{a:.4g} Hz is too fast for a hand: without a drive there are two marks at {b:.4g} Hz; cover one",
    ("correlated", "pulses"): _correlated("pulses"),
    ("correlated", "turns"): _correlated("turns"),
    ("scattered", "in u"): _scattered("a mean pulse does not show it, so their own places are in the uncertainty"),
    ("scattered", "one by one"): _scattered("each was timed by itself, without a mean pulse"),
    ("fell-back", "no pulses"): _fell_back("no pulses stand out that return regularly"),
    ("fell-back", "astray"): _fell_back("more pulses lie beside the turns than at them"),
    ("fell-back", "sweep"): _fell_back("the frequency would change by {a:.3g} Hz"),
    ("fell-back", "missing"): _fell_back("{a} of {b} turns have no pulse"),
    ("fell-back", "wrong"): _fell_back("{a} of {b} pulses are not at their place"),
    ("unlike", ""): _unlike,
    ("folded", ""): _folded,
    ("fold-doubt", ""): _fold_doubt,
    ("fold-by-slope", ""): _fold_by_slope,
    ("regular", ""): "the samples lie more evenly than their times say: the times tell nothing above half the rate",
    ("weak", ""): "the line hardly stands out of the noise: bring the magnetometer nearer",
    ("on-mains", ""): "the line lies on 50 or 60 Hz: is it the mains, or a drive locked to them?",
    ("no-pulses", ""): _no_pulses("no pulses that return regularly"),
    ("no-pulses", "hum"): _no_pulses("hum of the mains, and no pulses that return regularly"),
})  # fmt: skip
