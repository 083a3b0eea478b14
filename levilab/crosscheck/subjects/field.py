"""The Hall scan of a base that is drawn: its strength and place, and what follows for the tops above it."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analysis.uncertainty import Estimate
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import PRIORS, drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.formats.device import Device
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import FieldOptions
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import Scene
from levilab.world.base import random_base

#: The true moment [A m²].
MOMENT = 0.714
#: How well it is stated, relative; how well a mass [kg] and a height [m] are measured.
MOMENT_U, MASS_U, HEIGHT_U = (
    PRIORS["field"][name].b for name in ("moment as stated", "mass as weighed", "height as measured")
)


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one scan: the seed draws the base, the errors of the heights, and the stated masses of the top.

    The truths of heights, masses, and spins are the simulator's, whose field is another formula.
    """
    run = acquire_mock("field", seed, folder)
    base, draw = random_base(seed), drawing("field", np.random.default_rng((seed, 4)))
    scene = Scene().changed(
        {
            "base.field": "exact",
            "base.inner_radius_m": base.inner_radius_m,
            "base.outer_radius_m": base.outer_radius_m,
            "base.strength_t_m": base.strength_t_m,
            "base.thickness_m": base.thickness_m,
            "base.origin_m": base.origin_m,
        }
    )
    window = stability_of(scene).lifted[-1]
    mass = (window.light + window.heavy) / 2
    floating = stability_of(scene.changed({"top.mass_kg": mass})).floating
    if floating is None:
        raise TrialFailed("no top floats above the base that was drawn")
    stated = {"moment_a_m2": MOMENT * draw("moment as stated"), "moment_u_a_m2": MOMENT * MOMENT_U}
    weighed = {"mass_kg": mass + draw("mass as weighed"), "mass_u_kg": MASS_U}
    found = _values(run.folder, _options(stated))
    height = floating.height + draw("height as measured")
    by_height = _values(run.folder, _options(weighed, height_m=height, height_u_m=HEIGHT_U))
    return [
        pull_of("strength", found["strength"], base.strength_t_m),
        pull_of("origin", found["origin"], base.origin_m),
        pull_of("background", found["background"], base.background_t),
        pull_of("lowest height", found["lowest_height"], window.low),
        pull_of("mass to set", found["mass_to_set"], mass),
        pull_of("fastest spin", found["fastest_spin"], floating.spins[0][1]),
        pull_of("moment", by_height["moment"], MOMENT),
        pull_of("mass by height", by_height["mass_to_set"], mass),
    ]


def _options(top: dict[str, float], **where: float) -> FieldOptions:
    inertias = {"inertia_transverse_kg_m2": 1.04e-6, "inertia_axial_kg_m2": 1.731314e-6}
    return FieldOptions(device=Device.model_validate({"top": top | inertias}), **where)  # type: ignore[arg-type]


def _values(folder: Path, options: FieldOptions) -> Mapping[str, Estimate]:
    """Return what the analysis finds in a run."""
    values: Mapping[str, Estimate] = ANALYSES["field"].analyze([folder], options).values
    return values


SUBJECT = Subject("field", "the Hall scan of a base: strength, place, and the tops that float there", trial)
