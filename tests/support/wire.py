"""A bare cable to a virtual instrument: bytes in, answers out; one for each instrument."""

from weakref import WeakKeyDictionary

from instruments.virtual.bench.session import Session

_cables = WeakKeyDictionary()


def cable(device):
    """The one session that a test has with a device, a stream of bytes."""
    return _cables.setdefault(device, Session(device, stream=True))


def send(device, data):
    """These bytes, whole messages or not."""
    cable(device).write(data)


def received(device, timeout=1.0):
    """The next answer with its line end; None if there was none within the time-out [s]."""
    got = cable(device).read(1 << 30, timeout)
    return got if got is None else got[0]


def ask(device, message, timeout=10.0):
    """What comes back, without its line end; None if nothing does."""
    send(device, message.encode("latin-1") + b"\n")
    answer = received(device, timeout)
    return answer if answer is None else answer.decode("latin-1").removesuffix("\n").removesuffix("\r")


def errors(device):
    """The numbers in the error queue, oldest first."""
    none = device.no_error
    return [int(entry.split(",")[0]) for entry in iter(lambda: ask(device, "SYST:ERR?"), none)]


def numbers(answer):
    """The numbers of an answer, between commas."""
    return [float(word) for word in answer.split(",")]
