"""Which washers today, as `levilab tune` says it: a page sends all answers so far with each question."""

from collections.abc import Mapping
from typing import Any

from levilab.errors import UsageError
from levilab.formats.typed import read_mass, read_masses, read_temperature
from levilab.pipelines.tune.advice import advise
from levilab.pipelines.tune.owner import Owner, washers_text
from levilab.texts.text import Sentences, text_of

#: Trials that are taken at most.
_MOST_TRIALS = 100


def advice_on(wanted: Mapping[str, Any]) -> dict[str, Any]:
    """Return the next step, as data.

    Args:
        wanted: top, washers and temperature, and trials, a list: each as it is typed.

    Raises:
        UsageError: one of them is no mass, temperature or trial.
    """
    trials = wanted.get("trials")
    name = "top"
    try:
        owner = Owner(read_mass(str(wanted.get(name, ""))))
        name = "washers"
        owner = owner.with_washers(read_masses(str(wanted.get(name, ""))))
        name = "trials"
        for text in trials[:_MOST_TRIALS] if isinstance(trials, list) else ():
            owner = owner.with_trial(str(text))
        name = "temperature"
        found = advise(owner, read_temperature(str(wanted.get(name, ""))))
    except ValueError as error:
        raise UsageError(name, text_of(error)) from error
    return {
        "text": found.text,
        "why": Sentences(found.why, found.window, *found.warnings),
        "washers": washers_text(found.best.washers_kg),
        "washers_g": round(1e3 * sum(found.best.washers_kg), 6),
    }
