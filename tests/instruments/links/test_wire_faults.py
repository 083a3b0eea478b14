"""Random faults on the wire, over every way and with all drivers: the right value or a clear error.

A wrong value is allowed where nothing on the link can show that it is one: `excuse` says where, and docs/bench.md.
"""

import collections
import re
import zlib

import pytest
from hypothesis import HealthCheck, Phase, example, given, seed, settings
from hypothesis import strategies as st

from support.wire_faults import ANSWERS, MESSAGES, Fault
from support.wire_pairs import KINDS, SEVEN_BITS, STREAMS, WAYS, Pair, attempt, levilab_protocol

EXPLORING = settings.get_current_profile_name() == "explore"
#: Faults for each driver in the suite, on each way.
FEW_FAULTS = 12

#: Way, model, and what became of a fault → how often.  `pytest -s` prints it.
tally = collections.Counter()


# --- what a link cannot show ---

#: A digit may be another digit, and a sign the other one.
_REST = str.maketrans("012345678+-", "999999999±±")
_EXPONENT = re.compile(r"[Ee][+-]\d+")
#: "1000HZ", "-1.5V", "1e-06HZ": as few digits as the number needs.
_SIGLENT = r"-?(0|[1-9]\d{0,11})(\.\d{0,14}[1-9])?(e[+-]\d{2})?(?P<unit>HZ|V)?"
#: Numbers whose length is not known, by model: as many digits as the resolution gives (CNT-91, handbook 8-36), NR3 and
#: NR1 of any length (InfiniiVision), codes with and without a leading zero (Lake Shore), numbers of Siglent.
_OF_ANY_LENGTH = {
    "CNT-91": r"[+-]\d\.\d{1,15}E[+-]\d{2}",
    "DSOX1000": r"[+-]\d{1,3}(\.\d{1,12})?E[+-]\d{2,3}|[+-]?\d+",
    "425": r"\d{1,2}",
    "475": r"\d{1,2}",
    "SDG1000X": _SIGLENT,
    "SDS1000X-E": r"0|[1-9]\d{0,4}",
    "TDS2000": r"-?\d\.\d{1,9}E-?\d{1,2}|[+-]?\d+",
}
#: Those that print a sign where the number is negative, and no other.
_MINUS_ALONE = {"DS1000Z", "DG1000Z"}
#: What instruments pass over before and behind a message (IEEE 488.2-1992, 7.4.1.2).
WHITE_SPACE = "".join(map(chr, range(33)))
_STATES = {"RUN", "WAIT", "TD", "AUTO", "STOP"}


def form(name, text):
    """How an instrument prints numbers: ±9.99E±99 for -1.25E+03, N for one that may have any length."""
    if name in _OF_ANY_LENGTH:
        any_length = re.compile(_OF_ANY_LENGTH[name])

        def shortened(field):
            found = any_length.fullmatch(field[0])
            return "N" + (found.groupdict().get("unit") or "") if found else field[0]

        text = re.sub(r"[^,; ]+", shortened, text)
    if name in _MINUS_ALONE:
        text = re.sub(r"(?<![\w.])-", "", text)
    return text.translate(_REST)


def has_the_form(name, question, honest, taken):
    """Whether an instrument could have answered this to the question, as far as its form goes."""
    question, honest, taken = (part.decode("latin-1").strip() for part in (question, honest, taken))
    if taken == honest:
        return True
    if not taken:  # of a CNT-91 this is "no reading"
        return name == "CNT-91" and question == "READ?"
    if question == "*IDN?":
        fields, wanted = taken.split(","), honest.split(",")
        known = re.fullmatch(KINDS[name].driver.MODELS, fields[1].strip()) if len(fields) == len(wanted) else None
        return known is not None and taken.isprintable()
    if question == "SYST:ERR?":
        return re.fullmatch(r'[+-]?\d+,".*"', taken) is not None
    if question == ":TRIG:STAT?":
        return taken in _STATES
    return has_the_form_of_values(name, question, honest, taken)


def has_the_form_of_values(name, question, honest, taken):
    """The same for settings and numbers."""
    if question == ":WAV:PRE?" and len({len(exponent) for exponent in _EXPONENT.findall(taken)}) > 1:
        return False
    asked = [(row, part) for row, part in rows(KINDS[name]) if part.header_in_use(row.header) + "?" == question]
    if not asked:
        return form(name, taken) == form(name, honest)
    return any(field_has_the_form(name, row, part, honest, taken) for row, part in asked)


