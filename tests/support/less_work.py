"""Work that no test looks at: trials of a report, and a second fit of readings that another test has fitted."""

from __future__ import annotations

import contextlib
import pickle
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest

from levilab.crosscheck.own.study import FEWEST, trials_of_report

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from levilab.crosscheck.own.model import Own

#: Functions of readings and options alone, by room: many tests give them the sample data.
FITS = {"field": "fit_scan", "spindown": "fit_spin_down", "sway": "swings_of"}


@contextlib.contextmanager
def with_less_work() -> Iterator[None]:
    """Make the fewest trials that a report shows, 2 s for each analysis otherwise; fit the same readings once."""

    def count(subject: Own) -> int:
        return min(trials_of_report(subject), FEWEST)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.crosscheck.own.study.trials_of_report", count)
        for room, name in FITS.items():
            module = import_module(f"levilab.pipelines.{room}.analysis")
            patch.setattr(module, name, _once(getattr(module, name)))
        yield


def _once(fit: Callable[..., Any]) -> Callable[..., Any]:
    """Remember what a fit gave; an error is raised again each time."""
    known: dict[bytes, Any] = {}

    def call(*readings: Any, **options: Any) -> Any:
        key = pickle.dumps((readings, sorted(options.items())))
        if key not in known:
            known[key] = fit(*readings, **options)
        return known[key]

    return call
