"""The subjects of a cross-check: a row each."""

from __future__ import annotations

from types import MappingProxyType

from levilab.crosscheck.subjects import field, hold, limit, motion, phone, precession, spin, spindown, sway, tune, video

#: Name → subject.
SUBJECTS = MappingProxyType(
    {
        subject.name: subject
        for subject in (
            spin.SUBJECT,
            spindown.SUBJECT,
            spindown.SOUND,
            phone.SUBJECT,
            motion.SUBJECT,
            precession.SUBJECT,
            field.SUBJECT,
            sway.SUBJECT,
            video.SUBJECT,
            hold.SUBJECT,
            limit.SUBJECT,
            tune.SUBJECT,
        )
    }
)
