r"""A table as LaTeX, for an article that loads booktabs and nothing else.

All of it is ASCII, so that it compiles with every engine and every input encoding.  What a person typed is escaped;
a character that LaTeX's own fonts lack is spelled as `levilab.present.characters` spells it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.present.characters import for_encoding, printable
from levilab.present.document.typesetting import typeset
from levilab.report.tables.widths import PARAGRAPH, SMALL_SEPARATION, fit

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from levilab.present.tables import Table

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
_LEVELS = {"high": r"\textsuperscript{%s}", "low": r"\raisebox{-.4ex}{\scriptsize %s}", "": "%s"}


def as_latex(name: str, table: Table, *, note: str = "", mark: str = "") -> str:
    """A table as a float with caption and label; folded, in small letters and in parts where it is wider than a line.

    Args:
        name: of the file; the label is ``tab:NAME``.
        table: as the report shows it.
        note: small print below it.
        mark: before the caption, such as "SYNTHETIC.".
    """
    title = table.title or title_of(name)
    marks = [mark] if mark and mark.rstrip(".") not in title else []  # which may say it itself
    caption = escaped(" ".join([*marks, title]))
    fitted = fit(table)
    aligned = ["r" if k in table.numbers else "p" if k in fitted.paragraphs else "l" for k in range(len(table.heads))]
    parts = [_tabular(fitted.table, part, aligned) for part in fitted.parts]
    lines = [
        "% levilab report --tables; in the preamble: \\usepackage{booktabs}",
        r"\begin{table}[htbp]",
        r"  \centering",
        rf"  \caption{{{caption}}}",
        rf"  \label{{tab:{name}}}",
        *([rf"  \footnotesize\setlength{{\tabcolsep}}{{{SMALL_SEPARATION:g}pt}}"] if fitted.small else []),
        *parts[0],
        *(line for part in parts[1:] for line in (r"  \par\medskip", *part)),
        *([rf"  \par\smallskip{{\footnotesize {escaped(note)}\par}}"] if note else []),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def title_of(name: str) -> str:
    """What a table without a title is called, by its name.

    >>> title_of("spindown-laws")
    'Spindown laws'
    """
    return name.replace("-", " ").capitalize()


#: What stands for a column in the head of a tabular.
_COLUMNS = {"r": "r", "l": "l", "p": f"p{{{PARAGRAPH:g}\\linewidth}}"}


def _tabular(table: Table, columns: Sequence[int], aligned: Sequence[str]) -> Iterable[str]:
    """Some columns of a table, each line indented for the float."""
    yield rf"  \begin{{tabular}}{{{''.join(_COLUMNS[aligned[k]] for k in columns)}}}"
    yield r"    \toprule"
    if any(table.heads):
        yield rf"    {_row(table.heads, columns, aligned, bold=True)} \\"
        yield r"    \midrule"
    for k, row in enumerate(table.rows):
        if row.kind == "together" and k and table.rows[k - 1].kind != "together":
            yield r"    \midrule"
        yield rf"    {_row(row.cells, columns, aligned)} \\"
    yield r"    \bottomrule"
    yield r"  \end{tabular}"


def _row(cells: Sequence[str], columns: Sequence[int], aligned: Sequence[str], *, bold: bool = False) -> str:
    return " & ".join(_cell(cells[k], aligned[k], bold=bold) for k in columns)


def _cell(cell: str, aligned: str, *, bold: bool) -> str:
    r"""A cell, of several lines perhaps: the first stands in the line of the row, of a head the last.

    >>> _cell("c₁\n[s⁻¹]", "l", bold=False)
    '\\begin{tabular}[t]{@{}l@{}}c\\raisebox{-.4ex}{\\scriptsize 1}\\\\{[}s\\textsuperscript{$-$1}{]}\\end{tabular}'
    """
    lines = [escaped(line) for line in cell.split("\n")]
    lines = [rf"\textbf{{{line}}}" if bold and line else line for line in lines]
    if len(lines) == 1:
        return lines[0]
    if aligned == "p":
        return r"\newline ".join(lines)
    stacked = r"\\".join(lines)
    return rf"\begin{{tabular}}[{'b' if bold else 't'}]{{@{{}}{aligned}@{{}}}}{stacked}\end{{tabular}}"


def escaped(text: str) -> str:
    r"""A plain text as LaTeX, in ASCII.

    >>> escaped("50 % of {x}_1 & \\input{a}")
    '50 \\% of \\{x\\}\\_1 \\& \\textbackslash{}input\\{a\\}'
    >>> escaped("3.2(1)×10⁻³, ν_r, é and 中")
    '3.2(1)$\\times$10\\textsuperscript{$-$3}, $\\nu$\\raisebox{-.4ex}{\\scriptsize r}, e and ?'
    """
    clean = " ".join(printable(text.replace("\t", " ")).split("\n"))
    return "".join(_LEVELS[run.level] % _letters(run.text) for run in typeset(clean))


def _letters(text: str) -> str:
    return r"$\dot\varphi$".join("".join(map(_letter, piece)) for piece in text.split(_PHI_DOT))


def _letter(one: str) -> str:
    return _OTHERS.get(one) or "".join(_ASCII.get(plain, plain) for plain in for_encoding(one, "ascii"))
