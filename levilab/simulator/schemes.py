"""Symmetric compositions of the two exact flows, as a table of coefficients.

A step is drift a₀, kick b₀, drift a₁, kick b₁, … drift aₙ, each a fraction of the step.  `any_split` says whether
the order holds for every pair of flows, or only where the kick depends on place and time alone
(Runge–Kutta–Nyström): drag that depends on the momentary spin needs the former.

Sources: Strang, SIAM J. Numer. Anal. 5, 506 (1968); Blanes & Moan, J. Comput. Appl. Math. 142, 313 (2002),
tables 2 and 3; Suzuki, Phys. Lett. A 146, 319 (1990); Kahan & Li, Math. Comput. 66, 1089 (1997).  `levitron-6` is
ours: of the compositions of order 6 with ten kicks the one that benchmarks/compositions.py found to have the
smallest error on the Levitron's motion.  The tests fit every order on every kind of scene, and check its conditions.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scheme:
    """The coefficients of a composition.

    Attributes:
        drifts: a, shape (stages + 1,).
        kicks: b, shape (stages,).
        order: of the error of the whole motion.
    """

    name: str
    order: int
    drifts: tuple[float, ...]
    kicks: tuple[float, ...]
    any_split: bool

    @property
    def stages(self) -> int:
        """Evaluations of the field in a step."""
        return len(self.kicks)


def _nystrom(name: str, order: int, drifts: list[float], kicks: list[float]) -> Scheme:
    """Return a scheme from the first half of each: the rest follows from symmetry and from both sums being 1."""
    a = [*drifts, 1 - 2 * sum(drifts)] if len(drifts) == len(kicks) + 1 else [*drifts, 0.5 - sum(drifts)]
    b = [*kicks, 0.5 - sum(kicks)] if len(drifts) == len(kicks) + 1 else [*kicks, 1 - 2 * sum(kicks)]
    even = len(drifts) == len(kicks) + 1
    return Scheme(
        name,
        order,
        drifts=tuple(a + (a[:-1] if even else a)[::-1]),
        kicks=tuple(b + (b if even else b[:-1])[::-1]),
        any_split=False,
    )


def _compose(name: str, order: int, weights: list[float]) -> Scheme:
    """Strang steps of the given lengths one after the other; the middle one makes the sum 1."""
    middle = 1.0 - 2 * sum(weights)  # no whole number: kernels would be compiled again for those
    b = np.array([*weights, middle, *weights[::-1]])
    a = np.concatenate([b[:1], b[1:] + b[:-1], b[-1:]]) / 2
    return Scheme(name, order, tuple(a.tolist()), tuple(b.tolist()), any_split=True)


_SUZUKI = 1 / (4 - 4 ** (1 / 3))

SCHEMES: dict[str, Scheme] = {
    scheme.name: scheme
    for scheme in (
        _compose("strang", 2, []),
        _compose("suzuki-4", 4, [_SUZUKI, _SUZUKI]),
        _compose(
            "kahan-li-6",
            6,
            [0.39216144400731413928, 0.33259913678935943860, -0.70624617255763935981, 0.082213596293550800230],
        ),
        _compose(
            "kahan-li-8",
            8,
            [
                0.74167036435061295344822780,
                -0.40910082580003159399730010,
                0.19075471029623837995387626,
                -0.57386247111608226665638773,
                0.29906418130365592384446354,
                0.33462491824529818378495798,
                0.31529309239676659663205666,
                -0.79688793935291635401978884,
            ],
        ),
        # the published form begins with a kick: a drift of length zero stands before it
        _nystrom(
            "blanes-moan-4",
            4,
            [0.0, 0.245298957184271, 0.604872665711080],
            [0.0829844064174052, 0.396309801498368, -0.0390563049223486],
        ),
        _nystrom(
            "blanes-moan-6",
            6,
            [
                0.0378593198406116,
                0.102635633102435,
                -0.0258678882665587,
                0.314241403071447,
                -0.130144459517415,
                0.106417700369543,
                -0.00879424312851058,
            ],
            [
                0.09171915262446165,
                0.183983170005006,
                -0.05653436583288827,
                0.004914688774712854,
                0.143761127168358,
                0.328567693746804,
            ],
        ),
        _nystrom(
            "levitron-6",
            6,
            [
                0.07152195309528236,
                0.31069377277893123,
                -0.14608159564955728,
                -0.0032550825712606307,
                0.17121927473971485,
            ],
            [0.16874533247567772, 0.00863837479960354, 0.755345858777474, -0.6120833901785284],
        ),
    )
}