def field_has_the_form(name, row, part, honest, taken):
    """The same for what an answer says of one setting."""
    try:
        honest, taken = (part.field_of(answer, row.header, row.key) for answer in (honest, taken))
    except ValueError:  # it has not the header of an answer to this question, or not its fields
        return False
    if honest == taken:
        return False
    if row.kind is bool:
        return taken in {"0", "1"}
    if row.choices and not honest.isdigit():
        return taken.upper() in spellings((*row.choices, *row.answers))
    return form(name, taken) == form(name, honest)


def spellings(choices):
    """Words in their long and short forms."""
    return {word for choice in choices for word in (choice.upper(), re.sub("[a-z]", "", choice))}


def rows(kind):
    """The settings that a driver declares, those of a scope's input included, each with the part that has it."""
    driver = kind.driver(None)
    parts = [driver, *([driver.CHANNEL(driver, 1)] if hasattr(driver, "CHANNEL") else ())]
    return [(row, part) for part in parts for row in part.declared_settings()]


def excuse(pair):
    """Why nothing on the link could show what the fault has done; None if something could."""
    for struck in pair.wire.struck:
        if struck.what in MESSAGES:
            if reason := excuse_of_a_message(pair, struck):
                return reason
        elif struck.what == "late":
            pass  # the program has waited too long: what comes then is dropped
        elif head := re.match(rb"[^#\n]{0,16}#\d", struck.honest):
            if len(struck.arrived) == len(struck.honest) and struck.arrived[: head.end()] == head[0]:
                return "bytes of a block become others, and a block has no check"
        elif (taken := taken_of(pair, struck)) != struck.honest.strip() and has_the_form(
            pair.name, struck.question, struck.honest, taken
        ):
            return f"{struck.what}: it has the form of an answer to the question"
    return None


def taken_of(pair, struck):
    """What a link takes for the answer: the first line."""
    arrived = bytes(byte & 0x7F for byte in struck.arrived) if pair.way in SEVEN_BITS else struck.arrived
    return arrived.partition(b"\n")[0].strip()


def excuse_of_a_message(pair, struck):
    """The same for a message to the instrument."""
    heard = [(message, answer.rstrip(b"\n"), complained) for message, answer, complained in list(pair.wire.heard)]
    if struck.what == "message doubled":
        if pair.way in STREAMS and passes_for_the_next(pair.name, struck.question, heard):
            return "a question is heard twice on a stream: its second answer has the form of the next one"
        return None
    if not struck.arrived and b"?" not in struck.question:
        return "a command is lost: it would have had no answer"
    arrived = struck.arrived.decode("latin-1").strip(WHITE_SPACE)
    # on a stream what is left of a message that was cut stands before the next one: ":" does no harm there
    cut = struck.what == "message cut" and pair.way in STREAMS
    understood = any(
        (message.startswith(arrived) if cut else message.strip(WHITE_SPACE) == arrived) and not complained
        for message, _, complained in heard
    )
    return "a message becomes another one that the instrument understands" if understood else None


def passes_for_the_next(name, question, heard):
    """Whether an answer to a question has the form of one to a question that followed."""
    asked = question.decode("latin-1").strip("\n")
    twice = [n for n, (message, answer, _) in enumerate(heard) if message == asked and answer]
    return any(
        has_the_form(name, message.encode("latin-1"), answer, heard[n][1])
        for n in twice
        for message, answer, _ in heard[n + 2 :]
        if answer
    )


@pytest.mark.parametrize(
    ("name", "question", "honest", "taken"),
    [
        ("53230A", b"SENS:FREQ:GATE:TIME?", b"+5.00000000000000E-001", b"15.00000000000000E-001"),
        ("475", b"RDGFIELD?", b"+0.0190E-00", b"+0.019+E-00"),
        ("DS1000Z", b":TIM:SCAL?", b"1.000000e-03", b"1.000000e-+3"),
        ("DSOX1000", b":WAV:PRE?", b"+0,+0,+9,+1,+1.0E-006,-5.0E-002", b"+0,+0,+9,+1,+1.0E-00,-5.0E-002"),
    ],
)
def test_a_digit_that_becomes_a_sign_or_is_lost_has_no_excuse(name, question, honest, taken):
    assert has_the_form(name, question, honest, honest)
    assert not has_the_form(name, question, honest, taken)


