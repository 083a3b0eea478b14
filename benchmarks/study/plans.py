"""The sweeps of the study, each as the command that makes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from levilab.simulator.scene import preset, with_settings
from levilab.stability.thesis import STARTS
from levilab.sweeps.axes import parse_axis
from levilab.sweeps.plan import Plan

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene

#: What `levilab sweep` takes without other options.
TOLERANCE, DURATION_S, OBSERVED = 1e-6, 30.0, "survived,lifetime_s"
#: Wanted error of the sweeps that try whether the step matters.
STRICT = 1e-9
ON_AXIS = "start.position_m=[0,0,0.071]"
AT_REST = "start.velocity_m_s=[0,0,0]"


@dataclass(frozen=True)
class Sweep:
    """One sweep.

    Attributes:
        name: of its store.
        scene: a preset.
        axes: KEY=FROM:TO:N each.
        duration_s: of each motion.
        observe: names of observables, with commas.
        settings: KEY=VALUE each.
        tolerance: wanted error of place [m] and axis [rad] of tops that stay up.
    """

    name: str
    scene: str
    axes: tuple[str, ...]
    duration_s: float = DURATION_S
    observe: str = OBSERVED
    settings: tuple[str, ...] = ()
    tolerance: float = TOLERANCE

    @property
    def plan(self) -> Plan:
        """Its plan, with a step still to be chosen."""
        axes = tuple(parse_axis(axis) for axis in self.axes)
        return Plan(self.changed_scene, axes, tuple(self.observe.split(",")), self.duration_s, tolerance=self.tolerance)

    @property
    def changed_scene(self) -> Scene:
        """The preset with the settings."""
        return with_settings(preset(self.scene), list(self.settings))

    @property
    def command(self) -> str:
        """What makes the same store on the command line; what `levilab sweep` takes anyway is left out."""
        words = [f"levilab sweep {self.scene}", *(f"--sweep {axis}" for axis in self.axes)]
        words += [f'--set "{setting}"' if "[" in setting else f"--set {setting}" for setting in self.settings]
        words += [f'--observe "{self.observe}"'] if self.observe != OBSERVED else []
        words += [f"--duration {self.duration_s:g}"] if self.duration_s != DURATION_S else []
        words += [f"--tolerance {self.tolerance:g}"] if self.tolerance != TOLERANCE else []
        return " ".join([*words, f"--out {self.name}.zarr"])


SPINS, UPPER = "start.spin_hz=18:90:145", "start.spin_hz=65:83:1801"
FEET, HEADS = "start.spin_hz=21:25:201", "start.spin_hz=55:83:281"
#: By how much the start is moved sideways to see what is chance [m].
NUDGES = (1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4)
#: Starts in which one thing is changed, to see whether it is the reason: name → start, settings.
CHANGES: dict[str, tuple[str, ...]] = {
    "IC1-on-axis": (ON_AXIS, AT_REST),
    "IC1-at-rest-in-height": ("start.position_m=[0.001,0,0.07299]", "start.velocity_m_s=[-0.0007,0,0]"),
    "IC1-upright-on-axis": (ON_AXIS, AT_REST, "start.tilt_rad=0.000001"),
    "IC2-steady": (*STARTS["IC2"], "start.precession=steady"),
    "IC3-near-axis": ("start.position_m=[0.0001,0,0.0725]", "start.velocity_m_s=[-0.002,0,0.0005]"),
    "IC3-as-printed": ("start.position_m=[0.005,0,0.0725]", "start.velocity_m_s=[-0.002,0,0.0005]"),
    "IC4-steady": (*STARTS["IC4"], "start.precession=steady"),
}
#: Masses [kg] and heights of starts 0.5 mm below where each floats [m], for the resonance of three slow motions.
RESONANT = {
    0.0249: 0.07445,
    0.025: 0.0740,
    0.0251: 0.07345,
    0.0252: 0.07289,
    0.02526: 0.07249,
    0.0253: 0.0722,
    0.0254: 0.07131,
}

LOCK = "survived,lifetime_s,locked"
DRIVES, AMPLITUDES = "drive.frequency_hz=28.6:31.4:113", "drive.amplitude_t=0.0001:0.0008:15"
NEAR, MASSES = "drive.frequency_hz=29.63:30.43:17", "top.mass_kg=0.0241:0.0246:6"
#: The drive's waveform → settings; the scene driven has a sine.
WAVES: dict[str, tuple[str, ...]] = {"sine": (), "square": ("drive.waveform=square",)}

SWEEPS: tuple[Sweep, ...] = (
    Sweep("survival", "undriven", (SPINS, "top.mass_kg=0.02418:0.0255:23", "start.position_m.2=0.067:0.085:37")),
    Sweep(
        "survival-strict",
        "undriven",
        (SPINS, "start.position_m.2=0.067:0.085:37"),
        settings=("top.mass_kg=0.02526",),
        tolerance=STRICT,
    ),
    Sweep("edge", "undriven", ("start.spin_hz=64:84:401", "start.position_m.2=0.069:0.077:33")),
    Sweep("foot", "undriven", ("start.spin_hz=21:24:151", "start.position_m.2=0.068:0.0775:39")),
    *(
        Sweep(
            f"bounce{suffix}",
            "undriven",
            ("start.spin_hz=24:36:4", "top.mass_kg=0.012:0.024:7", "start.position_m.2=0.0645:0.0715:29"),
            300.0,
            settings=settings,
        )
        for suffix, settings in (("", ()), ("-exact", ("base.field=exact",)))
    ),
    Sweep(
        "fall",
        "friction",
        ("top.mass_kg=0.0242:0.0255:66", "start.position_m.2=0.067:0.079:49"),
        150.0,
        "survived,lifetime_s,fall_spin_hz",
        ("escape.height_m=0.06",),
    ),
    *(
        Sweep(
            name,
            "undriven",
            ("start.spin_hz=55:90:1751",),
            observe="survived,lifetime_s,position_error_m",
            settings=settings,
        )
        for name, settings in STARTS.items()
    ),
    *(
        Sweep(
            f"{name}-drag",
            "friction",
            ("start.spin_hz=30:30.9:10",),
            150.0,
            "survived,lifetime_s,fall_spin_hz",
            (*settings, "escape.height_m=0.06"),
        )
        for name, settings in STARTS.items()
    ),
    Sweep("fine", "undriven", ("start.spin_hz=65:83:7201",)),
    Sweep("long", "undriven", (UPPER,), 300.0),
    Sweep("long-IC2", "undriven", ("start.spin_hz=65:83:361",), 300.0, settings=STARTS["IC2"]),
    *(
        Sweep(f"nudge-{nudge:g}", "undriven", (UPPER,), settings=(f"start.position_m=[{0.001 + nudge!r},0,0.071]",))
        for nudge in NUDGES
    ),
    *(Sweep(f"{name}-low", "undriven", (FEET,), settings=settings) for name, settings in (STARTS | CHANGES).items()),
    *(Sweep(f"{name}-high", "undriven", (HEADS,), settings=settings) for name, settings in CHANGES.items()),
    *(
        Sweep(
            f"resonance-{1000 * mass:g}",
            "undriven",
            (HEADS,),
            60.0,
            settings=(
                f"top.mass_kg={mass}",
                f"start.position_m=[0.001,0,{height}]",
                "start.velocity_m_s=[-0.0007,0,0]",
            ),
        )
        for mass, height in RESONANT.items()
    ),
    *(Sweep(f"lock-{wave}", "driven", (DRIVES, AMPLITUDES), 60.0, LOCK, settings) for wave, settings in WAVES.items()),
    *(
        Sweep(f"lock-{wave}-strict", "driven", (DRIVES, AMPLITUDES), 60.0, LOCK, settings, STRICT)
        for wave, settings in WAVES.items()
    ),
    *(
        Sweep(f"lock-{wave}-{name}", "driven", (NEAR, AMPLITUDES), 60.0, LOCK, (*settings, change))
        for wave, settings in WAVES.items()
        for name, change in (("straight", "top.moment_tilt=[0,0.97]"), ("floating", "start.place=equilibrium"))
    ),
    Sweep(
        "lock-phase",
        "driven",
        (DRIVES, "drive.phase_rad=0:5.759586531581287:12"),
        60.0,
        LOCK,
        ("drive.amplitude_t=0.0002",),
    ),
    *(
        Sweep(f"modes-{wave}", "driven", ("drive.frequency_hz=0.1:60:600",), 30.0, LOCK, settings)
        for wave, settings in (
            ("sine", ("drive.amplitude_t=0.0002",)),
            ("square", ("drive.waveform=square", "drive.amplitude_t=0.0002")),
        )
    ),
    Sweep(
        "beat",
        "driven",
        ("drive.frequency_hz=28:32:81", MASSES),
        60.0,
        LOCK,
        ("drive.amplitude_t=0.0003", "start.place=equilibrium"),
    ),
    Sweep(
        "beat-weak",
        "driven",
        ("drive.frequency_hz=30.53:32.03:76", MASSES),
        60.0,
        "survived,height_spread_m",
        ("drive.amplitude_t=0.00001", "start.place=equilibrium"),
    ),
)
