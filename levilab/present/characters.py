"""Text for streams that cannot carry ν, ⁻³ or χ²: an old code page of Windows, or plain ASCII.

Nothing is lost by it: 3.262(23)×10⁻³ s⁻¹ becomes 3.262(23)e-3 s^-1.
"""

import codecs
import re
import unicodedata

#: What stands for a character where its decomposition does not say enough.
_SPELLED = {
    "×": "x", "−": "-", "–": "-", "—": "-", "‐": "-", "→": "->", "…": "...", "≥": ">=", "≤": "<=", "≈": "~",
    "√": "sqrt", "±": "+/-", "·": "*", "⸝": "/", "°": "deg", "Ω": "Ohm", "µ": "u", "μ": "u", "½": "1/2", "⁄": "/",
    "’": "'", "‘": "'", "“": '"', "”": '"', "─": "-", "━": "-", "│": "|", "□": "?", "ß": "ss",
}  # fmt: skip
_RAISED = dict(zip("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹ⁿ", "+-0123456789n", strict=True))
_POWER_OF_TEN = re.compile(f"(?<=[0-9)])×10([{''.join(_RAISED)}]+)")
_EXPONENT = re.compile(f"[{''.join(_RAISED)}]+")


#: What steers a terminal (ISO 6429: all of C0 but the line feed, DEL, C1), ends a line, or turns the direction of
#: writing (Unicode Standard Annex 9).
_STEERING = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    r"""Return a text of unknown origin as it is printed: nothing in it steers the terminal; line feeds stay.

    >>> print(printable("a file's name \x1b[31min red\x1b]0;and a title\x07"))
    a file's name �[31min red�]0;and a title�
    """
    return _STEERING.sub("\N{REPLACEMENT CHARACTER}", text)


def for_encoding(text: str, encoding: str | None) -> str:
    """Return the text itself where the encoding has all its characters, else the nearest that it has.

    >>> for_encoding("C₃/₂ = 2.339(26)×10⁻⁴ (rad/s)^−½/s", "ascii")
    'C3/2 = 2.339(26)e-4 (rad/s)^-1/2/s'
    >>> for_encoding("χ²/dof, 3×10⁻⁵ rad⁻¹ at 1 µs", "cp1252")
    'chi2/dof, 3e-5 rad^-1 at 1 µs'
    >>> for_encoding("χ²/dof", "utf-8")
    'χ²/dof'
    """
    if not encoding or _carries(encoding, text):
        return text
    plain = _POWER_OF_TEN.sub(lambda found: "e" + _lower(found[1]), text).replace("χ²", "chi2")
    plain = _EXPONENT.sub(lambda found: found[0] if _carries(encoding, found[0]) else "^" + _lower(found[0]), plain)
    return "".join(one if _carries(encoding, one) else _spell(one) for one in plain)


def never_fail_to_encode(error: UnicodeError) -> tuple[str, int]:
    """Spell what reaches a stream that cannot carry it as `for_encoding` does (for `codecs.register_error`)."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    end = error.end
    while end < len(error.object) and error.object[end] in _RAISED:  # the ³ of ⁻³ may be one that it can carry
        end += 1
    return for_encoding(error.object[error.start : end], "ascii"), end


#: The name under which streams know it: `stream.reconfigure(errors=SPELLED_OUT)`.
SPELLED_OUT = "levilab.spelled-out"
codecs.register_error(SPELLED_OUT, never_fail_to_encode)


def _carries(encoding: str, text: str) -> bool:
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True


def _lower(raised: str) -> str:
    return "".join(_RAISED[one] for one in raised).removeprefix("+")


def _spell(one: str) -> str:
    """Return one character in ASCII; a question mark where there is no way."""
    if one in _SPELLED:
        return _SPELLED[one]
    if unicodedata.combining(one):
        return ""
    parts = unicodedata.normalize("NFKD", one)
    plain = "".join(_SPELLED.get(part, part) for part in parts if not unicodedata.combining(part))
    if plain.isascii() and plain:
        return plain
    words = unicodedata.name(one, "").split()  # GREEK SMALL LETTER CHI
    if words[:1] == ["GREEK"] and words[2:3] == ["LETTER"]:
        return words[3].capitalize() if words[1] == "CAPITAL" else words[3].lower()
    return "?"
