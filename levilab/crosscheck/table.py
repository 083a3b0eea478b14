"""What a cross-check found, as a table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from levilab.crosscheck.study import COVERAGE
from levilab.present.numbers import signed
from levilab.present.tables import Row, Table, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from levilab.crosscheck.study import Checked, Spread

_NUMBERS = ("trials", "mean pull", "s.d. of pulls", "within 1 u", "u/value")


def crosscheck_table(checked: Sequence[Checked]) -> Table:
    """A row a quantity; the parentheses hold the standard errors that so few trials leave."""
    return table(
        "Pulls: (estimate − truth)/u; wanted are 0, 1 and 68 %",
        ("", "quantity", *_NUMBERS, "as wanted"),
        _rows(checked),
        numbers=_NUMBERS,
    )


def _rows(checked: Sequence[Checked]) -> Iterator[Row]:
    for one in checked:
        for k, spread in enumerate(one.spreads):
            cells = _cells(spread)
            yield Row((one.subject.name if k == 0 else "", *cells), "together" if k == 0 else "")


def _cells(spread: Spread) -> tuple[str, ...]:
    n = spread.n
    return (
        spread.quantity,
        str(n),
        f"{signed(spread.mean, 2)} ± {1 / math.sqrt(n):.2f}",
        "–" if math.isnan(spread.deviation) else f"{spread.deviation:.2f} ± {1 / math.sqrt(2 * n):.2f}",
        f"{100 * spread.coverage:.0f} ± {100 * math.sqrt(COVERAGE * (1 - COVERAGE) / n):.0f} %",
        _percent(spread.relative_u),
        "yes" if spread.holds else "NO",
    )


def _percent(part: float) -> str:
    """Two digits, and no power of ten.

    >>> _percent(0.00041), _percent(1.34)
    ('0.041 %', '134 %')
    """
    return f"{100 * part:.0f} %" if abs(part) >= 1 else f"{100 * part:.2g} %"


def failures_in_words(checked: Sequence[Checked]) -> list[str]:
    """A line for each reason for which trials came to no estimate."""
    return [
        f"{one.subject.name}: {count} of {one.trials} trials came to no estimate: {reason}"
        for one in checked
        for reason, count in sorted(one.failures.items(), key=lambda item: -item[1])
    ]
