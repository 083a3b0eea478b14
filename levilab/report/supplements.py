"""What a report says of an analysis beyond its own part: here other rooms add sections, a row each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.pipelines.catalogue import Analysis
    from levilab.present.document.blocks import Block

#: An analysis and what it found → blocks that stand between its figure and the part run by run; none where there is
#: nothing to say.  In this order.
SUPPLEMENTS: tuple[Callable[[Analysis[Any], Any], tuple[Block, ...]], ...] = ()
