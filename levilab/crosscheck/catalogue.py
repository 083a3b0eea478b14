"""The subjects of a cross-check by their names; one is imported when it is tried, so that wrong names cost no time."""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from levilab.crosscheck.subject import Subject

#: Name → the row of a subject in `levilab.crosscheck.subjects`.
ROWS = MappingProxyType({
    "spin": "spin.SUBJECT",
    "spindown": "spindown.SUBJECT",
    "sound": "spindown.SOUND",
    "phone": "phone.SUBJECT",
    "motion": "motion.SUBJECT",
    "precession": "precession.SUBJECT",
    "field": "field.SUBJECT",
    "sway": "sway.SUBJECT",
    "video": "video.SUBJECT",
    "hold": "hold.SUBJECT",
    "limit": "limit.SUBJECT",
    "tune": "tune.SUBJECT",
})  # fmt: skip


def subject_of(name: str) -> Subject:
    """Return the subject of a name."""
    module, _, row = ROWS[name].partition(".")
    subject: Subject = getattr(import_module(f"levilab.crosscheck.subjects.{module}"), row)
    return subject
