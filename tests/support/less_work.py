"""Work that few tests look at: drawing, trials of a report, a second fit of readings that another test has fitted."""

import contextlib
import pickle
from importlib import import_module

import pytest

from levilab.crosscheck.own.study import FEWEST, trials_of_report
from support.figures import without_drawing

#: Functions of readings and options alone, by room: many tests give them the sample data.
FITS = {"field": "fit_scan", "spindown": "fit_spin_down", "sway": "swings_of"}


@contextlib.contextmanager
def with_less_work():
    """Make the fewest trials that a report shows, 2 s for each analysis otherwise; fit the same readings once.

    Figures are made and not drawn, which is half a second for each; see `with_drawing`.
    """

    def count(subject):
        return min(trials_of_report(subject), FEWEST)

    with without_drawing(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.crosscheck.own.study.trials_of_report", count)
        for room, name in FITS.items():
            module = import_module(f"levilab.pipelines.{room}.analysis")
            patch.setattr(module, name, _once(getattr(module, name)))
        yield


def _once(fit):
    """Remember what a fit gave; an error is raised again each time."""
    known = {}

    def call(*readings, **options):
        key = pickle.dumps((readings, sorted(options.items())))
        if key not in known:
            known[key] = fit(*readings, **options)
        return known[key]

    return call
