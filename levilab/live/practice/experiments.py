"""What a student can record at the bench for practice: a row an experiment.

The settings take some minutes of the bench at most: the usual ones are those of a laboratory, which has the time.
"""

from dataclasses import dataclass

from levilab.simulator.scene import Scene


@dataclass(frozen=True)
class PracticeExperiment:
    """A row.

    Attributes:
        title: for people.
        asks: what it finds out, in a sentence.
        experiment: the name that `levilab acquire` knows it by.
        settings: as for the command line.
        length_s: bench time that it takes, about [s].
        scene: of its top; empty: that of the bench.
    """

    title: str
    asks: str
    experiment: str
    settings: tuple[str, ...]
    length_s: float
    scene: str = ""

    @property
    def moves_probe(self) -> bool:
        """Whether it moves the magnetometer's probe: its readings say where that stands, and the top is taken off."""
        return self.experiment == "field"


def _prefixed(table: str, *settings: str) -> tuple[str, ...]:
    return tuple(f"{table}.{one}" for one in settings)


#: A drive that has the top up in half a minute.  A square wave holds it better than a sine, by 4/π.
_DRIVE = ("drive_waveform=SQU", "ramp_hz_per_s=0.1")

#: What a count over 1 s scatters by here, by second differences of readings: the light wobbles with the top [Hz].
_WOBBLE, _CALM = "reading_u_hz=0.012", "reading_u_hz=0.003"

#: Name → row; the experiment of the guide first.
PRACTICE: dict[str, PracticeExperiment] = {
    "spin": PracticeExperiment(
        "spin-down", "How does the air slow the top? Driven to 33 Hz and let go, until it falls.", "spin",
        _prefixed("spin", *_DRIVE, "drive_frequency_hz=33", "hold_s=10", "interval_s=2", _WOBBLE), 190.0,
    ),
    "triggered": PracticeExperiment(
        "spin-down, triggered drive", "Can the top drive itself? Its own tape starts each cycle of the drive.", "spin",
        _prefixed("spin", "drive=triggered", "drive_frequency_hz=33", "hold_s=5", "interval_s=2",
                  _WOBBLE), 150.0,
    ),
    "hold": PracticeExperiment(
        "held spin", "How much drive balances the air at 33 Hz? The amplitude says it.", "hold",
        _prefixed("hold", "drive_frequency_hz=33", "hold_s=10", "interval_s=5", "longest_s=40"), 180.0,
    ),
    "precession": PracticeExperiment(
        "precession", "Does the stem go round once for each turn of the drive? Laser against drive, with a calm top of "
        "its own.", "precession",
        _prefixed("precession", *_DRIVE[:1], "ramp_hz_per_s=0.2", "drive_frequency_hz=44", "first_hz=44", "last_hz=38",
                  "step_hz=2", "hold_s=5", "counts=5"),
        155.0, scene="precession",  # the air makes the free wobble of the usual top grow: its stem cuts the beam anyhow
    ),
    "lower limit": PracticeExperiment(
        "lower limit", "How slow is too slow? Two free tops, each until it falls.", "limit",
        _prefixed("limit", "repetitions=2"), 290.0,
    ),
    "upper limit": PracticeExperiment(
        "upper limit", "How fast can the drive take the top? Up until it is lost.", "limit",
        _prefixed("limit", "which=upper", "repetitions=1", "drive_waveform=SQU", "drive_frequency_hz=30",
                  "creep_hz_per_s=0.15"), 230.0,
    ),
    "sway": PracticeExperiment(
        "sway", "How does a pushed top swing? Films of a top of its own, with its spin.", "sway",
        _prefixed("sway", "longest_s=60"), 60.0, scene="sway",
    ),
    "loose washers": PracticeExperiment(
        "loose washers", "What if the tape slips? The counter then sees the washers, and not the top.", "spin",
        _prefixed("spin", *_DRIVE, "drive_frequency_hz=32", "hold_s=20", "interval_s=2", _CALM), 160.0,
        scene="loose-washers",
    ),
    "trace": PracticeExperiment(
        "records of the light", "What does the counter count? Five records of the oscilloscope.", "trace",
        _prefixed("trace", "records=5", "interval_s=2"), 9.0,  # a free top is down before ten of every 10 s
    ),
    "field": PracticeExperiment(
        "field of the base", "What holds the top up? A Hall probe on the axis, with the top taken off.", "field",
        _prefixed("field", "base_thickness_m=0"), 68.0,  # a thin ring, as in the practice scene
    ),
}  # fmt: skip


def settings_for(plan: PracticeExperiment, scene: Scene) -> tuple[str, ...]:
    """Return the settings of an experiment on the bench of a scene: a scan knows the moment of its top, to 1 %."""
    if plan.experiment != "field":
        return plan.settings
    moment = abs(scene.top.moment_a_m2) * scene.top.moment_tilt[1]
    known = _prefixed("field", f"top_moment_a_m2={moment:.3f}", f"top_moment_u_a_m2={0.01 * moment:.3f}")
    return (*known, *plan.settings)