# --- faults ---

DIGITS = st.integers(0, 9999).map(lambda number: str(number).encode())
PIECES = st.sampled_from(
    [b"\n", b"\r\n", b"1\n", b"0\n", b'+0,"No error"\n', b"+1.000000000000000E+00\n", b",", b";", b"#"]
)
JUNK = st.one_of(st.binary(min_size=1, max_size=6), st.binary(min_size=1, max_size=1), DIGITS, PIECES)


#: Answers that have broken programs before, without their line ends.
LINES = (
    *b"0 1 -1 nan inf -inf 1e999 9.91E37 1_0 STOP TD WAIT OL 040 049 128 255 1,2 1,2,3 1,1,1 , ,,, ,,,,,,,,,".split(),
    *b"0,0,1e999,1,1,0,0,1,0,0 0,0,nan,1,1,0,0,1,0,0 0,0,1e18,1,1,0,0,1,0,0 0,0,3.5,1,1,0,0,1,0,0".split(),
    *b"0,0,1000,1,nan,0,0,nan,0,0 0,0,10,1,1e-3,0,0,inf,0,0 a,DS1054Z,b,c DS1054Z MODEL425 MODEL475".split(),
    *(b'+0,"No error"', b'-113,"Undefined header"', b"DSO-X 1102G", b"NO PROBE", b"", b"\r", b"\n" * 30, b"1\n" * 100),
    *(b"+" + b"9" * 5000, b"9" * 5000 + b",x", b"9" * 400, b"\xb2", b"\0" * 50, b"#0", b"#10", b"#9999999999"),
    *(b"#15abc", b"#13abc", b"#13abcdef", b"#800000003abc", b"#3\xb2\xb2\xb2", b"1;2", b"#11\n"),
)
#: What comes in the place of an answer: one of these, bytes, numbers, or a block of any length.
LIES = st.one_of(
    st.sampled_from(LINES).map(lambda line: line + b"\n"),
    st.sampled_from(LINES),
    st.binary(max_size=40),
    st.lists(st.one_of(st.integers(), st.floats()).map(str), min_size=1, max_size=11).map(
        lambda numbers: ",".join(numbers).encode() + b"\n"
    ),
    st.tuples(st.integers(0, 2000), st.binary(max_size=30)).map(
        lambda drawn: b"#%d%d%b\n" % (len(str(drawn[0])), *drawn)
    ),
)


def faults():
    """One fault, wherever it may strike: `at` is a share of the exchanges in an operation."""
    share = st.floats(0, 1, exclude_max=True)
    spoilt = st.tuples(st.sampled_from([*ANSWERS, *ANSWERS, *MESSAGES]), share, share, JUNK, st.booleans())
    return st.one_of(spoilt, st.tuples(st.just("another answer"), share, share, LIES, st.booleans()))


def two_operations(way):
    """A model, an operation that a fault may strike, and the one that follows it."""
    return st.sampled_from(WAYS[way]).flatmap(
        lambda name: st.tuples(st.just(name), *[st.sampled_from(sorted(KINDS[name].operations))] * 2)
    )


def alike(way):
    """Two questions whose answers have the same form, where the way has such."""
    if "53230A" in WAYS[way]:
        return "53230A", "setting gate", "setting measurement_timeout"
    return "475", "setting unit", "setting mode"


class Pairs:
    """The pairs of one way, each made when it is first needed, and what goes on in their operations without faults."""

    def __init__(self, way):
        self.way = way
        self._pairs = {}
        self._exchanges = {}

    def pair(self, name):
        if name not in self._pairs:
            self._pairs[name] = Pair(self.way, name)
        return self._pairs[name]

    def exchanges(self, name, wanted):
        """Answers and messages of an operation without faults."""
        if (name, wanted) not in self._exchanges:
            pair, operation = self.pair(name), KINDS[name].operations[wanted]
            pair.wire.arm(None)
            value, error = attempt(pair, operation)
            assert error is None
            assert operation.right(pair, value)
            self._exchanges[name, wanted] = pair.wire.answers, pair.wire.messages
            pair.recover(anew=operation.remakes, reset=False)
        return self._exchanges[name, wanted]

    def discard(self, name):
        self._pairs.pop(name).close()

    def close(self):
        for name in list(self._pairs):
            self.discard(name)


