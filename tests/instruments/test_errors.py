"""The words of every error of the instruments, in messages.txt; elsewhere tests look at what an error carries."""

from pathlib import Path

from instruments import errors
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired

FILE = Path(__file__).with_name("messages.txt")
AT = "GPIB0::1"

#: The errors, each with an example of what it carries.
EXAMPLES = (
    errors.InstrumentError(AT, "anything"),
    errors.NotConnected(AT, "cannot be opened"),
    errors.Occupied(AT),
    errors.NoAnswer(AT, "READ?", 2.0),
    errors.SilentLine(AT, "UNIT?", 2.0),
    errors.BadAnswer(AT, "FREQ?", "x" * 1000, "a number, as +1.0E+00"),
    errors.CommandRefused(AT, "FREQ 31 MHZ", tuple(f"-{number}" for number in range(101, 110))),
    errors.SettingsLost(AT, {"gate_s": (1.0, 0.1), "coupling": ("DC", "AC")}),
    errors.WrongInstrument(AT, "maker,other,1,2", "53230A"),
    errors.OutOfRange(AT, "gate", 0.0, "0.0001 to 1000 s"),
    NeverTriggered(AT, level_v=1.3, source="CHAN1", waited_s=0.5),
    NothingAcquired(AT),
)


def test_every_error_has_its_words():
    """Copy the text of the failure into messages.txt where the words are meant to change."""
    assert [f"{type(error).__name__}: {error}" for error in EXAMPLES] == FILE.read_text("utf-8").splitlines()
    assert all(error.address == AT for error in EXAMPLES)


def test_every_class_of_errors_has_an_example():
    classes = {each for each in vars(errors).values() if isinstance(each, type) and each.__module__ == errors.__name__}
    assert classes <= {type(error) for error in EXAMPLES}
