"""An owner who tunes washers as `levilab tune` says, day by day: the mass to set, and its change with the temperature.

The window of masses is the simulator's, at the temperature of the magnets; a hand that lets go floats a part of it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.tuning import LAPSE, Outcome
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.pipelines.tune.advice import advise
from levilab.pipelines.tune.owner import Owner, read_owner, washers_text, write_owner
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import Scene, preset

#: The owner's washers [kg].
WASHERS_KG = (6e-5,) * 6 + (2e-4,) * 4
#: Temperatures of the days [°C], and the most trials of one; that for which the mass to set is compared.
DAYS_C, MOST, COMPARED_C = (19.0, 23.0, 17.0), 6, 21.0
#: The magnets of the scene have the strengths that it says at this temperature [°C].
_REFERENCE_C = 20.0


@dataclass(frozen=True)
class World:
    """A base and a top that nature chose, and a hand.

    Attributes:
        scene: at the reference temperature.
        share: of the window that the hand floats.
        place: of this part within the window, 0: the lightest masses, 1: the heaviest.
    """

    scene: Scene
    share: float
    place: float

    def window(self, temperature: float) -> tuple[float, float]:
        """Return the lightest and the heaviest mass that the hand floats at a temperature [°C], in kg."""
        rise = {"temperature_rise_k": temperature - _REFERENCE_C}
        (window, *_) = stability_of(self.scene.changed(rise)).lifted
        width = window.heavy - window.light
        light = window.light + self.place * (1 - self.share) * width
        return light, light + self.share * width


def draw_world(by: np.random.Generator) -> World:
    """Draw a base, a top and a hand."""
    scene, draw = preset("undriven"), drawing("tune", by)
    base, top = draw("temperature coefficient"), draw("temperature coefficient")
    changes = {
        "base.strength_t_m": scene.base.strength_t_m * draw("strength"),
        "base.temperature_coefficient_per_k": base,
        "top.temperature_coefficient_per_k": top,
    }
    share = min(draw("share of the window"), 1.0)
    return World(scene.changed(changes), share, draw("place in the window"))


def keep_diary(world: World, by: np.random.Generator) -> Owner:
    """Let an owner follow the advice until the top floats, day after day; return what he keeps."""
    draw = drawing("tune", by)
    light, heavy = world.window(_REFERENCE_C)
    bare = (light + heavy) / 2 - draw("washers needed") * sum(WASHERS_KG)
    owner = Owner(round(bare, 5), WASHERS_KG)
    for shown in DAYS_C:
        light, heavy = world.window(shown + draw("thermometer"))
        for _ in range(MOST):
            washers = advise(owner, shown).best.washers_kg
            mass = (owner.top or 0.0) + sum(washers)
            lapse = Outcome.RISES if by.random() < 0.5 else Outcome.SINKS
            outcome = Outcome.RISES if mass < light else Outcome.SINKS if mass > heavy else Outcome.FLOATS
            outcome = lapse if by.random() < LAPSE else outcome
            owner = owner.with_trial(f"{washers_text(washers)}, {shown:g} C, {outcome.value}")
            if outcome is Outcome.FLOATS:
                break
    return owner


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one owner, whose file is read again as `levilab tune` reads it."""
    by = np.random.default_rng((seed, 26))
    world = draw_world(by)
    kept = folder / "tune.toml"
    write_owner(kept, keep_diary(world, by))
    found = advise(read_owner(kept), COMPARED_C).values
    middles = [sum(world.window(COMPARED_C + step)) / 2 for step in (-2.0, 0.0, 2.0)]
    if not found["mass_to_set"].u:
        raise TrialFailed("the mass to set has no u")
    return [
        pull_of("mass to set", found["mass_to_set"], middles[1]),
        pull_of("mass per kelvin", found["mass_per_kelvin"], (middles[2] - middles[0]) / 4),
    ]


SUBJECT = Subject("tune", "an owner who tunes washers by the advice: mass to set, and mass per kelvin", trial)