@pytest.fixture(scope="module", autouse=True)
def clients():
    with levilab_protocol():
        yield
    for row, count in sorted(tally.items()):
        print(*row, count, sep="\t")  # noqa: T201 - what `pytest -s` is for


def judged(pair, operation):
    """What became of one attempt: right, an error, or why it may be wrong.  Fails for a wrong value."""
    value, error = attempt(pair, operation)
    if error:
        return "error"
    if operation.right(pair, value):
        return "right"
    reason = excuse(pair)
    assert reason, ("a wrong value", value, pair.wire.fault, pair.wire.struck)
    return reason


def strike(pairs, name, wanted, following, drawn):
    """One fault in an operation; then another one, and the first once more when the program has recovered."""
    what, share, place, junk, marked = drawn
    operation, another = KINDS[name].operations[wanted], KINDS[name].operations[following]
    answers, messages = pairs.exchanges(name, wanted)
    fault = Fault(what, int(share * (messages if what in MESSAGES else answers)), place, junk, marked)
    pair = pairs.pair(name)
    pair.wire.arm(fault)
    became = judged(pair, operation)
    struck = bool(pair.wire.struck)
    if not fault.toward:  # what follows has no excuse but in what arrives then
        pair.wire.struck.clear()
    again = judged(pair, another)
    remakes = operation.remakes or another.remakes
    pair.recover(anew=remakes, reset=fault.toward)
    value, error = attempt(pair, operation)
    assert error is None, ("not recovered", fault, became, again, error)
    assert operation.right(pair, value), ("not recovered", fault, became, again, value)
    if remakes:
        pair.recover(anew=True, reset=False)
    return (became if struck else "not struck"), again


@pytest.mark.parametrize("way", WAYS)
def test_a_fault_on_the_wire_gives_the_right_value_or_an_error(way):
    pairs = Pairs(way)

    @settings(
        max_examples=(150 if EXPLORING else FEW_FAULTS) * len(WAYS[way]),
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=[phase for phase in Phase if phase is not Phase.explain],
    )
    @given(two_operations(way), faults())
    @example(alike(way), ("late", 0.0, 0.0, b"1", True))
    @example(alike(way), ("cut", 0.0, 0.0, b"1", True))
    @example(alike(way), ("cut", 0.0, 0.9, b"1", True))
    @example(alike(way), ("cut", 0.0, 0.9, b"1", False))
    @example(alike(way), ("gap", 0.0, 0.5, b"1", True))
    @example(alike(way), ("gap", 0.0, 0.99, b"1", True))
    def any_fault(operations, drawn):
        name, wanted, following = operations
        try:
            became, again = strike(pairs, name, wanted, following, drawn)
        except BaseException:
            pairs.discard(name)
            raise
        tally[way, name, became] += 1
        if again not in {"right", "error"}:
            tally[way, name, "again: " + again] += 1

    # the same faults each time, but others on each way
    run = any_fault if EXPLORING else seed(zlib.crc32(way.encode()))(any_fault)
    try:
        run()
    finally:
        pairs.close()


@pytest.mark.parametrize(
    ("name", "wanted", "line"),
    [
        ("53230A", "prepare", b"9" * 5000 + b",x"),  # longer than Python makes a whole number of
        ("425", "probe", b"9" * 5000),
        ("DS1000Z", "settings", b""),
        ("DS1000Z", "blocks", b"0,0,1e999,1,1,0,0,1,0,0"),
        ("DSOX1000", "trace", b"0,0,1e18,1,1,0,0,1,0,0"),  # more than there is memory for
        ("DSOX1000", "trace", b"0,0,1000,1,nan,0,0,nan,0,0"),
        ("33500B", "setting frequency", b"+9.91E+37"),  # "not a number" is no setting
        ("33500B", "setting amplitude", b"nan"),
        ("33500B", "identity", b"\x7f~#!Agilent Technologies,33522B,1,1"),
        ("DS1000Z", "identity", b"DS1054Z"),
    ],
)
def test_an_answer_that_has_broken_a_driver_ends_in_an_error(name, wanted, line):
    pairs = Pairs("messages")
    answers, _ = pairs.exchanges(name, wanted)
    pair = pairs.pair(name)
    for at in range(answers):
        pair.wire.arm(Fault("another answer", at=at, junk=line + b"\n"))
        _, error = attempt(pair, KINDS[name].operations[wanted])
        assert error is not None, pair.wire.struck
        pair.recover(anew=True, reset=False)
    pairs.close()
