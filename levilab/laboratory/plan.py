"""From one number to a laboratory: its bench, its top, its person, and what is to go wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from random import Random

from instruments.catalogue import CATALOGUE
from levilab.laboratory.events import EVENTS
from levilab.laboratory.fate import Event
from levilab.simulator.laws import LAWS
from levilab.world.light import Tape
from levilab.world.spin_world import SpinScene, random_scene

#: Processes that a laboratory has at most: the first, and those that resume its run.
MOST_LIVES = 4
#: Where a person has tasks, the chance of a slip over that of anything else that goes wrong.
_SLIPS = 3
#: Share of laboratories in which nothing goes wrong: there every number must be right.
_CALM = 0.15


@dataclass(frozen=True)
class Work:
    """How laboratories carry out an experiment.

    Attributes:
        share: of the laboratories.
        settings: of which one is drawn for each.
        steps: of a run without events, about; tasks: of its person.
        kinds: of the instruments that may be of any model.
    """

    share: float
    settings: Sequence[tuple[str, ...]]
    steps: int
    tasks: int = 0
    kinds: Sequence[str] = ("counter", "generator")


_QUICK = ("hold_s=0", "ramp_hz_per_s=0.2", "drive_frequency_hz=35")
#: Experiment → how it is carried out, within a fraction of a second.
WORK: Mapping[str, Work] = {
    "spin": Work(
        50, (_QUICK, (*_QUICK, "interval_s=20"), ("drive_waveform=NONE",), ("drive_waveform=NONE", "interval_s=5")), 900
    ),
    "field": Work(30, (("step_m=0.01", "readings=4"), ("step_m=0.02", "readings=2")), 300, 8, ("magnetometer",)),
    "limit": Work(8, (("repetitions=2", "drive_waveform=NONE"), ("repetitions=1", *_QUICK)), 1500, 2),
    "trace": Work(6, (("records=3", "points=1000"), ("records=2",)), 200, 0, ("oscilloscope",)),
    "hold": Work(3.3, (("longest_s=40", "drive_frequency_hz=32", "hold_s=0"),), 2500),
    # a motion takes seconds
    "precession": Work(
        0.4,
        (("drive_frequency_hz=34", "frequencies_hz=[34, 33, 32]", "counts=3", "hold_s=2", "ramp_hz_per_s=0.2"),),
        900,
    ),
    "sway": Work(0.3, ((),), 300),
}
#: Models that estimate a frequency from samples, which takes ten times as long: a few laboratories have one.
_SLOW_MODELS = {"phyphox", "sound"}
#: What a person may type beside: option → texts, of which the last ones are slips.
_TYPED = {
    "group": ("Group 7", "", " ", "Gruppe\t1", "x" * 30),
    "temperature": ("21.5 C", "294.6 K", "twenty", "21,5 °C", ""),
    "washers": ("0.06+0.1 g", "0", "0,06 g", "-1 g", "0.06 + g"),
    "settings": ("gate_s=0.5", "gate_s=0,5", "gate=1", "=3", "longest_s=nan", "interval_s=1e400"),
}


@dataclass(frozen=True)
class Plan:
    """A laboratory that is about to be.

    Attributes:
        seed: that it is made of.
        experiment: that is carried out.
        mock: whether each process has a virtual bench of its own; if not, the bench goes on meanwhile as a real one.
        settings: of the experiment.
        scene: the top, its light and its base.
        models: kind → model of the instruments.
        typed: option → what the person types.
        pauses_s: between the processes [s].
        events: what goes wrong.
    """

    seed: int
    experiment: str
    mock: bool
    settings: tuple[str, ...]
    scene: SpinScene
    models: Mapping[str, str] = field(default_factory=dict)
    typed: Mapping[str, str] = field(default_factory=dict)
    pauses_s: tuple[float, ...] = (5.0,) * MOST_LIVES
    events: tuple[Event, ...] = ()

    @property
    def is_calm(self) -> bool:
        """Whether the bench is as it should be."""
        return not any(EVENTS[event.what].of_bench for event in self.events)


def draw(seed: int) -> Plan:
    """Return the plan of a laboratory."""
    random = Random(f"laboratory {seed}")
    experiment = random.choices([*WORK], [work.share for work in WORK.values()])[0]
    work = WORK[experiment]
    return Plan(
        seed=seed,
        experiment=experiment,
        mock=random.random() < 0.3,
        settings=tuple(f"{experiment}.{setting}" for setting in random.choice(work.settings)),
        scene=_draw_scene(seed, random),
        models={kind: _draw_model(kind, random) for kind in work.kinds if random.random() < 0.6},
        typed={name: random.choice(texts) for name, texts in _TYPED.items() if random.random() < 0.06},
        pauses_s=tuple(round(random.expovariate(1 / 30), 3) for _ in range(MOST_LIVES)),
        events=tuple(_draw_events(work, random)) if random.random() > _CALM else (),
    )


def _draw_scene(seed: int, random: Random) -> SpinScene:
    """Draw drag, fall, light and base, and where the tape is."""
    law = random.choice(sorted(LAWS))
    return replace(
        random_scene(seed),
        start_hz=random.uniform(27.0, 33.0),
        drag=law,
        constants=tuple(c * random.uniform(0.8, 1.25) for c in LAWS[law].usual),
        fall_hz=random.uniform(20.8, 23.0),
        jitter=SpinScene.jitter * random.uniform(0.3, 2.0),
        tape=Tape(bright=random.uniform(1.0, 2.5), noise=random.uniform(0.002, 0.01)),
    )


def _draw_model(kind: str, random: Random) -> str:
    names = [model.name for model in CATALOGUE[kind]]
    return random.choices(names, [0.05 if name in _SLOW_MODELS else 1.0 for name in names])[0]


def _draw_events(work: Work, random: Random) -> list[Event]:
    """Draw a few events, more of them in early lives: a run that is not broken off has no other."""
    slips = [name for name, what in EVENTS.items() if what.kind == "task"]
    names = [name for name in EVENTS if name not in slips] + slips * (_SLIPS if work.tasks else 0)
    events = []
    for _ in range(1 + int(random.expovariate(0.5))):
        what = random.choice(names)
        most = work.tasks if EVENTS[what].kind == "task" else work.steps
        life = min(int(random.expovariate(1.5)), MOST_LIVES - 1)
        # a third of them at the beginning, where most is made, and the rest anywhere
        at = 1 + int(random.random() * (min(most, 60) if random.random() < 0.35 else most))
        events.append(Event(what, life, at, random.random()))
    return sorted(events, key=lambda event: (event.life, event.at))
