"""What an analysis adds to a report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class InputPart:
    """What the analysis says of one input.

    Attributes:
        readings: the readings in a few lines of words.
        origin: where the numbers come from.
        alone: what the input says by itself.
        context: for the template.
    """

    readings: tuple[str, ...]
    origin: str
    alone: str
    context: Mapping[str, Any]


@dataclass(frozen=True)
class ReportPart:
    """What the analysis says of all inputs.

    Attributes:
        subject: in the title of the page.
        heading: of the page.
        lead: how much was used.
        figure_text: what the figure shows, for readers who do not see it.
        template: has the macros result(part), runs(part) and readings(input).
        context: for the template.
    """

    subject: str
    heading: str
    lead: str
    figure_text: str
    template: str
    context: Mapping[str, Any]
    inputs: tuple[InputPart, ...]
