"""What a scene leaves out → text on a terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.explain import LEAST_HZ, LEAST_M
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from levilab.explain import Effect


def print_effects(effects: Sequence[Effect]) -> None:
    """One row an effect: in or out, and what it changes."""
    changes = ("height \\[mm]", "precession \\[Hz]", "spin at the end \\[Hz]")
    table = new_table(
        "What is in this scene, and what is left out", "effect", "", *changes, "what it is, what else it does",
        numbers=changes,
    )  # fmt: skip
    for effect in effects:
        words = f"{effect.what}; {effect.remark}" if effect.remark else effect.what
        table.add_row(
            effect.name,
            "in" if effect.included else "out",
            _shown(effect.height_m, LEAST_M, 1e3),
            _shown(effect.precession_hz, LEAST_HZ, 1),
            _shown(effect.spin_hz, LEAST_HZ, 1),
            escape(words),
        )
    table.caption = (
        "changes that the effect makes when it is there and nothing else is different, computed for this scene;\n"
        "– where one of the two motions has no such number"
    )
    table.caption_justify = "left"
    terminal().print(table)


def _shown(change: float, least: float, factor: float) -> str:
    """Two digits: the next effect changes the third."""
    if math.isnan(change):
        return "–"
    return f"{factor * change:+.2g}" if change else f"< {factor * least:g}"
