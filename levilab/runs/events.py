"""The kinds of events of a run: one row each."""

from enum import StrEnum


class RunEvent(StrEnum):
    """What happened, as `kind` in events.jsonl."""

    # the run
    WARNING = "warning"  # to know before the readings are used; stands among the warnings of results
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    RESUMED = "resumed"
    LONGEST = "longest"  # the time of the run is over
    CUT_SHORT = "cut short"
    ASKED_THE_PERSON = "asked the person"
    ANSWERED = "answered"
    # an instrument
    INSTRUMENT_LOST = "instrument lost"
    NOT_REACHED = "not reached"
    FOUND_AGAIN = "found again"
    # a reading
    ASKED_AGAIN = "asked again"
    NOT_TAKEN = "not taken"
    MISCOUNTED = "miscounted"
    LEFT_OUT = "left out"
    COUNTED = "counted"
    GAPS = "gaps"  # samples of it are missing
    NO_RECORD = "no record"
    LOOK_AT_THE_SCALE = "look at the scale"
    SCANNED = "scanned"
    ANOTHER_HEIGHT = "another height"
    HEIGHT_READ_AGAIN = "height read again"
    NOT_UNDERSTOOD = "not understood"
    # the drive
    DRIVE_ON = "drive on"
    DRIVE_OFF = "drive off"
    DRIVEN_BEFORE = "driven before"  # the top, before the run began
    LOCKED = "locked"
    NOT_HELD = "not held"
    LOCK_LOST = "lock lost"
    HELD = "held"
    PHASE_FOUND = "phase found"  # at which a cycle speeds a top up that triggers it
    GAIN = "gain measured"  # of the spin at the full amplitude
    CALMED = "calmed"
    # the top
    FELL = "fell"
    TOP_LOST = "top lost"  # it fell under the drive
    LEVELS_OFF = "levels off"  # it gets no faster under the drive
    DOES_NOT_FALL = "does not fall"
    COASTS = "coasts"
    ONCE_MORE = "once more"
    ENDED = "ended"
