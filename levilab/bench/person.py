"""The person at the bench: what an experiment may have to ask of one."""

from collections.abc import Callable
from dataclasses import dataclass

from levilab.texts.text import Text


@dataclass(frozen=True)
class Task:
    """What a person is to do or to answer.  text: as the events of the run have it."""

    text: str

    @property
    def prompt(self) -> str:
        """The text as a person with a keyboard reads it."""
        return self.text


@dataclass(frozen=True)
class PlaceProbe(Task):
    """The magnetometer's probe is to stand on the axis.  height_m: above the base [m]."""

    height_m: float

    @property
    def prompt(self) -> str:
        """With what can be typed."""
        return Text("{text} Put the probe there, on the axis, or type the height in mm at which it stands.", self.text)


@dataclass(frozen=True)
class ShieldProbe(Task):
    """The magnetometer's probe is to lie in its zero-gauss chamber."""


@dataclass(frozen=True)
class FloatTop(Task):
    """The top is to be spun by hand and to float.  number: how many tops of the series came before."""

    number: int = 0


#: Carries out a task and returns the answer, empty where none is asked for.
Person = Callable[[Task], str]


def ask_no_person(task: Task) -> str:  # noqa: ARG001 - as a person is asked
    """Return no answer, as no person is at the bench."""
    return ""
