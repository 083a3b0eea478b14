"""The house's plain notation of powers and indices → runs of text, which each format sets high or low.

Plain text says 10⁻³, s⁻¹, (rad/s)^−½ and C₃/₂, so that a terminal can print it.  A format that can set text high or low
asks here, and gets a minus for a hyphen before a number, which a person may have typed; nothing else is ever changed.
"""

import re
from dataclasses import dataclass
from typing import Literal

Level = Literal["", "high", "low"]

#: A hyphen that is a minus: at the beginning, or after a blank, a bracket or a sign, and before a digit.
_MINUS = re.compile(r"(?:(?<=[\s(\[=±×])|(?<!.))-(?=\d)")
#: The blank between a number and its unit, where no line ends.
_UNIT = re.compile(r"(?<=[\d)]) (?=(?:%|m?Hz|rad|g|mm|cm|[mµ]T|Vpp)(?!\w))")
_HIGH = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹ⁿ-", "+−0123456789n−")
_LOW = str.maketrans("₊₋₀₁₂₃₄₅₆₇₈₉", "+−0123456789")
#: Powers by raised characters, and those that no raised character exists for: ^−½, ^½, ^−4/5 and ^(1−n).
#: Indices by lowered characters, the fraction of C₃/₂ among them; ν_r: a Greek letter, a low line, one letter; and
#: B_z: a plain letter with the name of a component, which is no part of a file's name and no column (x_m, time_s).
_RUNS = re.compile(
    r"(?P<raised>[⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹ⁿ]+)|\^(?P<half>−?½|−\d+/\d+)|(?<=rad/s\))\^(?P<ascii>-\d+/\d+)|\^\((?P<power>[^()]+)\)"
    r"|(?P<lowered>[₊₋₀₁₂₃₄₅₆₇₈₉]+(?:/[₀₁₂₃₄₅₆₇₈₉]+)?)|(?<=[α-ωΑ-Ω])_(?P<index>[a-zA-Z0-9])(?![a-zA-Z0-9_])"
    r"|(?<=(?<![\w./\\-])[a-zA-Z])_(?P<component>[xyz])(?![\w/\\-]|\.\w)"
)


@dataclass(frozen=True)
class Run:
    """Text of one level.  level: "" on the line, "high" or "low"."""

    text: str
    level: Level = ""


def typeset(text: str) -> tuple[Run, ...]:
    """Return a plain text as runs.

    >>> [(run.text, run.level) for run in typeset("2.34(3)×10⁻⁴ (rad/s)^−½/s")]
    [('2.34(3)×10', ''), ('−4', 'high'), (' (rad/s)', ''), ('−½', 'high'), ('/s', '')]
    >>> [run.text for run in typeset("C₃/₂, ν_r, but file_r and x^2") if run.level == "low"]
    ['3/2', 'r']
    >>> [run.text for run in typeset("n_x + i n_y, B_z. But x_m, a_x.csv, of_x, b/a_z, a_1")if run.level == "low"]
    ['x', 'y', 'z']
    >>> [run.text for run in typeset("-0.012 of 2026-11-22-run -3")]
    ['−0.012 of 2026-11-22-run −3']
    >>> typeset("")
    ()
    """
    text = _UNIT.sub("\u00a0", _MINUS.sub("−", text))
    runs: list[Run] = []
    at = 0
    for found in _RUNS.finditer(text):
        if found.start() > at:
            runs.append(Run(text[at : found.start()]))
        runs.append(_run(found))
        at = found.end()
    return (*runs, Run(text[at:])) if at < len(text) else tuple(runs)


def _run(found: re.Match[str]) -> Run:
    name = str(found.lastgroup)
    if name in {"lowered", "index", "component"}:
        return Run(found[name].translate(_LOW), "low")
    return Run(found[name].translate(_HIGH), "high")
