"""The message exchange between a program and an instrument: its states, and every transition in one table.

Source: IEEE 488.2-1992, 6.3 and figure 6-4, with its states READ, QUERY and SEND in one, as a program cannot tell them
apart, and with DONE in IDLE.
"""

from enum import Enum, auto


class State(Enum):
    """What the instrument owes the program."""

    #: Nothing: the last answer was read to its end, or nothing was asked.
    IDLE = auto()
    #: It has a message, and no answer to it yet.
    ASKED = auto()
    #: Answers are under way or ready.
    ANSWERED = auto()
    #: The program has read a part of an answer.
    READING = auto()


class Event(Enum):
    """What changes the state."""

    #: The program has sent a whole message.
    MESSAGE = auto()
    #: The instrument has an answer.
    ANSWER = auto()
    #: More answers wait than there is memory for.
    OVERFLOW = auto()
    #: The program reads where no answer is under way.
    READ_NOTHING = auto()
    #: The program has read a part of an answer; the end of it, and others wait; the end of the last one.
    READ_PART = auto()
    READ_ONE = auto()
    READ_LAST = auto()
    #: The answers that waited are dropped: the measurement that they came from is given up, or the program discards.
    DROP = auto()
    #: Device clear.
    CLEAR = auto()


#: State and event → the new state, and the error that is queued (SCPI-1999, volume 2, 21.8.12), 0 for none; an event
#: that is missing changes nothing.
Table = dict[tuple[State, Event], tuple[State, int]]

#: A line feed ends a message, and answers follow each other: a serial line, a bare socket.
STREAM: Table = {
    (State.IDLE, Event.MESSAGE): (State.ASKED, 0),
    (State.IDLE, Event.ANSWER): (State.ANSWERED, 0),
    (State.ASKED, Event.ANSWER): (State.ANSWERED, 0),
    (State.ASKED, Event.CLEAR): (State.IDLE, 0),
    (State.ANSWERED, Event.OVERFLOW): (State.ASKED, -430),
    (State.ANSWERED, Event.READ_PART): (State.READING, 0),
    (State.ANSWERED, Event.READ_LAST): (State.IDLE, 0),
    (State.ANSWERED, Event.DROP): (State.ASKED, 0),
    (State.ANSWERED, Event.CLEAR): (State.IDLE, 0),
    (State.READING, Event.OVERFLOW): (State.ASKED, -430),
    (State.READING, Event.READ_ONE): (State.ANSWERED, 0),
    (State.READING, Event.READ_LAST): (State.IDLE, 0),
    (State.READING, Event.DROP): (State.IDLE, 0),
    (State.READING, Event.CLEAR): (State.IDLE, 0),
}
#: The interface marks the end of a message (GPIB, USBTMC, VXI-11, HiSLIP): a message sent before the last answer was
#: read discards that answer (6.3.2.3), and a program that reads must have asked (6.3.2.2).
MARKED: Table = STREAM | {
    (State.IDLE, Event.READ_NOTHING): (State.IDLE, -420),
    (State.ANSWERED, Event.MESSAGE): (State.ASKED, -410),
    (State.READING, Event.MESSAGE): (State.ASKED, -410),
}
