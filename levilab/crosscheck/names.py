"""The subjects of a cross-check by their names; nothing heavy is imported, so that a wrong one is refused at once."""

from types import MappingProxyType

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
