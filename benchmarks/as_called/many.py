"""A thousand undriven tops of different spins and masses, as one call and in heyoka's batch mode.

All of them stay up for the 5 s.  The error of the ensemble is the largest of COMPARED tops, spread all over it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from as_called.contenders import Contender, scene_of
from as_called.motions import UNDRIVEN, Motion, vector_start
from levilab.benchmark.simulator.motion import MU, Array, references
from levilab.benchmark.simulator.taylor import heyoka_batch
from levilab.simulator.ensemble import simulate_many

if TYPE_CHECKING:
    from collections.abc import Sequence

    from as_called.contenders import Call
    from levilab.simulator.ensemble import Ensemble

DURATION = 5.0
SPINS_HZ, MASSES_KG = np.linspace(26.0, 36.0, 40), np.linspace(0.0252, 0.0253, 25)
SIZE = SPINS_HZ.size * MASSES_KG.size
#: Indices of the tops that have a reference.
COMPARED = np.linspace(0, SIZE - 1, 20).round().astype(int)


def tops() -> tuple[Motion, ...]:
    """All of them, the mass varying fastest: neighbours of one spin share heyoka's batches, whose steps are alike."""
    return tuple(
        replace(UNDRIVEN, spin=2 * np.pi * spin, mass=mass) for spin in SPINS_HZ.tolist() for mass in MASSES_KG.tolist()
    )


def reference() -> Array:
    """Return the true places of COMPARED at the end, shape (20, 3) [m]."""
    return np.array(references()["ensemble_m"])


def simulate_them(duration: float, tolerance: float) -> Ensemble:
    """Simulate all of them with one call, on one core."""
    over = {"start.spin_hz": SPINS_HZ[:, None], "top.mass_kg": MASSES_KG[None, :]}
    return simulate_many(scene_of(UNDRIVEN), over, duration, tolerance=tolerance, cores=1)


def _simulate_many(_tops: Sequence[Motion], tolerance: float) -> Call:
    return lambda duration: simulate_them(duration, tolerance).position.reshape(-1, 3)[COMPARED]


def _heyoka_batch(lanes: int, tops: Sequence[Motion], tolerance: float) -> Call:
    starts = np.array([vector_start(top) for top in tops]).T.copy()
    pulls = np.array([MU / top.mass for top in tops])
    integrator = heyoka_batch(tolerance, lanes)
    state, parameters, zeros = integrator.state, integrator.pars, np.zeros(lanes)

    def call(duration: float) -> Array:
        places, end = np.empty((len(tops), 3)), np.full(lanes, duration)
        for i in range(0, len(tops), lanes):
            integrator.set_time(zeros)
            state[:], parameters[0] = starts[:, i : i + lanes], pulls[i : i + lanes]
            integrator.propagate_until(end)
            places[i : i + lanes] = state[:3].T
        found: Array = places[COMPARED]
        return found

    return call


_TOLERANCES = (1e-4, 1e-5, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8)
CONTENDERS = (
    Contender("simulate_many", "levilab", (1e-7, 1e-8, 1e-9, 1e-10, 3e-11, 1e-11, 3e-12), _simulate_many),
    Contender("heyoka batch", "heyoka", _TOLERANCES, partial(_heyoka_batch, 4), ", 4 lanes"),
    Contender("heyoka batch", "heyoka", _TOLERANCES, partial(_heyoka_batch, 8), ", 8 lanes"),
)
