"""What a person writes above a report: its title, the course, the authors, the date."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from levilab.present.document.blocks import Document


@dataclass(frozen=True)
class Heading:
    """The heading of a report, as a person typed it.

    Attributes:
        title: takes the place of the report's own; empty: that stays.
        course, author, date: below the title; empty: not said.
    """

    title: str = ""
    course: str = ""
    author: str = ""
    date: str = ""

    @property
    def typed(self) -> list[str]:
        """The options as one types them."""
        given = ((one.name, getattr(self, one.name)) for one in fields(self))
        return [word for name, text in given if text for word in (f"--{name}", shlex.quote(text))]

    def above(self, document: Document) -> Document:
        """Return the document below this heading; its own title then begins the line below."""
        byline = " · ".join(filter(None, (self.course, self.author, self.date)))
        if not self.title:
            return replace(document, byline=byline)
        return replace(document, title=self.title, lead=f"{document.title}: {document.lead}", byline=byline)
