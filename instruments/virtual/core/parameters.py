"""The parameters of a command: numbers with units, words, booleans."""

import math
import re

from instruments.ieee488 import BrokenBlock, block, block_of
from instruments.virtual.core.parser import ScpiError

_MULTIPLIERS = {"": 1.0, "N": 1e-9, "U": 1e-6, "M": 1e-3, "K": 1e3, "MA": 1e6, "G": 1e9}
#: A mantissa and an exponent, then a unit.  No digit can match in two ways (with \d+\.?\d* it could), so the time for a
#: long line of digits that is no number grows with its length, not with its square.
_NUMBER = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+))([eE][+-]?\d{1,3})?\s*([a-zA-Z/]*)")
_CHANNEL_LIST = re.compile(r"\(@[\d,: !]*\)")
#: Digits of a mantissa, leading zeros not counted (IEEE 488.2, 7.7.2.4.1).
MOST_DIGITS = 255


def optional_parameter(parameters: list[str]) -> str:
    """Return the only parameter or "", a channel list aside.  Raises ScpiError if there are more."""
    plain = [parameter for parameter in parameters if not _CHANNEL_LIST.fullmatch(parameter)]
    if len(plain) > 1:
        raise ScpiError(-108)
    return plain[0] if plain else ""


def parameter(parameters: list[str]) -> str:
    """Return the only parameter, a channel list aside.  Raises ScpiError if there is none, or more than one."""
    only = optional_parameter(parameters)
    if not only:
        raise ScpiError(-109)
    return only


def read_quoted(parameters: list[str]) -> str:
    """Return the text of the only parameter, a string in quotes (IEEE 488.2, 7.7.5).

    Raises:
        ScpiError: it is no string, or something follows the string.

    >>> read_quoted(["'it''s'"])
    "it's"
    """
    given = parameter(parameters)
    quote = given[0]
    if len(given) < 2 or quote not in "\"'" or given[-1] != quote:
        raise ScpiError(-104, given[:20])
    text = given[1:-1].replace(quote * 2, "\0")
    if quote in text:
        raise ScpiError(-103, given[:20])
    return text.replace("\0", quote)


def no_parameters(parameters: list[str]) -> None:
    """Check that there are no parameters, a channel list aside.  Raises ScpiError."""
    if optional_parameter(parameters):
        raise ScpiError(-108)


def _limits(low: float, high: float, default: float) -> dict[str, float]:
    return {"MIN": low, "MINIMUM": low, "MAX": high, "MAXIMUM": high, "DEF": default, "DEFAULT": default}


def limit(text: str, *, low: float, high: float, default: float) -> float:
    """Return the limit or default that a query asks for by ``MIN``, ``MAX`` or ``DEF``.  Raises ScpiError.

    >>> limit("max", low=0, high=1e6, default=0)
    1000000.0
    """
    words = _limits(low, high, default)
    if text.upper() not in words:
        raise ScpiError(-224, text[:20])
    return words[text.upper()]


def number(text: str, *, low: float, high: float, default: float, unit: str = "") -> float:
    """Return a numeric parameter: ``25``, ``1 kHz``, ``MIN``, ``MAX``, ``DEF``, ``INF``.  Raises ScpiError.

    >>> number("1.5 kHz", low=0, high=1e6, default=0, unit="HZ")
    1500.0
    """
    words = _limits(low, high, default) | ({"INF": 9.9e37, "INFINITY": 9.9e37} if high >= 9.9e37 else {})
    if text.upper() in words:
        return words[text.upper()]
    match = _NUMBER.fullmatch(text)
    if not match:
        raise ScpiError(-104, text[:20])
    value = _value(match) * _multiplier(match[3].upper(), unit)
    if not low <= value <= high:
        raise ScpiError(-222)
    return value


def one_of(value: float, values: tuple[float, ...]) -> float:
    """Check that a number is one of these values; without values any number is allowed.  Raises ScpiError.

    >>> one_of(50.0, (50.0, 1e6))
    50.0
    """
    if values and value not in values:
        raise ScpiError(-224, f"{value:g}")
    return value


def block_text(data: bytes, digits: int = 0) -> str:
    """Return a definite-length block as text, a character for each byte; see `instruments.ieee488.block`."""
    return block(data, digits).decode("latin-1")


def block_content(text: str, error: int = -104) -> bytes:
    """Return the bytes of a block that is a parameter.  Raises ScpiError with the number `error` where it is no block.

    >>> block_content("#13abc")
    b'abc'
    """
    try:
        return block_of(text.encode("latin-1") + b"\n")
    except BrokenBlock:
        raise ScpiError(error) from None


def _value(match: re.Match[str]) -> float:
    """Return the number without its unit.  Raises ScpiError if it has too many digits."""
    mantissa, exponent = match[1], match[2] or ""
    if len(mantissa) > MOST_DIGITS and len(mantissa.lstrip("+-0.").replace(".", "")) > MOST_DIGITS:
        raise ScpiError(-124)
    return float(mantissa + exponent)


def _multiplier(suffix: str, unit: str) -> float:
    if not suffix:
        return 1.0
    prefix = suffix.removesuffix(unit)
    if not unit or not suffix.endswith(unit) or prefix not in _MULTIPLIERS:
        raise ScpiError(-131, suffix[:20])
    # SCPI 7.1: with Hz and ohm a leading M means mega, elsewhere milli
    return 1e6 if prefix == "M" and unit in {"HZ", "OHM"} else _MULTIPLIERS[prefix]


def choice(text: str, words: tuple[str, ...]) -> str:
    """Return the short form of one of the words, given in its short or long form.  Raises ScpiError.

    >>> choice("square", ("SINusoid", "SQUare"))
    'SQU'
    """
    for word in words:
        short = re.sub("[a-z]", "", word)
        if text.upper() in {short, word.upper()}:
            return short
    raise ScpiError(-224, text[:20])


def boolean(text: str, *, rounded: bool = False) -> bool:
    """Return the value of ON, OFF, 1 or 0, in any form of the number.  Raises ScpiError.

    Args:
        text: on the wire.
        rounded: whether any number is allowed, OFF where it rounds to 0.

    >>> boolean("on"), boolean("1.0"), boolean("0"), boolean("2", rounded=True)
    (True, True, False, True)
    """
    words = {"ON": True, "OFF": False}
    if text.upper() in words:
        return words[text.upper()]
    match = _NUMBER.fullmatch(text)
    value = math.inf if not match or match[3] else _value(match)
    if not math.isfinite(value) or (value not in {0.0, 1.0} and not rounded):
        raise ScpiError(-224, text[:20])
    return round(value) != 0


def nr3(value: float) -> str:
    """Return a number as these instruments print it: fifteen digits, and room for one more.

    >>> nr3(23.456789), nr3(9.9e37)  # a sixteenth digit would make 9.899999999999999 of it
    ('+2.345678900000000E+01', '+9.900000000000000E+37')
    """
    return f"{value:+.14E}".replace("E", "0E")
