"""Maps of survival over spin and mass, with the edges that the linear theory gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.floating import axial_field, lifting, stability_of, survival, symmetric

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]

TABLE, PICTURE = "survival.csv", "survival.png"


@dataclass(frozen=True)
class Map:
    """survived: shape (masses, spins); slowest, fastest: the linear window [Hz] of each mass, NaN where none floats."""

    scene: Scene
    spins: Array
    masses: Array
    duration: float
    survived: NDArray[np.bool_]
    slowest: Array
    fastest: Array

    @property
    def spin_step(self) -> float:
        """The scan's step [Hz]: a limit is known no better."""
        return float(self.spins[1] - self.spins[0])


def survival_map(
    scene: Scene,
    spins: tuple[float, float, int] = (18.0, 90.0, 145),
    masses: tuple[float, float, int] | None = None,
    duration: float = 30.0,
    progress: Callable[[float], None] | None = None,
) -> Map:
    """Whether the scene's top survives, over spins [Hz] and masses [kg], each (first, last, how many).

    masses: from a little below to a little above the window that floats where none are given.
    """
    if masses is None:
        found = stability_of(scene)
        windows = lifting(found.windows, symmetric(scene), axial_field(scene))
        windows.sort(key=lambda w: abs((w.light + w.heavy) / 2 - scene.top.mass_kg))
        light, heavy = (windows[0].light, windows[0].heavy) if windows else (scene.top.mass_kg * 0.95,) * 2
        margin = 0.2 * (heavy - light) + 1e-5
        masses = (light - margin, heavy + margin, 61)
    over_spins, over_masses = np.linspace(*spins), np.linspace(*masses)
    edges = [_window(scene.changed({"top.mass_kg": float(mass)})) for mass in over_masses]
    return Map(
        scene,
        over_spins,
        over_masses,
        duration,
        survival(scene, over_spins, over_masses, duration, progress),
        np.array([low for low, _ in edges]),
        np.array([high for _, high in edges]),
    )


def _window(scene: Scene) -> tuple[float, float]:
    floating = stability_of(scene).floating
    return floating.spins[0] if floating and floating.spins else (np.nan, np.nan)


def place_for_map(folder: Path) -> None:
    """Make the folder, before anything is simulated; a map that is there stays.  Raises CannotWrite."""
    from levilab.writing import CannotWrite

    for path in (folder / TABLE, folder / PICTURE):
        if path.exists():
            raise CannotWrite(f"{path} is there already: give another folder with --out, or move it away")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TABLE).touch()
        (folder / TABLE).unlink()
    except OSError as error:
        raise _cannot(folder, error) from None


def write_map(found: Map, folder: Path) -> list[Path]:
    """survival.png and survival.csv (one row a top; 1: survived) into a folder."""
    from levilab.figures import save_png
    from levilab.stability_figure import map_figure
    from levilab.writing import replace_atomically

    rows = ["mass_kg,spin_hz,survived"]
    for mass, alive in zip(found.masses, found.survived, strict=True):
        rows += [f"{mass:.8g},{spin:.6g},{one:d}" for spin, one in zip(found.spins, alive, strict=True)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_atomically(folder / TABLE, "\n".join(rows) + "\n")
        save_png(map_figure(found), folder / PICTURE)
    except OSError as error:
        raise _cannot(folder, error) from None
    return [folder / TABLE, folder / PICTURE]


def _cannot(folder: Path, error: OSError) -> Exception:
    from levilab.writing import CannotWrite

    return CannotWrite(f"{folder}: the map cannot be written: {error.strerror}; give another folder with --out")
