"""What an analysis adds to a report, as blocks of a document."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from analysis.numbers import digits
from levilab.present.document.blocks import Block, Points
from levilab.present.numbers import short_name
from levilab.texts.text import Text, how_many

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from levilab.pipelines.analyzed import Analyzed
    from levilab.pipelines.inputs.source import Source

#: How an estimate is written.
VALUE_U = "value(u): the digits in parentheses are the standard uncertainty of the last digits."


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
        points: what answers to the pointer; of many runs, whose figure is a picture of dots, there are none.
    """

    title: str
    caption: str
    points: tuple[Points, ...] = ()


@dataclass(frozen=True)
class ReportPart:
    """What the analysis says of all inputs.

    Attributes:
        subject: in the title of the page.
        heading: of the page.
        lead: how much was used.
        result: what follows its text: numbers with their uncertainties, what they mean.
        figure: its words.
        values: the numbers alone, for a short report; none: as `result`.
        short_figure: the words of its short figure; None: it has none, and the figure is that of every report.
        inputs: one by one.
        compared: the models compared, below the figure; none: there is no such section.
        runs_title: of the section with `runs`.
        runs: what belongs to each run rather than to all; none: there is no such section.
    """

    subject: str
    heading: str
    lead: str
    result: tuple[Block, ...]
    figure: FigureText
    inputs: tuple[InputPart, ...]
    values: tuple[Block, ...] = ()
    short_figure: FigureText | None = None
    compared: tuple[Block, ...] = ()
    runs_title: str = ""
    runs: tuple[Block, ...] = ()


def first_of(shown: int, count: int) -> str:
    """Return which part of a listing is printed; empty for the whole.

    >>> first_of(200, 20000), first_of(20, 20)
    ('The first 200 of 20000; all of them are in the data.', '')
    """
    return Text("The first {shown} of {n}; all of them are in the data.", shown=shown, n=count) if count > shown else ""


def input_parts(
    analysis: Analyzed[Any, Any, Any, Any],
    readings: Callable[[Source[Any], Any, Any], tuple[str, ...]],
    blocks: Callable[[Source[Any], Any, Any], tuple[Block, ...]],
    alone: Callable[[Any], str] = lambda run: str(run.text),
) -> tuple[InputPart, ...]:
    """Return the part of each input.

    Args:
        analysis: of all inputs.
        readings: from an input, what was found of it, and the options that this was found with.
        blocks: likewise.
        alone: from what was found of an input.
    """
    return tuple(
        InputPart(readings(source, run, origin.options), origin.text, alone(run), blocks(source, run, origin.options))
        for source, run, origin in zip(analysis.sources, analysis.runs, analysis.origins, strict=True)
    )


def title_of(subject: str, sources: Sequence[Source[Any]], noun: str = "run") -> str:
    """Return the title of a first table: the subject, the number of inputs, and how many are synthetic."""
    total, synthetic = len(sources), sum(source.synthetic for source in sources)
    some = Text(", {synthetic} of them SYNTHETIC", synthetic=synthetic)
    mark = "" if not synthetic else ", SYNTHETIC" if synthetic == total else some
    return Text("{subject}, {inputs}{mark}", subject=subject, inputs=how_many(total, noun), mark=mark)


def labels_of(sources: Sequence[Source[Any]]) -> list[str]:
    """Return the names of several inputs; of a single one an empty text."""
    return [short_name(source.name) if len(sources) > 1 else "" for source in sources]


def points_of(
    analysis: Analyzed[Any, Any, Any, Any], lines: Callable[[Any], Iterable[Iterable[str]]], *panels: str
) -> tuple[Points, ...]:
    """Return the texts of the points of each run, of several runs with its name, once for each panel.

    Args:
        analysis: of all inputs.
        lines: from what was found of an input, the lines of each of its points.
        panels: of the figure, by the first part of the name of its points.
    """
    found = []
    for k, (name, run) in enumerate(zip(labels_of(analysis.sources), analysis.runs, strict=True)):
        texts = tuple("\n".join(filter(None, (name, *one))) for one in lines(run))
        found += [Points(f"{panel}-{k}", texts) for panel in panels]
    return tuple(found)


def size_of_u(u: NDArray[np.float64]) -> str:
    """Return the least and the greatest standard uncertainty of readings [Hz], as text."""
    low, high = float(u.min()), float(u.max())
    low_hz = Text("{low:n} Hz", low=digits(low))
    return low_hz if low == high else Text("{low} to {high:n} Hz", low=low_hz, high=digits(high))


def origin_of_u(source: Source[Any], column: str, options: Any) -> str:
    """Return where the uncertainties of readings come from.

    Args:
        source: the input.
        column: of the uncertainties.
        options: of the analysis.
    """
    if options.reading_u is not None:
        return "as given to the analysis"
    channels = source.run.record.channels if source.run else []
    return next(
        (str(c["source"]) for c in channels if c.get("name") == column and c.get("source")), "from a column of the data"
    )
