"""Sweeps of the drive with the fitted line, the drive's frequencies and the u of the points of a result."""

from __future__ import annotations

import numpy as np

from analysis.precession.sweep import EXCLUDED_P, Sweep, fit_sweep
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Trial, pull_of
from levilab.pipelines.precession.analysis import PrecessionAnalysis
from levilab.pipelines.precession.words import intercept_of, slope_of
from levilab.texts.text import Text

#: Processor time of a trial [s].
_COST_S = 0.003


def trials_of(found: PrecessionAnalysis) -> Own:
    """Return the trials of sweeps: the line through the points of all of them."""
    fit, options = found.combined, found.options
    line = fit.line
    used = np.array([point.used for point in fit.points])
    drive, u, u_drive = (fit.column(name)[used] for name in ("drive", "u", "u_drive"))
    stated = bool(np.isfinite(u).all())
    scatter = line.scale * u if stated else np.full(drive.size, line.scale)
    along_x = u_drive if line.orthogonal and np.isfinite(u_drive).all() else np.zeros_like(drive)
    has_u_drive = bool(np.isfinite(u_drive).all())

    def trial(random: np.random.Generator) -> Trial:
        x = drive + along_x * random.standard_normal(drive.size)
        y = line.at(drive) + scatter * random.standard_normal(drive.size)
        sweep = Sweep(x, y, u if stated else None, u_drive if has_u_drive else None)
        again = fit_sweep(sweep, orthogonal=options.orthogonal, keep_miscounts=True)
        p = again.line.p_against(line.slope, line.intercept)
        return Trial(
            [pull_of("slope", slope_of(again), line.slope), pull_of("intercept", intercept_of(again), line.intercept)],
            excluded=None if p is None else p < EXCLUDED_P,
        )

    return Own(
        about=Text("{n} points on the fitted line, at these frequencies of the drive, with their scatter", drive.size),
        trial=trial,
        cost_s=_COST_S,
        hypothesis="the true line",
        expected_share=EXCLUDED_P,
    )
