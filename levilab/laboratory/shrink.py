"""A laboratory that failed, with everything left out that it does not need to fail."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from levilab.laboratory.plan import MOST_LIVES, Plan
from levilab.laboratory.visit import Told, visit

#: More attempts would take longer than a person waits.
_MOST_TRIES = 200


def shrink(told: Told, status_of: Callable[[Exception], int | None]) -> Told:
    """Return the smallest laboratory that was found to break the first of the same rules.

    status_of: see `levilab.laboratory.visit.Visit`.
    """
    oracle, tries = told.findings[0].oracle, 0
    again = True
    while again and tries < _MOST_TRIES:
        again = False
        for plan in _smaller(told.plan):
            tries += 1
            found = visit(plan, status_of)
            if any(finding.oracle == oracle for finding in found.findings):
                told, again = found, True
                break
    return told


def _smaller(plan: Plan) -> Iterator[Plan]:
    """Yield plans with one thing less: an event, what was typed, a model, a pause."""
    for event in plan.events:
        yield replace(plan, events=tuple(one for one in plan.events if one is not event))
    for name in plan.typed:
        yield replace(plan, typed={one: text for one, text in plan.typed.items() if one != name})
    for kind in plan.models:
        yield replace(plan, models={one: model for one, model in plan.models.items() if one != kind})
    plain = (5.0,) * MOST_LIVES
    if plan.pauses_s != plain:
        yield replace(plan, pauses_s=plain)
