"""Where a top floats → text on a terminal, and one JSON document."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rich.markup import escape

from levilab.files import finite
from levilab.present.numbers import with_decimals
from levilab.present.terminal import new_table, terminal
from levilab.simulator.equilibrium import advice
from levilab.stability.thesis import HIGHEST_HZ, MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ, is_thesis_device

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rich.console import Console

    from levilab.simulator.equilibrium import Stability
    from levilab.simulator.scene import Scene


def _range(which: int) -> str:
    """Return the range of the simulated lower (0) or upper (1) limits."""
    limits = [pair[which] for pair in SIMULATED_HZ.values()]
    return f"{min(limits):.2f} – {max(limits):.2f}"


#: The master's thesis on the Levitron: its simulated limits of four starts, and what it measured.
THESIS = {
    "lower": f"14.005 by its own estimate; {_range(0)} simulated; {MEASURED_HZ} ± {MEASURED_U_HZ} measured",
    "upper": f"{_range(1)} simulated; about {HIGHEST_HZ:g} highest synchronised",
    "height": "7.3 measured",
    "mass": "25.5 printed, which its own field cannot lift",
}

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
    out.print(f"[bold]{escape(found.scene.name or 'the scene')}: {escape(headline(found))}[/bold]")
    out.print(_windows_table(found))
    if found.equilibria:
        out.print(_equilibria_table(found))
    if found.floating:
        out.print(_facts_table(found))
    for remark in remarks(found):
        out.print(f"[yellow]note:[/yellow] {escape(remark)}")


def headline(found: Stability) -> str:
    """Return one line: at which height the top floats, or what is missing."""
    if not found.floating:
        return advice(found)
    return f"a top of {1000 * found.scene.top.mass_kg:.2f} g floats at {100 * found.floating.height:.3f} cm"


def _windows_table(found: Stability) -> Any:
    table = new_table("Where tops float, if they spin", "region", "heights \\[cm]", "masses \\[g]", "this moment")
    for number, window in enumerate(found.windows):
        name = "upper" if number and number == len(found.windows) - 1 else "lower"
        table.add_row(
            name,
            f"{100 * window.low:.4f} – {100 * window.high:.4f}",
            f"{1000 * window.light:.3f} – {1000 * window.heavy:.3f}",
            "is lifted" if window in found.lifted else "is pulled down; one of the other sign is lifted",
        )
    return table


def _equilibria_table(found: Stability) -> Any:
    table = new_table("Where field and weight balance", "height \\[cm]", "up and down", "sideways", "spins \\[Hz]")
    for place in found.equilibria:
        table.add_row(
            f"{100 * place.height:.3f}",
            "stable" if place.axial > 0 else "falls or rises away",
            "stable" if place.radial > 0 else "slips away",
            _spins(place.spins) if place.axial > 0 else "none helps",
        )
    return table


def _spins(windows: Sequence[tuple[float, float]]) -> str:
    return ", ".join(f"{low:.2f} – {high:.2f}" for low, high in windows) or "none helps"


def _facts_table(found: Stability) -> Any:
    assert found.floating
    beside = is_thesis_device(found.scene)
    table = new_table("The floating top", "", "here", *(["in the thesis"] if beside else []))
    lower, upper = found.floating.spins[0] if found.floating.spins else (math.nan, math.nan)
    rows = [
        ("height \\[cm]", f"{100 * found.floating.height:.3f}", THESIS["height"]),
        ("mass \\[g]", f"{1000 * found.scene.top.mass_kg:.2f}", THESIS["mass"]),
        ("slowest spin \\[Hz]", f"{lower:.2f} for small motions", THESIS["lower"]),
        ("fastest spin \\[Hz]", f"{upper:.2f} for small motions", THESIS["upper"]),
        ("sleeping top's limit \\[Hz]", f"{found.sleeping:.2f}", ""),
        (
            "the thesis's estimate \\[Hz]",
            f"{found.thesis_estimate:.3f}, lacks the factor 2√(I₁/I₃)",
            "14.005, lacks it, too",
        ),
        (f"modes at {found.scene.start.spin_hz:g} Hz \\[Hz]", _modes(found), ""),
        ("up-and-down mode \\[Hz]", f"{found.vertical:.3f}", ""),
    ]
    for what, here, there in rows:
        table.add_row(what, here, *([there] if beside else []))
    return table


def _modes(found: Stability) -> str:
    grows = [f" ({'grows' if mode.imag < 0 else 'decays'})" if abs(mode.imag) > 1e-6 else "" for mode in found.modes]
    return ", ".join(f"{with_decimals(mode.real, 3)}{word}" for mode, word in zip(found.modes, grows, strict=True))


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
            said.append(f"the scene's spin of {scene.start.spin_hz:g} Hz lies outside: the top is lost")
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
