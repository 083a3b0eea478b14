"""What a seed makes of the bench for practice: a top and a base of one's own, and the noise of the light."""

from typing import Any

import numpy as np

from levilab.simulator.scene import Scene

#: The published drag constants scatter by this from top to top, as on the bench of `levilab acquire --mock`.
_DRAG_SCATTER = 0.02
#: A base is stronger or weaker by this, at most three times.  The moment of its top makes up for it, since what lifts
#: is their product: all float, though the masses that do lie within 3 %.
_BASE_SCATTER, _MOST = 0.01, 3.0


def keys_of_seed(scene: Scene, seed: int) -> dict[str, Any]:
    """Return the keys of a scene that a seed changes, with their values; seed 0 leaves it as it is."""
    if not seed:
        drag = base = 1.0
    else:
        scatter = np.random.default_rng(seed).standard_normal(2)
        drag = 1 + _DRAG_SCATTER * float(scatter[0])
        base = 1 + _BASE_SCATTER * float(np.clip(scatter[1], -_MOST, _MOST))
    constants = scene.drag.constants  # none of a scene without drag
    return ({"drag.coefficient": constants[0] * drag} if constants else {}) | {
        "base.strength_t_m": scene.base.strength_t_m * base,
        "top.moment_a_m2": scene.top.moment_a_m2 / base,
    }
