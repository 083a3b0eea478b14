"""Findings about pulses and lines, as sentences."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from analysis.numbers import digits
from analysis.pulses import Finding
from levilab.present.numbers import how_many


def finding_text(found: Finding, part: str = "window") -> str:
    """Return the sentence of a finding.  part: "window" or "record", several of which were searched.

    >>> finding_text(Finding("missing", values=(1, 40), where=(2, 1, 5)), "record")
    'record 2: 1 turn has no pulse'
    """
    whole = (int(value) if float(value).is_integer() else value for value in found.values)  # a result has 31.0
    text = _SENTENCES[found.name, found.of](*whole)
    if not found.where:
        return text
    first, number, of = found.where
    which = f"all {of}" if number == of else f"{number} of {of}"
    return f"{part} {first}: {text}" if number == 1 else f"in {which} {part}s, as in {part} {first}: {text}"


def _hum(*lines: float) -> str:
    pairs = zip(lines[::2], lines[1::2], strict=True)
    each = " and ".join(f"{digits(size)} at {hertz:.5g} Hz" for hertz, size in pairs)
    return f"hum of amplitude {each} was taken off"


def _jump(lost_s: float, at_s: float) -> str:
    size = f"{digits(abs(1e3 * lost_s), 3)} ms, or that and whole turns,"
    return f"the record {'misses' if lost_s > 0 else 'repeats'} {size} at {at_s:.5g} s: allowed for"


def _missing(missing: float, pulses: float) -> str:
    rare = ", more than have one: is the spin a part of this?" if missing > pulses else ""
    return f"{missing} turn{'s have' if missing > 1 else ' has'} no pulse{rare}"


def _correlated(what: str) -> Callable[[float], str]:
    def text(inflation: float) -> str:
        alike = "resemble each other" if inflation > 1 else "differ from each other, which averages out"
        return f"neighbouring {what} {alike}: variance x {digits(inflation)}"

    return text


def _scattered(why: str) -> Callable[[float], str]:
    return lambda turns: f"the pulses come early or late by {digits(turns, 2)} turns (rms): {why}"


def _fell_back(why: str) -> Callable[..., str]:
    return lambda *values: f"{why.format(*values)}: the greatest likelihood was searched for"


def _double(why: str) -> Callable[[], str]:
    return lambda: f"every second pulse {why}: two marks a turn, twice the frequency was not taken"


def _no_pulses(why: str) -> Callable[[float, float], str]:
    return lambda left_out, records: f"{left_out} of {records} records are left out: {why}"


def _unlike(hertz: float, time: float, other_hertz: float, other_time: float, number: float) -> str:
    seen = f"{hertz:.4g} Hz at {time:.4g} s and {other_hertz:.4g} Hz at {other_time:.4g} s"
    often = f" ({number} times)" if number > 1 else ""
    return f"neighbouring windows have {seen}: pulses are missing or doubled in a pattern{often}"


def _choices(folds: tuple[float, ...]) -> str:
    return " or ".join(f"{fold:.2f}" for fold in folds)


def _fold_doubt(rate: float, *folds: float) -> str:
    return (
        f"at {rate:.4g} samples/s the spin may be {_choices(folds)} Hz: the times are too even and the slope too small "
        f"to know; choose with `near` = {folds[0]:.0f} or {folds[1]:.0f}"
    )


def _folded(rate: float, *folds: float) -> str:
    return (
        f"{folds[0]:.2f} Hz is above half of {rate:.4g} samples/s, where it looks like {_choices(folds[1:])} Hz: if a "
        f"drive speeds the top up, choose with `near` = {folds[1]:.0f}"
    )


def _fold_by_slope(rate: float, *folds: float) -> str:
    return (
        f"at {rate:.4g} samples/s {_choices(folds)} Hz look alike: the first is taken, since a free spin falls; if a "
        f"drive speeds the top up, choose with `near` = {folds[1]:.0f}"
    )


#: Name and case of a finding → its values as a sentence.
_SENTENCES: Mapping[tuple[str, str], Callable[..., str]] = MappingProxyType({
    ("missing", ""): _missing,
    ("doubled", ""): lambda n: f"{how_many(n, 'pulse')} beside the turns' own left out",
    ("wrong", ""): lambda n: f"{how_many(n, 'pulse')} not at the place of a turn left out",
    ("jump", ""): _jump,
    ("half", ""): lambda: "two equal pulses a turn: half the frequency fitted too, and was not taken",
    ("double", "height"): _double("has another height"),
    ("double", "place"): _double("is not half-way between its neighbours"),
    ("mains", ""): lambda hertz: f"the frequency is {hertz:g} Hz and stays: is it the mains (a lamp, hum), or a drive "
                                 "locked to them?",
    ("hum", ""): _hum,
    ("clipped", ""): lambda: "the tops of the pulses are flat: the detector or the converter is saturated",
    ("gap", ""): lambda seconds: f"the signal is constant for {digits(seconds, 3)} s in all",
    ("not-finite", ""): lambda n: f"{n} samples are no finite numbers and do not count",
    ("wander", ""): lambda size: f"the baseline wanders by {digits(size)} and was taken off",
    ("coarse", ""): lambda n: f"a turn has {digits(n, 2)} samples only: a faster top may look the same",
    ("correlated", "pulses"): _correlated("pulses"),
    ("correlated", "turns"): _correlated("turns"),
    ("scattered", "in u"): _scattered("a mean pulse does not show it, so their own places are in the uncertainty"),
    ("scattered", "one by one"): _scattered("each was timed by itself, without a mean pulse"),
    ("fell-back", "no pulses"): _fell_back("no pulses stand out that return regularly"),
    ("fell-back", "astray"): _fell_back("more pulses lie beside the turns than at them"),
    ("fell-back", "sweep"): _fell_back("the frequency would change by {:.3g} Hz"),
    ("fell-back", "missing"): _fell_back("{} of {} turns have no pulse"),
    ("fell-back", "wrong"): _fell_back("{} of {} pulses are not at their place"),
    ("unlike", ""): _unlike,
    ("folded", ""): _folded,
    ("fold-doubt", ""): _fold_doubt,
    ("fold-by-slope", ""): _fold_by_slope,
    ("regular", ""): lambda *_: "the samples lie more evenly than their times say: the times tell nothing above half "
                                "the rate",
    ("weak", ""): lambda *_: "the line hardly stands out of the noise: bring the magnetometer nearer",
    ("on-mains", ""): lambda *_: "the line lies on 50 or 60 Hz: is it the mains, or a drive locked to them?",
    ("no-pulses", ""): _no_pulses("no pulses that return regularly"),
    ("no-pulses", "hum"): _no_pulses("hum of the mains, and no pulses that return regularly"),
})  # fmt: skip
