"""Why the thesis stopped at 61 Hz: the pull of its drive against drag and ramp, the swing, and loose washers.

The numbers that were computed apart are those of a top that only spins, so they are compared without the lean.  What is
said about the thesis is of a top that leans in step with its moment, as the simulated one does.
"""

import math
from functools import cache, partial

import numpy as np

from analysis.pull import Driven
from analysis.stability import wobble_resonance
from levilab.present.document.blocks import Note, Picture
from levilab.reproduce.check import Finding, Found, check, statement
from levilab.reproduce.figure import drive_figure
from levilab.reproduce.tops import THESIS, known
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.published.printed import several
from levilab.simulator.scene import preset
from levilab.stability.thesis import HIGHEST_HZ, ISLANDS_HZ, LOOSE_HZ

#: Amplitudes [T] and ramps [Hz/s] of the drive; the amplitude of the thesis's simulations.
FIELDS_T, RAMPS = (3e-4, 4e-4, 5e-4, 6e-4), (0.0, 0.05, 0.1)
FIELD_T = 4e-4
#: Swings of the spin about the drive where a ramp begins, at the spin of the thesis's driven run [Hz].
SWINGS_HZ = tuple(0.05 * k for k in range(9))
START_HZ = THESIS["driven.drive"].value

#: The disc's constant of each of the thesis's spin-downs.
_CONSTANTS = np.array([one.value for one in several("thesis", "spindown.c32")])
DRAG, DRAG_U = float(_CONSTANTS.mean()), float(_CONSTANTS.std(ddof=1))


def driven(field: float, ramp: float, *, leans: bool = True) -> Driven:
    """Return the thesis's top, its moment tilted as in its driven runs, under a drive of this amplitude [T]."""
    scene = preset("driven")
    across = scene.top.moment_tilt[0] * abs(scene.top.moment_a_m2)
    strongest = across * field / (2 * scene.top.inertia_axial_kg_m2)
    return Driven(strongest, DRAG, ramp, _resonance() if leans else None)


@cache
def _resonance() -> float:
    """Return the resonance of the wobble of the same top [Hz]."""
    found = stability_of(preset("driven"))
    return wobble_resonance(found.field, found.top, known(found.floating).height)


def field_for(spin: float, ramp: float) -> float:
    """Return the amplitude at which drag and ramp take all that the drive gives at a spin [Hz], in T."""
    one = driven(FIELD_T, ramp)
    return FIELD_T * one.load(spin) / one.pull(spin)


def crossings() -> list[Finding]:
    """Compare the crossings of the drive's pull and the load with those that were computed apart, without the lean."""
    pull = driven(FIELD_T, 0.0, leans=False)
    share = 2 / 3 * DRAG_U / DRAG  # ν goes with C^(−2/3); a top's constant is known as well as they scatter
    found = [
        check(
            "pull of the drive on the spin, 0.4 mT, without lean", THESIS["drive.pull"], pull.strongest / (2 * math.pi)
        )
    ]
    for key, field, ramp in (
        *((f"still_{1e4 * field:02.0f}", field, 0.0) for field in FIELDS_T),
        *((f"ramp_{1e3 * ramp:03.0f}", FIELD_T, ramp) for ramp in RAMPS if ramp),
    ):
        spin = driven(field, ramp, leans=False).highest()
        found.append(
            check(
                f"spin at which {f'drag and a ramp of {ramp:g} Hz/s take' if ramp else 'drag takes'} all of the pull "
                f"of {1e3 * field:.1f} mT, without lean",
                THESIS[f"drive.{key}"],
                spin,
                u=share * spin,
            )
        )
    return found


