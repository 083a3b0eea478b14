"""A simulated motion → text on a terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape

from analysis.numbers import with_minus
from levilab.motion.effects import LEAST_HZ, LEAST_M
from levilab.motion.lock import is_locked
from levilab.motion.summary import changing_energy
from levilab.present.numbers import with_decimals
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console
    from rich.table import Table

    from levilab.motion.effects import Effect
    from levilab.motion.summary import Summary


def print_motion(summary: Summary, console: Console | None = None) -> None:
    """Print the end of the motion, its numbers, the lines of the axis, the errors, and the warnings.

    Args:
        summary: of the motion.
        console: where it is printed, by default the terminal.
    """
    out = console or terminal()
    out.print(f"[bold]{escape(headline(summary))}[/bold]")
    facts = new_table(None, "", "")
    facts.show_header = False
    for what, text in (*_motion_facts(summary), *_quality_facts(summary)):
        facts.add_row(what, text)
    out.print(facts)
    if summary.lines.lines:
        out.print(_lines_table(summary))
    for note in summary.notes:
        out.print(f"[yellow]note:[/yellow] {escape(note)}")


def headline(summary: Summary) -> str:
    """Return one line about the end of a motion."""
    name = summary.motion.scene.name or "the scene"
    if summary.motion.scene.observed == "spin":
        return f"{name}: the spin alone, for {summary.duration:g} s"
    if summary.motion.survived:
        return f"{name}: the top stayed up for all of {summary.duration:g} s"
    return f"{name}: the top {summary.ending}"


def _motion_facts(summary: Summary) -> list[tuple[str, str]]:
    motion = summary.motion
    facts = [("spin", summary.spin)]
    if motion.scene.observed == "spin":
        return facts
    facts.insert(0, ("height", summary.heights))
    if motion.scene.washers.inertia_kg_m2 > 0:
        first, last = (with_decimals(motion.washer_spin_hz[k], 3) for k in (0, -1))
        facts.append(("loose washers", f"{first} Hz at the start, {last} Hz at the end"))
    if (locked := is_locked(motion.scene, motion.states, survived=motion.survived)) is not None:
        facts.append(("drive", "holds the top, which is locked to it" if locked else "does not hold the top"))
    if len(motion.bursts):
        facts.append(("drive", f"in {np.unique(motion.bursts[:, 3]).size} bursts, which the tape set off"))
    facts.append(("tilt", f"up to {_angle(float(motion.tilt.max()))}"))
    return facts


def _angle(angle: float) -> str:
    """Return an angle, in mrad only if it is small."""
    degrees = f"{math.degrees(angle):.3g}°"
    return degrees if angle > 1 else f"{1000 * angle:.3g} mrad, {degrees}"


def _quality_facts(summary: Summary) -> list[tuple[str, str]]:
    accuracy = summary.motion.accuracy
    if accuracy.steps == 0:
        return [("computed", "in closed form, nothing was integrated")]
    verdict = "within" if accuracy.reached else "NOT within"
    facts = [
        (
            "error at the end",
            f"{accuracy.position:.1g} m of the place, {accuracy.axis:.1g} rad of the axis (estimated)",
        ),
        ("", f"{verdict} the tolerance of {accuracy.tolerance:g}"),
    ]
    if not changing_energy(summary.motion.scene):
        change = summary.energy_change
        facts.append(("energy", f"constant to {change:.1g} of itself" if change else "exactly constant"))
    steps = f"{accuracy.steps} steps of at most {1000 * accuracy.step:.3g} ms by {accuracy.scheme}"
    speed = f", {_format_speed(summary.speed)} times faster than the real top" if summary.end >= 1 else ""
    facts.append(("computed", steps + speed))  # of less than a second nothing but the overhead would be seen
    return facts


def _format_speed(speed: float) -> str:
    """Return a speed with two digits: more of a computer's speed is chance."""
    return f"{float(f'{speed:.2g}'):,.0f}".replace(",", " ") if speed >= 10 else f"{speed:.2g}"


def _lines_table(summary: Summary) -> Table:
    resolution = summary.lines.resolution
    digits = 2 if resolution > 0.05 else 3
    shown = new_table(
        "Lines of the axis, n_x + i n_y",
        "frequency \\[Hz]", "amplitude \\[mrad]", "identified as",
        numbers=("frequency \\[Hz]", "amplitude \\[mrad]"),
    )  # fmt: skip
    for line in summary.lines.lines:
        frequency = with_decimals(line.frequency, digits)
        shown.add_row(frequency, f"{1000 * line.amplitude:.3g}", line.name or "not identified")
    of = f", of the first {summary.lines.until:.3g} s" if summary.lines.until < 0.99 * summary.end else ""
    shown.caption = f"resolution {resolution:.2g} Hz{of}"
    shown.caption_justify = "left"
    return shown


def print_effects(effects: Sequence[Effect]) -> None:
    """Print one row an effect: in or out, and its influence."""
    changes = ("height \\[mm]", "precession \\[Hz]", "spin at the end \\[Hz]")
    table = new_table(
        "What is in this scene, and what is left out", "effect", "", *changes, "meaning; other influence",
        numbers=changes,
    )  # fmt: skip
    for effect in effects:
        words = f"{effect.what}; {effect.remark}" if effect.remark else effect.what
        table.add_row(
            effect.name,
            "in" if effect.included else "out",
            _format_change(effect.height_m, LEAST_M, 1e3),
            _format_change(effect.precession_hz, LEAST_HZ, 1),
            _format_change(effect.spin_hz, LEAST_HZ, 1),
            escape(words),
        )
    table.caption = (
        "changes that the effect makes when it is there and nothing else is different, computed for this scene;\n"
        "– where one of the two motions has no such number"
    )
    table.caption_justify = "left"
    terminal().print(table)


def _format_change(change: float, least: float, factor: float) -> str:
    """Return a change with two digits: the next effect changes the third."""
    if math.isnan(change):
        return "–"
    return with_minus(f"{factor * change:+.2g}") if change else f"< {factor * least:g}"
