"""The laws of drag, a row each, for scenes: nothing heavy is imported here.

`spin` has their closed forms, `kernels.braking` what the kernels compute.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class DragLaw:
    """A law of drag.

    Attributes:
        usual: constants where a scene gives none, from the thesis's four spin-downs (40 Hz to the fall near 22 Hz).
        names: of the constants, as in result.json.
        exponent: n of ω̇ ∝ −ωⁿ; None of a sum of powers.
    """

    usual: tuple[float, ...]
    names: tuple[str, ...]
    exponent: float | None

    def is_linear(self, constants: tuple[float, ...]) -> bool:
        """Return whether the drag is in proportion to the spin: any other has |ω| in it, and a kink at ω = 0."""
        return self.exponent == 1 or constants[-1] == 0


#: Stokes −C₁ω, Newton −C₂ω², laminar disc −Cω^(3/2), mixed −C₁ω − C₂ω² (one of them may be 0).  The usual constants are
#: the means of the thesis's C₁ [1/s] and C₂ [1/rad], and of the disc law's constant refitted to each run
#: [(rad/s)^-1/2/s].  The thesis has no fit of C₁ and C₂ together: mixed is half of either mean, and thereby, each to
#: 1.4 %, the tangent to the disc law at 30 Hz, √ω ≈ √ω₀/2 + ω/(2√ω₀).
LAWS: dict[str, DragLaw] = {
    "stokes": DragLaw((0.00318175,), ("c1",), 1.0),
    "newton": DragLaw((1.7270e-5,), ("c2",), 2.0),
    "disc": DragLaw((2.340e-4,), ("c32",), 1.5),
    "mixed": DragLaw((0.5 * 0.00318175, 0.5 * 1.7270e-5), ("c1", "c2"), None),
}
