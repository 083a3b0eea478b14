"""No message breaks a virtual gaussmeter."""

from hypothesis import given
from hypothesis import strategies as st

from support.gaussmeters import EACH, meter
from support.wire import ask, received, send

HEADERS = [
    "UNIT",
    "RANGE",
    "AUTO",
    "RDGMODE",
    "RDGFIELD",
    "OPST",
    "ALARM",
    "RELSP",
    "ZPROBE",
    "REL",
    "*IDN",
    "?",
    "DFLT",
]
MESSAGES = st.lists(
    # these instruments have no blocks, but the bench's one reader of messages knows them, and would wait for their end
    st.binary(max_size=40).filter(lambda message: b"#" not in message)
    | st.builds(
        lambda header, mark, rest: f"{header}{mark} {rest}".encode("latin-1", "replace"),
        st.sampled_from(HEADERS),
        st.sampled_from(["", "?"]),
        st.text(alphabet="0123456789+-.,;eE ", max_size=12),
    ),
    max_size=12,
)


@EACH
@given(messages=MESSAGES)
def test_no_message_hangs_it_or_breaks_it_or_makes_it_grow(kind, messages):
    device = meter(kind, probe="HSE")
    for message in messages:
        send(device, message + b"\n")
        while received(device, 0.2) is not None:
            pass
    send(device, b"\"\n'\n\n")
    while received(device, 10.0) is not None:
        pass
    assert ask(device, "*IDN?").startswith("LSCI,MODEL4")
    assert len(device.parser.errors) <= device.queue_size