def about_61() -> list[Finding]:
    """State the consequences of 61 Hz and 66 Hz for the drive."""
    still, ramp = driven(FIELD_T, 0.0), driven(FIELD_T, 0.1)
    shares = [100 * one.load(HIGHEST_HZ) / one.pull(HIGHEST_HZ) for one in (still, driven(FIELD_T, 0.05), ramp)]
    swings = (0.2, 0.4)
    lost = [ramp.highest_with_swing(swing, START_HZ) for swing in swings]
    spins = [[driven(FIELD_T, one, leans=leans).highest() for one in RAMPS] for leans in (True, False)]
    fields, loose = ([1e3 * field_for(spin, one) for one in RAMPS] for spin in (HIGHEST_HZ, LOOSE_HZ))
    edge = known(stability_of(preset("undriven")).floating).spins[0][1]
    return [
        statement(
            "61 Hz, the highest synchronised spin, is no limit of the top",
            THESIS["measured.highest"].place,
            "there is no reason for this to occur at the upper frequency limit",
            f"the window of small motions ends at {edge:.1f} Hz. At 61 Hz drag takes {shares[0]:.0f} % of what a drive "
            f"of 0.4 mT gives, with a ramp of 0.05 or 0.1 Hz/s {shares[1]:.0f} or {shares[2]:.0f} %",
            holds=edge > HIGHEST_HZ + 15 and shares[0] < 70 and 80 < shares[2] < 90,
        ),
        statement(
            "a swing about the drive costs some of it",
            THESIS["measured.highest"].place,
            "",
            f"at 0.4 mT and 0.1 Hz/s a top is lost at {ramp.highest():.1f} Hz; one that swings about the drive by "
            f"{swings[0]:g} or {swings[1]:g} Hz at {START_HZ:g} Hz is lost at {lost[0]:.1f} or {lost[1]:.1f} Hz",
            holds=ramp.highest() > lost[0] > lost[1] > HIGHEST_HZ - 5,
        ),
        statement(
            "a top that leans in step with its moment is pulled more",
            THESIS["measured.highest"].place,
            "",
            f"the lean adds {100 * (still.pull(HIGHEST_HZ) / still.strongest - 1):.0f} % to the moment across the "
            "axis at 61 Hz: a top that does not swing reaches "
            + ", ".join(
                f"{spin:.1f} instead of {other:.1f} Hz ({one:g} Hz/s)"
                for spin, other, one in zip(*spins, RAMPS, strict=True)
            )
            + " at 0.4 mT. Locked tops in full motion have this pull within 0.02 % at 60, 66 and 72 Hz, and creeps end "
            "there (benchmarks/upper_limit.py)",
            holds=all(spin > other for spin, other in zip(*spins, strict=True)) and spins[0][-1] > HIGHEST_HZ,
        ),
        statement(
            "the field for which 61 Hz is the end, without a swing",
            THESIS["measured.highest"].place,
            "",
            ", ".join(f"{field:.2f} mT ({one:g} Hz/s)" for field, one in zip(fields, RAMPS, strict=True)),
            holds=all(0.2 < field < 0.5 for field in fields),
        ),
        statement(
            "66 Hz with loose washers",
            THESIS["measured.loose"].place,
            "",
            "washers that slip damp the swing about the drive. In full motion (0.4 mT, 0.1 Hz/s, 24.3 g) three starts "
            "end at 64.0, 66.9 and 69.1 Hz with fixed washers, all at 70.0 to 70.1 Hz with loose ones "
            "(benchmarks/upper_limit.py). Without a swing 66 Hz is the end for "
            + ", ".join(f"{field:.2f} mT ({one:g} Hz/s)" for field, one in zip(loose, RAMPS, strict=True)),
            holds=all(field > other for field, other in zip(loose, fields, strict=True)),
        ),
        statement(
            "a stronger drive would meet the islands and the edge",
            THESIS["measured.highest"].place,
            "",
            f"0.5 mT would reach {driven(5e-4, 0.0).highest():.0f} Hz, above the edge at {edge:.1f} Hz; from "
            f"{ISLANDS_HZ[0]:g} Hz on simulated tops without a drive are up or lost by their start",
            holds=driven(5e-4, 0.0).highest() > edge,
        ),
    ]


def make() -> Found:
    """Make the chapter."""
    picture = Picture(
        "drive",
        "The drive, not stability, ended the thesis's climb.",
        "Left: what drives of 0.3 to 0.6 mT can add to the spin in a second (falling lines), and what drag and a ramp "
        "take (rising lines; the bands are the scatter of the drag between runs); dots: where all is taken. Right: the "
        "spin at which a drive of 0.4 mT loses a top that swings about it where the ramp begins, without and with the "
        "lean of the top. Dotted: the thesis's 61 Hz, and 66 Hz with loose washers; shaded: beyond the window of small "
        "motions.",
        "Pull of the drive and drag over the spin; highest spin over the swing about the drive",
        partial(
            drive_figure, driven, fields=FIELDS_T, ramps=RAMPS, spread=DRAG_U / DRAG, swings=SWINGS_HZ, start=START_HZ
        ),
    )
    note = Note(
        "Not known: the field of the thesis's coil at the top (0.4 mT is that of its simulations), how its knob was "
        "turned, how the top swung, and which washers were loose. A field of 0.25 to 0.4 mT, a ramp up to 0.1 Hz/s "
        "and a swing up to 0.4 Hz give 61 Hz in many combinations: it was the drive, but which of them it was cannot "
        "be said. "
        "The drag is that of a laminar disc, measured below 40 Hz and continued."
    )
    said = (
        "The drive can add no more than μδB₀/(2I₃)/(1 − (ν_r/ν)²) to the spin, with the resonance ν_r of its wobble, "
        "and drag and the ramp take it. Where they take all, the top is left behind."
    )
    return Found((*crossings(), *about_61()), (picture, note), said)
