"""The subjects of a cross-check."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from levilab.crosscheck.names import ROWS
from levilab.crosscheck.subject import Subject


def _subject(row: str) -> Subject:
    module, _, name = row.partition(".")
    subject: Subject = getattr(import_module(f"levilab.crosscheck.subjects.{module}"), name)
    return subject


#: Name → subject.
SUBJECTS: Mapping[str, Subject] = MappingProxyType({name: _subject(row) for name, row in ROWS.items()})
