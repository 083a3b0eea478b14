"""Tables in the dress of their writer: Markdown, Arduino's monitor and plotter, a person's notes, LabVIEW, CASSY.

Each is rewritten line by line, so that the n-th line stays the n-th, with tabs between the fields.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

from levilab.formats.dialect import MINUTES, SECONDS, Dialect, clock_time, find_dialect
from levilab.formats.titles import read_title

#: Lines that are looked at, and the part of them that has to be in a dress: a log may begin in the middle of a line.
_LINES, _MOST = 100, 0.8
#: No line in a dress is longer: the forms below look at each pair of its places.
_LONGEST = 300


@dataclass(frozen=True)
class Dressed:
    """A text without its dress.

    Attributes:
        titles: of the columns where each row had them.
    """

    content: bytes
    titles: tuple[str, ...] = ()


def undress(head: bytes, whole: Callable[[], bytes]) -> Dressed | None:
    """Return a text as plain lines; None where it is plain already.

    Args:
        head: its beginning.
        whole: reads all of it.
    """
    lines = head.decode("utf-8-sig", errors="replace").splitlines()[:-1][:_LINES]
    filled = [line for line in lines if line.strip()]
    if not filled or max(map(len, filled)) > _LONGEST:
        return None
    for rewrite, wears in _DRESSES:
        if wears(filled):
            return rewrite(_decode(whole()).splitlines())
    return None


def _decode(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _content(lines: Sequence[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()


def _mostly(form: re.Pattern[str]) -> Callable[[Sequence[str]], bool]:
    """Return whether nearly all of some lines have a form: all of two, of a few more all but one."""
    return lambda lines: sum(map(bool, map(form.match, lines))) >= max(min(_MOST * len(lines), len(lines) - 1), 2)


# --- Markdown ------------------------------------------------------------------------------------------

_RULE = re.compile(r"\s*\|?(\s*:?-+:?\s*\|)+(\s*:?-+:?\s*)?")
#: Marks of code, mathematics and emphasis around a title.
_MARKS = re.compile(r"[`$]|\*\*")


def _markdown(lines: Sequence[str]) -> Dressed:
    """| t | f |, with a line of dashes below."""
    rows = ["" if _RULE.fullmatch(line) else _MARKS.sub("", line).strip() for line in lines]
    cells = [[cell.strip() for cell in row.removeprefix("|").removesuffix("|").split("|")] for row in rows]
    return Dressed(_content(["\t".join(row) if "|" in text else "" for row, text in zip(cells, rows, strict=True)]))


# --- Arduino -------------------------------------------------------------------------------------------

_STAMP = re.compile(r"\s*(\d\d?:\d\d:\d\d(?:[.,]\d+)?)\s*->\s*(.*)")
_VALUE = r"[+-]?[\d.]+(?:[eE][+-]?\d+)?(?:\s?[^\d\s,;:=][^\s,;:=]*)?"
#: A label before its number, and how often more pairs follow: t:123 or t=123 any times, "time 123" at least once.
_COLON, _WORD = (r"([^\W\d][^:=;,\t]*?)\s*[:=]\s*", "*"), (r"([^\W\d]+)\s+", "+")


def _pairs(label: str, more: str) -> re.Pattern[str]:
    pair = f"{label}{_VALUE}".replace("(", "(?:", 1)
    return re.compile(rf"\s*(?:\d\d?:\d\d:\d\d(?:[.,]\d+)?\s*->\s*)?{pair}(?:[,;\t ]\s*{pair}){more}[,;\s]*$")


def _plotter(lines: Sequence[str], label: str, more: str) -> Dressed:
    """t:123, f:38.01 in each line: the labels become titles, and a unit stays behind its number."""
    pairs, each = _pairs(label, more), re.compile(rf"{label}({_VALUE})(?:[,;\t ]\s*|$)")
    rows, titles = [], dict[str, None]()
    for line in lines:
        stamp = _STAMP.fullmatch(line)
        values = dict(each.findall(stamp[2] if stamp else line)) if pairs.match(line) else {}
        values |= {"time": stamp[1]} if stamp and values and not {"t", "time"} & {v.casefold() for v in values} else {}
        titles |= dict.fromkeys(values)
        rows.append(values)
    text = ["\t".join(row.get(title, "") for title in titles) if row else "" for row in rows]
    return Dressed(_content(text), tuple(titles))


def _monitor(lines: Sequence[str]) -> Dressed:
    """10:00:10.123 -> 38.2: the clock is the first column."""
    found = [_STAMP.fullmatch(line) for line in lines]
    dialect = find_dialect([one[2] for one in found if one]) or Dialect(None, ".")
    rows = [[one[1], *dialect.split(one[2])] if one else [] for one in found]
    first = next(row for row in rows if row)
    if not re.search(r"\d", " ".join(first[1:])):  # titles that the sketch wrote
        own_time = any(read_title(title).column == "time_s" for title in first)
        first[0] = "clock"
        return Dressed(_content(["\t".join(row[own_time:]) for row in rows]))
    titles = ("clock", *(f"value {k}" for k in range(1, max(map(len, rows)))))
    return Dressed(_content(["\t".join(row) for row in rows]), titles)


# --- notes ---------------------------------------------------------------------------------------------

#: A time and a spin with their units, words or a dash before them, and no other number.
_NOTE = re.compile(
    r"\s*(?:[^\W\d]|[-*•]\s)\D*?"
    rf"((?:\d+\s?h\s?)?(?:\d+\s?{MINUTES}\s?)?\d+(?:[.,]\d+)?\s?(?:{SECONDS}|{MINUTES})\b)\.?"
    r"\D*?(\d+(?:[.,]\d+)?\s?(?:Hz|rpm|(?:U|1)/min))\W*$",
    re.IGNORECASE,
)


def _notes(lines: Sequence[str]) -> Dressed:
    """After 1 min 30 s: 34.2 Hz."""
    found = [_NOTE.match(line) for line in lines]
    return Dressed(
        _content([f"{clock_time(one[1].lower()):g}\t{one[2]}" if one else "" for one in found]), ("t [s]", "f")
    )


# --- CASSY --------------------------------------------------------------------------------------------

_DEFINITION = re.compile(r"(?:.*\t)?\s*DEF\s*=\s*")
_OTHER_KEYS = re.compile(r"\s*(MIN|MAX|SCALE|DEC)\s*=")


def _cassy(lines: Sequence[str]) -> Dressed:
    """MIN=, MAX=, SCALE= … above DEF="t/s" and the other titles, or a line of all these for each column."""
    defined = {k: line[found.end() :] for k, line in enumerate(lines) if (found := _DEFINITION.match(line))}
    titles = {max(defined): "\t".join(defined.values())}
    plain = ["" if k in defined or _OTHER_KEYS.match(line) else line for k, line in enumerate(lines)]
    return Dressed(_content([titles.get(k, line) for k, line in enumerate(plain)]))


# --- LabVIEW ------------------------------------------------------------------------------------------

_SETTINGS = re.compile(r"(?:Multi_Headings(?=\WYes\b)|X_Columns(?=\WNo\b))(\W)")
#: The first field of a row: its time, or nothing where X0 and Delta_X say it.
_TIME = re.compile(r"(?:[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)?")


def _labview(lines: Sequence[str]) -> Dressed:
    """Packets below a header each, whose units go into the titles; these stand again where times begin again."""
    mark = next(found[1] for line in lines if (found := _SETTINGS.match(line)))
    if any(line.startswith("Decimal_Separator\t,") for line in lines):
        lines = [line.replace(",", ".") for line in lines]
    plain, head = [""] * len(lines), dict[str, list[str]]()
    titles, place, grid, rows, last = "", 0, list[float](), 0, inf
    for k, line in enumerate(lines):
        key, *cells = line.split(mark)
        if key == "X_Value":
            units = iter(head.get("Y_Unit_Label", ()))
            named = [cell if cell in {"X_Value", "Comment"} else _with_unit(cell, next(units, "")) for cell in cells]
            titles, place, rows = mark.join((key, *named)), k, 0
            given = [text for name in ("X0", "Delta_X") for text in head.get(name, ())[:1]]
            grid = [float(text) for text in given if text and _TIME.fullmatch(text)]
        elif titles and any(cells) and _TIME.fullmatch(key) and (key or len(grid) == 2):
            time = float(key) if key else grid[0] + rows * grid[1]
            plain[place] = titles if rows == 0 and time <= last else plain[place]
            plain[k] = mark.join((key or f"{time:.12g}", *cells))
            rows, last = rows + 1, time
        else:
            head[key] = cells
    return Dressed(_content(plain))


def _with_unit(title: str, unit: str) -> str:
    return f"{title} [{unit}]" if unit and not read_title(title).unit else title


#: How a dress is taken off, and who wears it.
_DRESSES: Sequence[tuple[Callable[[Sequence[str]], Dressed], Callable[[Sequence[str]], bool]]] = (
    (_labview, lambda lines: any(map(_SETTINGS.match, lines))),
    (_cassy, lambda lines: any(_DEFINITION.match(line) for line in lines)),
    (_markdown, lambda lines: any(map(_RULE.fullmatch, lines))),
    (_notes, _mostly(_NOTE)),
    *((partial(_plotter, label=label, more=more), _mostly(_pairs(label, more))) for label, more in (_COLON, _WORD)),
    (_monitor, _mostly(_STAMP)),
)
