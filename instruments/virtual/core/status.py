"""The status registers of IEEE 488.2, chapter 11: the state of an instrument in bits."""

from dataclasses import dataclass

#: Bits of the standard event status register (11.5.1.1).
OPERATION_COMPLETE, QUERY_ERROR, DEVICE_ERROR, EXECUTION_ERROR, COMMAND_ERROR, POWER_ON = 1, 4, 8, 16, 32, 128
#: Bits of the status byte (11.2.1; bit 2 is SCPI's: the error queue is not empty).
ERRORS_WAITING, MESSAGE_AVAILABLE, EVENT_SUMMARY, SERVICE_REQUEST = 4, 16, 32, 64

#: Which bit an entry of the error queue sets, by the hundreds of its number (SCPI-1999, volume 2, 21.8).
_BITS = {1: COMMAND_ERROR, 2: EXECUTION_ERROR, 3: DEVICE_ERROR, 4: QUERY_ERROR}


@dataclass
class Status:
    """The status registers.

    Attributes:
        events: the standard event status register.
        event_enable: the mask of events that set the event summary bit of the status byte.
        request_enable: the mask of bits of the status byte that request service.
    """

    events: int = POWER_ON
    event_enable: int = 0
    request_enable: int = 0

    def note_error(self, number: int) -> None:
        """Set the event bit of an error, by its number."""
        self.events |= _BITS.get(abs(number) // 100, DEVICE_ERROR)

    def take_events(self) -> int:
        """Return the events, as ``*ESR?`` answers them; the register is empty afterwards."""
        events, self.events = self.events, 0
        return events

    def byte(self, *, errors_waiting: bool, message_available: bool) -> int:
        """Return the status byte, as ``*STB?`` and a serial poll read it."""
        bits = ERRORS_WAITING * errors_waiting + MESSAGE_AVAILABLE * message_available
        bits += EVENT_SUMMARY * bool(self.events & self.event_enable)
        return bits + SERVICE_REQUEST * bool(bits & self.request_enable)
