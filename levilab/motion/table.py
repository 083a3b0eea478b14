"""A simulated motion → text on a terminal."""

import math
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.markup import escape

from analysis.numbers import with_minus
from levilab.motion.effects import LEAST_HZ, LEAST_M, Effect
from levilab.motion.lock import is_locked
from levilab.motion.summary import Summary, changing_energy, start_and_end
from levilab.present.numbers import with_decimals
from levilab.present.tables import Table, table
from levilab.present.terminal import draw, terminal
from levilab.texts.text import Sentences, Text, in_language

#: Lines of the axis that the terminal shows; the report and the JSON have all.
MOST_LINES = 8


def print_motion(summary: Summary, console: Console | None = None) -> None:
    """Print the end of the motion, its numbers, the lines of the axis, the errors, and the warnings.

    Args:
        summary: of the motion.
        console: where it is printed, by default the terminal.
    """
    out = console or terminal()
    out.print(f"[bold]{escape(in_language(headline(summary)))}[/bold]")
    out.print(draw(table("", ("", ""), (*_motion_facts(summary), *_quality_facts(summary)))))
    if count := len(summary.lines.lines):
        out.print(draw(_lines_table(summary)))
        resolution, until = summary.lines.resolution, summary.lines.until
        of = Text(", of the first {s:.3g} s", s=until) if until < 0.99 * summary.end else ""
        several = Text("; {shown} of {all} lines, the strongest", shown=MOST_LINES, all=count)
        more = several if count > MOST_LINES else ""
        out.print(in_language(Text("resolution {hz:.2g} Hz{of}{more}", hz=resolution, of=of, more=more)))
    for note in summary.notes:
        out.print(f"[yellow]{in_language('note:')}[/yellow] {escape(in_language(note))}")


def headline(summary: Summary) -> str:
    """Return one line about the end of a motion."""
    name = summary.motion.scene.name or in_language("the scene")
    if summary.motion.scene.observed == "spin":
        return Text("{name:s}: the spin alone, for {s:g} s", name=name, s=summary.duration)
    if summary.motion.survived:
        return Text("{name:s}: the top stayed up for all of {s:g} s", name=name, s=summary.duration)
    return Text("{name:s}: the top {ending}", name=name, ending=summary.ending)


def _motion_facts(summary: Summary) -> list[tuple[str, str]]:
    motion = summary.motion
    facts = [("spin", summary.spin)]
    if motion.scene.observed == "spin":
        return facts
    facts.insert(0, ("height", summary.heights))
    if motion.scene.washers.inertia_kg_m2 > 0:
        facts.append(("loose washers", start_and_end(*(float(motion.washer_spin_hz[k]) for k in (0, -1)))))
    if (locked := is_locked(motion.scene, motion.states, survived=motion.survived)) is not None:
        facts.append(("drive", "holds the top, which is locked to it" if locked else "does not hold the top"))
    if len(motion.bursts):
        bursts = Text("in {n} bursts, which the tape set off", n=np.unique(motion.bursts[:, 3]).size)
        facts.append(("drive", bursts))
    tilt = float(motion.tilt.max())  # in mrad only if it is small
    said = "up to {degrees:.3g}°" if tilt > 1 else "up to {mrad:.3g} mrad, {degrees:.3g}°"
    facts.append(("tilt", Text(said, mrad=1000 * tilt, degrees=math.degrees(tilt))))
    return facts


def _quality_facts(summary: Summary) -> list[tuple[str, str]]:
    accuracy = summary.motion.accuracy
    if accuracy.steps == 0:
        return [("computed", "in closed form, nothing was integrated")]
    error = "{place:.1g} m of the place, {axis:.1g} rad of the axis (estimated)"
    verdict = "within the tolerance of {x:g}" if accuracy.reached else "NOT within the tolerance of {x:g}"
    facts: list[tuple[str, str]] = [
        ("error at the end", Text(error, place=accuracy.position, axis=accuracy.axis)),
        ("", Text(verdict, x=accuracy.tolerance)),
    ]
    if not changing_energy(summary.motion.scene):
        change = summary.energy_change
        facts.append(("energy", Text("constant to {x:.1g} of itself", x=change) if change else "exactly constant"))
    said = "{steps} steps of at most {ms:.3g} ms by {scheme:s}"
    steps = Text(said, steps=accuracy.steps, ms=1000 * accuracy.step, scheme=accuracy.scheme)
    speed = Text(", {x:n} times faster than the real top", x=_format_speed(summary.speed)) if summary.end >= 1 else ""
    # of less than a second nothing but the overhead would be seen
    facts.append(("computed", Sentences(steps, speed, between="")))
    return facts


def _format_speed(speed: float) -> str:
    """Return a speed with two digits: more of a computer's speed is chance."""
    return f"{float(f'{speed:.2g}'):,.0f}".replace(",", " ") if speed >= 10 else f"{speed:.2g}"


def _lines_table(summary: Summary) -> Table:
    digits = 2 if summary.lines.resolution > 0.05 else 3
    heads = ("frequency [Hz]", "amplitude [mrad]", "identified as")
    rows = [
        (with_decimals(line.frequency, digits), f"{1000 * line.amplitude:.3g}", line.name or "not identified")
        for line in summary.lines.lines[:MOST_LINES]
    ]
    return table("Lines of the axis, n_x + i n_y", heads, rows, numbers=heads[:2])


def print_effects(effects: Sequence[Effect]) -> None:
    """Print one row an effect: in or out, and its influence."""
    changes = ("height [mm]", "precession [Hz]", "spin at the end [Hz]")
    rows = [
        (
            effect.name,
            "in" if effect.included else "out",
            _format_change(effect.height_m, LEAST_M, 1e3),
            _format_change(effect.precession_hz, LEAST_HZ, 1),
            _format_change(effect.spin_hz, LEAST_HZ, 1),
            Sentences(effect.what, effect.remark, between="; "),
        )
        for effect in effects
    ]
    heads = ("effect", "", *changes, "meaning; other influence")
    out = terminal()
    out.print(draw(table("What is in this scene, and what is left out", heads, rows, numbers=changes)))
    out.print(in_language("changes that the effect makes when it is there and nothing else is different, computed for "
                          "this scene; – where one of the two motions has no such number"))  # fmt: skip


def _format_change(change: float, least: float, factor: float) -> str:
    """Return a change with two digits: the next effect changes the third."""
    if math.isnan(change):
        return "–"
    return with_minus(f"{factor * change:+.2g}") if change else f"< {factor * least:g}"
