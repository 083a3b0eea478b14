"""Reports whose cross-checks no test looks at."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import pytest

from levilab.crosscheck.own.study import FEWEST, trials_of_report

if TYPE_CHECKING:
    from collections.abc import Iterator

    from levilab.crosscheck.own.model import Own


@contextlib.contextmanager
def with_few_trials() -> Iterator[None]:
    """A report makes the fewest trials that it shows, where it makes any: two seconds for each analysis otherwise."""

    def count(subject: Own) -> int:
        return min(trials_of_report(subject), FEWEST)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.crosscheck.own.study.trials_of_report", count)
        yield
