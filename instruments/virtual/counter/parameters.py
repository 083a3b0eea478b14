"""Parameters of the virtual counters' commands: channel lists, numbers in brackets."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from instruments.virtual.core.parser import ScpiError

if TYPE_CHECKING:
    from collections.abc import Sequence

# blanks match in one place only: \s* before a set that has them, too, takes a time that grows with their square
_CHANNELS = re.compile(r"\(@([\d,\s]+)\)")
_BRACKETED = re.compile(r"\(([^@()]*)\)")


def channels_of(parameters: list[str], numbered: Sequence[int]) -> tuple[int, ...]:
    """Return the channels in channel lists, in their order.

    Args:
        parameters: of a command.
        numbered: the channels of the counter.

    Raises:
        ScpiError: the counter does not have one of them.

    >>> channels_of(["10", "(@2)", "(@1)"], (1, 2))
    (2, 1)
    """
    lists = [found for text in parameters if (found := _CHANNELS.fullmatch(text))]
    named = [word.strip().lstrip("0") for found in lists for word in found[1].split(",") if word.strip()]
    if any(word not in map(str, numbered) for word in named):  # compared as text: a number may have any length
        raise ScpiError(-224, "channel")
    return tuple(map(int, named))


def without_channels(parameters: list[str]) -> list[str]:
    """Return the parameters without channel lists; a number may stand in brackets, as in the CNT-91's handbook.

    >>> without_channels(["(100)", "(@1)"])
    ['100']
    """
    plain = [text for text in parameters if not _CHANNELS.fullmatch(text)]
    return [found[1].strip() if (found := _BRACKETED.fullmatch(text)) else text for text in plain]
