"""What a spin frequency and its slope mean, in sentences that a student understands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.numbers import digits
from levilab.present.numbers import with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from levilab.pipelines.spin.analysis import SpinAnalysis, SpinRun

#: A slope of so many u is one.
_SEEN = 3.0
#: What air takes of the spin of a free top at 20 to 45 Hz, a second: 0.3 %, and twice or half of it for other tops.
_AIR = (1.5e-3, 6e-3)
#: An uncertainty within this factor of the bound can hardly be made better by another method.
_AT_BOUND = 1.5
#: Inputs that sentences are made of; of more there is a table.
_MOST = 4


def meaning(analysis: SpinAnalysis) -> tuple[str, ...]:
    """The sentences, of each input."""
    several = len(analysis.runs) > 1
    made = (
        (source.name, " ".join(_sentences(run)))
        for source, run in zip(analysis.sources[:_MOST], analysis.runs[:_MOST], strict=True)
    )
    return tuple(f"{name}: {text}" if several else text for name, text in made if text)


def _sentences(run: SpinRun) -> Iterator[str]:
    spin = run.spin
    frequency, chirp = spin.frequency, spin.chirp
    if not frequency.value:
        return
    yield f"The top turns with {with_uncertainty(frequency)}, {60 * frequency.value:.0f} times a minute."
    if chirp.value is None or not chirp.u:
        return
    share = chirp.value / frequency.value
    if abs(chirp.value) < _SEEN * chirp.u:
        most = (abs(chirp.value) + 2 * chirp.u) / frequency.value
        yield (
            "Whether it gets slower this record does not show; it loses or gains less than "
            f"{digits(100 * most)} % a second."
        )
    elif share > 0:
        yield f"It gains {digits(100 * share)} % of its spin a second: something drives it."
    elif _AIR[0] < -share < _AIR[1]:
        yield f"It loses {digits(-100 * share)} % of its spin a second, as a free top does in air."
    else:
        why = "more than air takes: does it touch something, or does a drive brake it?" if -share > _AIR[1] else (
            "less than air takes from a free top: does a drive hold it?"
        )  # fmt: skip
        yield f"It loses {digits(-100 * share)} % of its spin a second, {why}"
    if spin.bound and frequency.u:
        ratio = frequency.u / spin.bound
        if ratio < _AT_BOUND:
            yield "With such noise no other method would find it much better."
        else:
            yield (
                f"The uncertainty is {digits(ratio)} times the least that any method could reach with such noise: the "
                "pulses themselves scatter, or the samples lie far apart."
            )
