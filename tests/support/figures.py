"""Figures that no test looks at."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def undrawn() -> Iterator[None]:
    """Figures are made, but matplotlib does not draw them: that is most of what a result or a page costs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.present.style.as_png", lambda *_, **__: b"\x89PNG\r\n\x1a\n")
        patch.setattr("levilab.present.style.as_svg", lambda *_, **__: "<svg/>")
        yield
