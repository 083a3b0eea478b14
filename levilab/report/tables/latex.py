r"""A table as LaTeX, for an article that loads booktabs and graphicx.

All of it is ASCII, so that it compiles with every engine and every input encoding.  What a person typed is escaped;
a character that LaTeX's own fonts lack is spelled as `levilab.present.characters` spells it.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from levilab.present.characters import for_encoding, printable
from levilab.present.document.typesetting import typeset
from levilab.present.tables import Table
from levilab.present.units import is_unit

#: ASCII characters with a meaning of their own in LaTeX, or in a table, or that join with a neighbour.
_ASCII = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": "$<$", ">": "$>$", "|": "$|$", '"': "{''}",
    "`": "{`}", "'": "{'}", "-": "{-}", "[": "{[}", "]": "{]}", "*": "{*}",
}  # fmt: skip
_GREEK_NAMES = {
    "α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta", "ε": "varepsilon", "ζ": "zeta", "η": "eta", "θ": "theta",
    "ϑ": "vartheta", "ι": "iota", "κ": "kappa", "λ": "lambda", "μ": "mu", "µ": "mu", "ν": "nu", "ξ": "xi", "π": "pi",
    "ρ": "rho", "σ": "sigma", "τ": "tau", "υ": "upsilon", "φ": "varphi", "χ": "chi", "ψ": "psi", "ω": "omega",
    "Γ": "Gamma", "Δ": "Delta", "Θ": "Theta", "Λ": "Lambda", "Ξ": "Xi", "Π": "Pi", "Σ": "Sigma", "Φ": "Phi",
    "Ψ": "Psi", "Ω": "Omega",
}  # fmt: skip
#: Characters that have a command in math, and others.
_OTHERS = {
    **{letter: f"$\\{name}$" for letter, name in _GREEK_NAMES.items()},
    "×": r"$\times$", "−": "$-$", "±": r"$\pm$", "·": r"$\cdot$", "°": r"$^\circ$", "≥": r"$\geq$", "≤": r"$\leq$",
    "≈": r"$\approx$", "→": r"$\to$", "√": r"$\surd$", "½": r"$\frac{1}{2}$", "∞": r"$\infty$", "–": "--", "—": "---",
    "…": r"\ldots{}", "’": "'", "‘": "`", "“": "``", "”": "''", "\N{NO-BREAK SPACE}": "~",
}  # fmt: skip
#: φ with a dot, of two characters.
_PHI_DOT = "φ\N{COMBINING DOT ABOVE}"
#: A number, and what stands behind it.
_WITH_UNIT = re.compile(r"(?:< )?[−+-]?\d[\d.]*(?:\([\d.]+\))?(?:×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)? (?P<behind>.+)")
#: A column of texts longer than this is a paragraph [characters] of so much of the line.
_LONG, _PARAGRAPH = 48, 0.4
#: The width of a table: its own, or that of the line, to which LaTeX scales a wider one.
_WIDTH = r"\ifdim\width>\linewidth\linewidth\else\width\fi"
_LEVELS = {"high": r"\textsuperscript{%s}", "low": r"\textsubscript{%s}", "": "%s"}


def as_latex(name: str, table: Table, *, note: str = "", mark: str = "") -> str:
    """Return a table as a float with caption and label, scaled to the line where it is wider.

    Args:
        name: of the file; the label is ``tab:NAME``.
        table: as the report shows it.
        note: small print below it.
        mark: before the caption, such as "SYNTHETIC.".
    """
    title = table.title or title_of(name)
    marks = [mark] if mark and mark.rstrip(".") not in title else []  # which may say it itself
    caption = to_latex(" ".join([*marks, title]))
    table = units_in_heads(table)
    aligned = ["r" if k in table.numbers else "p" if _is_long(table, k) else "l" for k in range(len(table.heads))]
    lines = [
        "% levilab report --tables; in the preamble: \\usepackage{booktabs,graphicx}",
        r"\begin{table}[htbp]",
        r"  \centering",
        rf"  \caption{{{caption}}}",
        rf"  \label{{tab:{name}}}",
        *_tabular(table, aligned),
        *([rf"  \par\smallskip{{\footnotesize {to_latex(note)}\par}}"] if note else []),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def units_in_heads(table: Table) -> Table:
    r"""Return the table with the unit that all numbers of a column have in its head, once.

    >>> from levilab.present.tables import table
    >>> found = units_in_heads(table("", ["u"], [["0.96 mT"], ["1.2(3)×10⁻³ mT"], ["—"]], numbers=["u"]))
    >>> found.heads, [row.cells for row in found.rows]
    (('u\n[mT]',), [('0.96',), ('1.2(3)×10⁻³',), ('—',)])
    >>> units_in_heads(table("", ["a", "b"], [["0.10 ± 0.07", "3 of 5"]], numbers=["a", "b"])).heads
    ('a', 'b')
    """
    columns = [[row.cells[k] for row in table.rows] for k in range(len(table.heads))]
    heads = list(table.heads)
    for k in sorted(table.numbers):
        units = {_unit(cell) for cell in columns[k] if _counts(cell)}
        if len(units) == 1 and heads[k] and (unit := units.pop()):
            heads[k] = f"{heads[k]}\n[{unit}]"
            columns[k] = [cell.removesuffix(f" {unit}") for cell in columns[k]]
    rows = (replace(row, cells=tuple(column[i] for column in columns)) for i, row in enumerate(table.rows))
    return replace(table, heads=tuple(heads), rows=tuple(rows))


def _unit(cell: str) -> str:
    """Return the unit of the number of a cell; empty where something else stands behind it, or nothing.

    >>> _unit("0.87(2) mT cm per mm"), _unit("1.2 Hz (u not known)"), _unit("1.5 s ago")
    ('mT cm per mm', '', '')
    """
    found = _WITH_UNIT.fullmatch(cell)
    return found["behind"] if found and is_unit(found["behind"]) else ""


def _counts(cell: str) -> bool:
    """Return whether a number stands in a cell."""
    return any(one.isdigit() for one in cell)


def _is_long(table: Table, k: int) -> bool:
    return max((len(line) for row in table.rows for line in row.cells[k].split("\n")), default=0) > _LONG


def title_of(name: str) -> str:
    """Return what a table without a title is called, by its name.

    >>> title_of("spindown-laws")
    'Spindown laws'
    """
    return name.replace("-", " ").capitalize()


#: What stands for a column in the head of a tabular.
_COLUMNS = {"r": "r", "l": "l", "p": f"p{{{_PARAGRAPH:g}\\linewidth}}"}


def _tabular(table: Table, aligned: Sequence[str]) -> list[str]:
    """Return the lines of a tabular, indented for the float."""
    lines = [rf"  \resizebox{{{_WIDTH}}}{{!}}{{\begin{{tabular}}{{{''.join(_COLUMNS[one] for one in aligned)}}}"]
    lines.append(r"    \toprule")
    if any(table.heads):
        lines += [rf"    {_row(table.heads, aligned, bold=True)} \\", r"    \midrule"]
    for k, row in enumerate(table.rows):
        if row.kind == "together" and k and table.rows[k - 1].kind != "together":
            lines.append(r"    \midrule")
        lines.append(rf"    {_row(row.cells, aligned)} \\")
    return [*lines, r"    \bottomrule", r"  \end{tabular}}"]


def _row(cells: Sequence[str], aligned: Sequence[str], *, bold: bool = False) -> str:
    return " & ".join(_cell(cell, one, bold=bold) for cell, one in zip(cells, aligned, strict=True))


def _cell(cell: str, aligned: str, *, bold: bool) -> str:
    r"""Return a cell, of several lines perhaps: the first stands in the line of the row, of a head the last.

    >>> _cell("c₁\n[s⁻¹]", "l", bold=False)
    '\\begin{tabular}[t]{@{}l@{}}c\\textsubscript{1}\\\\{[}s\\textsuperscript{$-$1}{]}\\end{tabular}'
    """
    lines = [to_latex(line) for line in cell.split("\n")]
    lines = [rf"\textbf{{{line}}}" if bold and line else line for line in lines]
    if len(lines) == 1:
        return lines[0]
    if aligned == "p":
        return r"\newline ".join(lines)
    stacked = r"\\".join(lines)
    return rf"\begin{{tabular}}[{'b' if bold else 't'}]{{@{{}}{aligned}@{{}}}}{stacked}\end{{tabular}}"


def to_latex(text: str) -> str:
    r"""Return a plain text as LaTeX, in ASCII.

    >>> to_latex("50 % of {x}_1 & \\input{a}")
    '50~\\% of \\{x\\}\\_1 \\& \\textbackslash{}input\\{a\\}'
    >>> to_latex("3.2(1)×10⁻³, ν_r, é and 中")
    '3.2(1)$\\times$10\\textsuperscript{$-$3}, $\\nu$\\textsubscript{r}, e and ?'
    """
    clean = " ".join(printable(text.replace("\t", " ")).split("\n"))
    return "".join(_LEVELS[run.level] % _letters(run.text) for run in typeset(clean))


def _letters(text: str) -> str:
    return r"$\dot\varphi$".join("".join(map(_letter, piece)) for piece in text.split(_PHI_DOT))


def _letter(one: str) -> str:
    return _OTHERS.get(one) or "".join(_ASCII.get(plain, plain) for plain in for_encoding(one, "ascii"))
