"""Where a top floats, as scripts and notebooks use it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from levilab.notebook.names import Helpful, bare
from levilab.present.html import facts_as_html, paragraphs
from levilab.present.terminal import as_text
from levilab.simulator.equilibrium import Stability, stability_of
from levilab.stability.table import as_document, headline, print_stability, remarks

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from levilab.notebook.figure import Axes
    from levilab.present.style import Figure
    from levilab.simulator.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class FloatingTop(Helpful):
    """Where the top of a scene floats.

    Attributes:
        found: heights, masses and spins, as the theory gives them.
    """

    found: Stability

    also: ClassVar[Mapping[str, str]] = {"df": "to_dataframe()", "z": "height", "stable": "floats", "spin": "spins"}

    @property
    def _contents(self) -> Mapping[str, Any]:
        return self.values

    def to_dataframe(self) -> pd.DataFrame:
        """Return where field and weight balance, a row for each window of the spin; NaN: no spin holds it."""
        import pandas as pd

        columns = ["height_m", "stable", "spin_from_hz", "spin_to_hz"]
        rows = [
            (one["height_m"], one["stable"], *window)
            for one in self.values["equilibria"]
            for window in one["spins_hz"] or [(math.nan, math.nan)]
        ]
        return pd.DataFrame(rows, columns=columns)

    @property
    def floats(self) -> bool:
        """Whether it floats at all."""
        return self.found.floating is not None

    @property
    def height(self) -> float | None:
        """Height at which it floats [m]; None where it does not."""
        return self.found.floating.height if self.found.floating else None

    @property
    def spins(self) -> tuple[tuple[float, float], ...]:
        """Windows of the spin in which it floats there [Hz]."""
        return tuple(self.found.floating.spins) if self.found.floating else ()

    @property
    def values(self) -> dict[str, Any]:
        """All of it by names with units, as `levilab stability` gives it as JSON."""
        return as_document(self.found)

    @bare
    def plot(
        self, *, ax: Axes | None = None, title: str | None = None, figsize: tuple[float, float] | None = None
    ) -> Figure | Axes:
        """Draw the spins that hold the top, at each height where field and weight balance.

        Args:
            ax: axes into which they are drawn, and which are returned.
            title: of the panel.
            figsize: width and height [inch].
        """
        from levilab.notebook.figure import draw_windows, drawn  # with matplotlib

        frame = self.to_dataframe()
        title = title or headline(self.found)
        return drawn(lambda axes: draw_windows(axes, frame), ax, title=title, figsize=figsize)

    def __repr__(self) -> str:
        return f"<FloatingTop: {headline(self.found)}>"

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        spins = ", ".join(f"{low:.2f} to {high:.2f} Hz" for low, high in self.spins)
        masses = ", ".join(f"{1e3 * one.light:.3f} to {1e3 * one.heavy:.3f} g" for one in self.found.lifted)
        facts = [("spins", spins), ("masses that float", masses)]
        return facts_as_html(headline(self.found), facts, paragraphs(remarks(self.found)))

    def summary(self) -> str:
        """Return the text that `levilab stability` prints."""
        return as_text(lambda console: print_stability(self.found, console))


def floating_top(scene: Scene) -> FloatingTop:
    """Return where the top of a scene floats."""
    return FloatingTop(stability_of(scene))
