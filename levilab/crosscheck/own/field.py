"""Scans of a base with the fitted field, the heights, and the uncertainties of probe and calliper of a result."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.field.fit import PARAMETERS, FieldScan, Known, Prior, fit_scan
from analysis.field.ring import on_axis
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Trial, pull_of
from levilab.texts.text import Text

if TYPE_CHECKING:
    from levilab.pipelines.field.analysis import FieldAnalysis

#: Processor time of a trial, for each scan [s].
_COST_S = 0.016
#: What is compared; a thickness that the calliper alone gives has the pulls of the calliper.
_COMPARED = ("strength", "origin", "thickness", "background")


def trials_of(found: FieldAnalysis) -> Own:
    """Return the trials of the first scan."""
    scan, source = found.runs[0].scan, found.sources[0]
    order = np.argsort(source.readings.height, kind="stable")
    u_z = source.readings.height_u
    u_z = np.zeros(len(order)) if u_z is None else u_z[order]
    u_b = None if source.readings.u is None else source.readings.u[order]
    by_height = on_axis(scan.ring, scan.height)[1] * u_z
    noise = np.sqrt(np.maximum(scan.u**2 - by_height**2, 0.0))

    def trial(random: np.random.Generator) -> Trial:
        known = _known_dimensions(random, scan)
        gain = 1 + scan.known.gain_u * random.standard_normal()
        true_height = scan.height + u_z * random.standard_normal(len(u_z))
        b = gain * (scan.model(true_height) - scan.values[3]) + scan.values[3]
        b = b + noise * random.standard_normal(len(b))
        again = fit_scan(scan.height, b, known, u_b, u_z)
        return Trial(
            [
                pull_of(name, again.parameters[name], float(scan.values[PARAMETERS.index(name)]))
                for name in _COMPARED
                if again.parameters[name].u
            ]
        )

    which = "the first scan" if len(found.runs) > 1 else "the scan"
    return Own(
        about=Text(
            "{scan} again from the fitted base: calliper, zero, scale, heights and readings drawn by their u", which
        ),
        trial=trial,
        cost_s=_COST_S,
    )


def _known_dimensions(random: np.random.Generator, scan: FieldScan) -> Known:
    """Return the dimensions that calliper and data sheet would give of the fitted base."""
    said: dict[str, Any] = {
        name: Prior(float(scan.values[k]) + prior.u * random.standard_normal(), prior.u)
        for k, name in enumerate(PARAMETERS)
        if (prior := scan.known.prior(name))
    }
    return replace(scan.known, **said)
