"""Where a top floats, as `levilab stability` printed it as JSON → a section of a report."""

import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from levilab.errors import DataError, LevilabError
from levilab.files import parse_json
from levilab.present.document.blocks import Banner, Block, Code, Fact, Facts, Section, Tabular, Verdict, Warnings
from levilab.present.numbers import plain
from levilab.present.tables import table
from levilab.simulator.scene import Scene, changes, scene_of
from levilab.texts.text import Sentences, Text

#: An option of a command that a reader types.
_OPTION = "--{}"


def stability_section(path: Path) -> Section:
    """Return the section of such a file.  Raises DataError for one that is damaged."""
    try:
        found = parse_json(path.read_text(encoding="utf-8"))
        scene = scene_of(found["scene"])
        blocks = tuple(_blocks(found, scene))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, LevilabError) as error:
        raise DataError(f"{path}: is no whole result of levilab stability ({error}); print it again") from error
    title = Text("Where the top floats: {name:s}", name=scene.name or "—")
    return Section(title, blocks, "stability", path.name, new_page=True)


def _blocks(found: Mapping[str, Any], scene: Scene) -> Iterator[Block]:
    yield Banner("SYNTHETIC.", "This follows from a model: nothing of it was measured.")
    mass = plain(1e3 * scene.top.mass_kg, 4)
    if found["floats"]:
        height = plain(100 * found["height_m"], 4)
        yield Verdict(Text("A top of {g:n} g floats at {cm:n} cm.", g=mass, cm=height))
    else:
        near = found.get("nearest_mass_kg")
        more = "" if near is None else Text("The nearest mass that does is {g:n} g.", g=plain(1e3 * near, 5))
        yield Verdict(Sentences(Text("A top of {g:n} g does not float.", g=mass), more))
    if found["remarks"]:
        yield Warnings(tuple((str(text),) for text in found["remarks"]))
    heads = ("heights [cm]", "masses [g]")
    rows = [
        (_range(window, "low_m", "high_m", 1e2), _range(window, "light_kg", "heavy_kg", 1e3))
        for window in found["windows"]
    ]
    yield Tabular("stability-windows", table("Where tops float, if they spin", heads, rows))
    places = ["height [cm]", "", "spins [Hz]"]
    equilibria = [
        (
            plain(100 * place["height_m"], 5),
            "stable" if place["stable"] else "not stable",
            "; ".join(f"{_number(low)} – {_number(high)}" for low, high in place["spins_hz"]) or "none helps",
        )
        for place in found["equilibria"]
    ]
    yield Tabular("stability-equilibria", table("Where field and weight balance", places, equilibria))
    yield Facts(tuple(_facts(found, scene)))
    if (changed := changes(scene)) is not None:
        settings = [word for key, value in changed.items() for word in (_OPTION.format("set"), f"{key}={value}")]
        yield Code(shlex.join(["levilab", "stability", scene.name, *settings, _OPTION.format("json")]))


def _facts(found: Mapping[str, Any], scene: Scene) -> Iterator[Fact]:
    modes = tuple(
        Text("{hz:n} Hz (grows)" if mode["growth_per_s"] > 1e-6 else "{hz:n} Hz", hz=plain(mode["frequency"], 4))
        for mode in found["modes_hz"]
    )
    if modes:
        yield Fact(Text("Modes at {hz:g} Hz", hz=scene.start.spin_hz), modes)
    for name, key in (("Up and down", "vertical_mode_hz"), ("Sleeping top's limit", "sleeping_limit_hz")):
        if found[key] is not None:
            yield Fact(name, (Text("{hz:n} Hz", hz=plain(found[key], 4)),))


def _range(window: Mapping[str, Any], low: str, high: str, factor: float) -> str:
    return f"{plain(factor * window[low], 5)} – {plain(factor * window[high], 5)}"


def _number(value: float | None) -> str:
    return "—" if value is None else plain(value, 4)
