"""Where a top floats → text on a terminal, and one JSON document."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from levilab.files import finite
from levilab.present.numbers import with_decimals
from levilab.present.tables import Table, table
from levilab.present.terminal import draw, terminal
from levilab.simulator.equilibrium import Stability, advice
from levilab.simulator.scene import Scene
from levilab.stability.thesis import HIGHEST_HZ, MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ, is_thesis_device
from levilab.texts.text import Text, in_language


def _range(which: int) -> dict[str, float]:
    """Return the range of the simulated lower (0) or upper (1) limits."""
    limits = [pair[which] for pair in SIMULATED_HZ.values()]
    return {"low": min(limits), "high": max(limits)}


#: The master's thesis on the Levitron: its simulated limits of four starts, and what it measured.
THESIS = {
    "lower": Text(
        "14.005 by its own estimate; {low:.2f} – {high:.2f} simulated; {measured:g} ± {u:g} measured",
        **_range(0), measured=MEASURED_HZ, u=MEASURED_U_HZ,
    ),
    "upper": Text("{low:.2f} – {high:.2f} simulated; about {hz:g} highest synchronised", **_range(1), hz=HIGHEST_HZ),
    "height": "7.3 measured",
    "mass": "25.5 printed, which its own field cannot lift",
}  # fmt: skip

#: What a scene may have and the theory has not: the test, and what to say.
LEFT_OUT: tuple[tuple[Callable[[Scene], bool], str], ...] = (
    (
        lambda s: s.drag.law != "none" and any(s.drag.constants),
        "the drag is left out here; it slows the spin, in the end below the slowest one, and the top is lost",
    ),
    (
        lambda s: s.drive.is_periodic and s.drive.amplitude_t > 0,
        "the drive is left out here; it tilts the top and may hold its spin",
    ),
    (
        lambda s: s.drive.waveform == "triggered" and s.drive.amplitude_t > 0,
        "the drive is left out here; it tilts the top, and takes it as fast as the drag allows, or brakes it",
    ),
    (
        lambda s: s.washers.inertia_kg_m2 > 0,
        "the loose washers are left out here: they turn with the top as if they were fixed",
    ),
)


def print_stability(found: Stability, console: Console | None = None) -> None:
    """Print the windows, the equilibria, the spins; beside the thesis's figures for the thesis's device."""
    out = console or terminal()
    title = Text("{name:s}: {headline}", name=found.scene.name or in_language("the scene"), headline=headline(found))
    out.print(f"[bold]{escape(in_language(title))}[/bold]")
    out.print(draw(_windows_table(found)))
    if found.equilibria:
        out.print(draw(_equilibria_table(found)))
    if found.floating:
        out.print(draw(_facts_table(found)))
    for remark in remarks(found):
        out.print(f"[yellow]{in_language('note:')}[/yellow] {escape(in_language(remark))}")


def headline(found: Stability) -> str:
    """Return one line: at which height the top floats, or what is missing."""
    if not found.floating:
        return advice(found)
    mass, height = 1000 * found.scene.top.mass_kg, 100 * found.floating.height
    return Text("a top of {mass:.2f} g floats at {height:.3f} cm", mass=mass, height=height)


def _windows_table(found: Stability) -> Table:
    rows = [
        (
            "upper" if number and number == len(found.windows) - 1 else "lower",
            Text("{low:.4f} – {high:.4f}", low=100 * window.low, high=100 * window.high),
            Text("{low:.3f} – {high:.3f}", low=1000 * window.light, high=1000 * window.heavy),
            "is lifted" if window in found.lifted else "is pulled down; one of the other sign is lifted",
        )
        for number, window in enumerate(found.windows)
    ]
    heads = ("zone", "heights [cm]", "masses [g]", "this moment")
    return table("Where tops float, if they spin", heads, rows)


def _equilibria_table(found: Stability) -> Table:
    rows = [
        (
            Text("{cm:.3f}", cm=100 * place.height),
            "stable" if place.axial > 0 else "falls or rises away",
            "stable" if place.radial > 0 else "slips away",
            _spins(place.spins) if place.axial > 0 else "none helps",
        )
        for place in found.equilibria
    ]
    heads = ("height [cm]", "up and down", "sideways", "spins [Hz]")
    return table("Where field and weight balance", heads, rows)


def _spins(windows: Sequence[tuple[float, float]]) -> str:
    texts = tuple(Text("{low:.2f} – {high:.2f}", low=low, high=high) for low, high in windows)
    return Text("{texts}", texts=texts) if texts else "none helps"


def _facts_table(found: Stability) -> Table:
    assert found.floating
    beside = is_thesis_device(found.scene)
    lower, upper = found.floating.spins[0] if found.floating.spins else (math.nan, math.nan)
    small, lacks = "{hz:.2f} for small motions", "{hz:.3f}, lacks the factor 2√(I₁/I₃)"
    modes = Text("{texts}", texts=tuple(map(_mode, found.modes)))
    rows = [
        ("height [cm]", Text("{cm:.3f}", cm=100 * found.floating.height), THESIS["height"]),
        ("mass [g]", Text("{g:.2f}", g=1000 * found.scene.top.mass_kg), THESIS["mass"]),
        ("slowest spin [Hz]", Text(small, hz=lower), THESIS["lower"]),
        ("fastest spin [Hz]", Text(small, hz=upper), THESIS["upper"]),
        ("sleeping top's limit [Hz]", Text("{hz:.2f}", hz=found.sleeping), ""),
        ("the thesis's estimate [Hz]", Text(lacks, hz=found.thesis_estimate), "14.005, lacks it, too"),
        (Text("modes at {hz:g} Hz [Hz]", hz=found.scene.start.spin_hz), modes, ""),
        ("up-and-down mode [Hz]", Text("{hz:.3f}", hz=found.vertical), ""),
    ]
    heads = ("", "here", "in the thesis")
    return table("The floating top", heads if beside else heads[:2], [row if beside else row[:2] for row in rows])


def _mode(mode: complex) -> str:
    said = "{hz:n} (grows)" if mode.imag < -1e-6 else "{hz:n} (decays)" if mode.imag > 1e-6 else "{hz:n}"
    return Text(said, hz=with_decimals(mode.real, 3))


def remarks(found: Stability) -> list[str]:
    """Return what to mind."""
    scene = found.scene
    said = [text for is_there, text in LEFT_OUT if is_there(scene)]
    if scene.base.tilt_rad:
        said.append("the base leans; this is of an upright one")
    if scene.top.moment_tilt[0]:
        said.append("the moment leans in the top; this is of its part along the axis")
    if found.floating and found.floating.spins:
        low, high = found.floating.spins[0]
        if not low < abs(scene.start.spin_hz) < high:
            text = "the scene's spin of {hz:g} Hz lies outside: the top is lost"
            said.append(Text(text, hz=scene.start.spin_hz))
    return said


def as_document(found: Stability) -> dict[str, Any]:
    """All of it with units in the names; what does not exist is None."""
    floating = found.floating
    return {
        "schema": "levilab-stability/1",
        "scene": found.scene.as_table(),
        "windows": [
            {"low_m": w.low, "high_m": w.high, "light_kg": w.light, "heavy_kg": w.heavy} for w in found.windows
        ],
        "equilibria": [
            {"height_m": e.height, "stable": e.stable, "spins_hz": [[finite(a), finite(b)] for a, b in e.spins]}
            for e in found.equilibria
        ],
        "floats": floating is not None,
        "height_m": floating.height if floating else None,
        "nearest_mass_kg": found.nearest,
        "modes_hz": [{"frequency": float(m.real), "growth_per_s": float(-2 * math.pi * m.imag)} for m in found.modes],
        "vertical_mode_hz": finite(found.vertical),
        "sleeping_limit_hz": finite(found.sleeping),
        "thesis_estimate_hz": finite(found.thesis_estimate),
        "remarks": remarks(found),
    }
