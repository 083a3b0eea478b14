"""What an analysis adds to a report, as blocks of a document."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from levilab.present.document.blocks import Block, Points


@dataclass(frozen=True)
class InputPart:
    """What the analysis says of one input.

    Attributes:
        readings: the readings in a few lines of words.
        origin: where the numbers come from.
        alone: what the input says by itself.
        blocks: its readings one by one.
    """

    readings: tuple[str, ...]
    origin: str
    alone: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class FigureText:
    """The words of the analysis's figure.

    Attributes:
        title: what it is, in a few words.
        caption: what is to be seen, in sentences.
        alt: the same in one line, for readers who do not see it.
        points: what answers to the pointer; of many runs, whose figure is a picture of dots, there are none.
    """

    title: str
    caption: str
    alt: str
    points: tuple[Points, ...] = ()


@dataclass(frozen=True)
class ReportPart:
    """What the analysis says of all inputs.

    Attributes:
        subject: in the title of the page.
        heading: of the page.
        lead: how much was used.
        verdict: what the data say, in a few sentences.
        result: what follows the verdict: numbers with their uncertainties, what they mean, the models compared.
        figure: its words.
        runs_title: of the section with `runs`.
        runs: what belongs to each run rather than to all.
        inputs: one by one.
    """

    subject: str
    heading: str
    lead: str
    verdict: str
    result: tuple[Block, ...]
    figure: FigureText
    runs_title: str
    runs: tuple[Block, ...]
    inputs: tuple[InputPart, ...]


def first_of(shown: int, count: int) -> str:
    """Which part of a listing is printed; empty where it is all.

    >>> first_of(200, 20000), first_of(20, 20)
    ('The first 200 of 20000; all of them are in the data.', '')
    """
    return f"The first {shown} of {count}; all of them are in the data." if count > shown else ""
