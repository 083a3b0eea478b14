"""Where a top floats, as scripts and notebooks use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.present.html import facts_as_html, paragraphs
from levilab.simulator.equilibrium import stability_of
from levilab.stability.table import as_document, headline, print_stability, remarks

if TYPE_CHECKING:
    from levilab.simulator.equilibrium import Stability
    from levilab.simulator.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class FloatingTop:
    """Where the top of a scene floats.

    Attributes:
        found: heights, masses and spins, as the theory gives them.
    """

    found: Stability

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
        from levilab.present.terminal import as_text  # with rich

        return as_text(lambda console: print_stability(self.found, console))


def floating_top(scene: Scene) -> FloatingTop:
    """Return where the top of a scene floats."""
    return FloatingTop(stability_of(scene))
