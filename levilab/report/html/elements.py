"""HTML that is built of elements, so that no text can become markup: a plain str is escaped wherever it stands."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, TypeAlias

from levilab.present.document.typesetting import typeset

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Elements that have no content and no end.
_EMPTY = frozenset({"meta", "br", "img"})
_LEVELS = {"": "", "high": "sup", "low": "sub"}


@dataclass(frozen=True)
class Html:
    """Markup.  Only this module and files of ours make it; all else is text."""

    markup: str


#: What an element holds.
Child: TypeAlias = "str | Html | Iterable[Child]"


def element(name: str, /, *children: Child, **attributes: str | bool | None) -> Html:
    """Return an element.

    Args:
        name: such as "p".
        *children: text, which is escaped, elements, or several of them.
        **attributes: an underscore at the end is dropped (class_), others become hyphens; True stands without a value,
            None and False are left out.

    >>> element("p", "a < b", class_="lead", hidden=True, id=None).markup
    '<p class="lead" hidden>a &lt; b</p>'
    """
    given = "".join(_attribute(key, value) for key, value in attributes.items())
    if name in _EMPTY:
        return Html(f"<{name}{given}>")
    return Html(f"<{name}{given}>{join(children).markup}</{name}>")


def _attribute(key: str, value: str | bool | None) -> str:  # noqa: FBT001 - an attribute's value
    if value is None or value is False:
        return ""
    name = key.removesuffix("_").replace("_", "-")
    return f" {name}" if value is True else f' {name}="{escape(value)}"'


def join(children: Iterable[Child]) -> Html:
    """Return elements and texts one after the other."""
    return Html("".join(_markup(child) for child in children))


def _markup(child: Child) -> str:
    if isinstance(child, Html):
        return child.markup
    return escape(child) if isinstance(child, str) else join(child).markup


def words(text: str) -> Html:
    """Return a text with powers and indices set high and low.

    >>> words("3×10⁻⁴ <b>").markup
    '3×10<sup>−4</sup> &lt;b&gt;'
    """
    return join(element(_LEVELS[run.level], run.text) if run.level else run.text for run in typeset(text))


def lines(text: str) -> Html:
    r"""Return the same of several lines.

    >>> lines("ν₀\n[Hz]").markup
    'ν<sub>0</sub><br>[Hz]'
    """
    first, *others = text.split("\n")
    return join([words(first), *((element("br"), words(line)) for line in others)])
