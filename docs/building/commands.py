"""What pages take from the program: the help of all commands, and tables of columns, laws, names and keys."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx


#: Page of the reference → the commands on it, in their order.
PAGES = {
    "reference/commands-acquire": ("acquire",),
    "reference/commands-bench": ("live", "bench", "tune", "top"),
    "reference/commands-analyze": ("analyze",),
    "reference/commands-data": ("open", "runs", "report", "export", "worksheet", "class"),
    "reference/commands-simulate": ("simulate", "stability", "sweep"),
    "reference/commands-check": ("crosscheck", "reproduce", "benchmark", "fuzz"),
}


def reference(page: str) -> str:
    """Return usage, explanation, options and example of every command of a page, in Markdown."""
    return "\n\n".join(text for name in PAGES[page] for text in _described(_app().commands[name], f"levilab {name}"))


def overview() -> str:
    """Return a table of all commands with links to their pages, in Markdown."""
    rows = []
    for page, names in PAGES.items():
        for name in names:
            command = _app().commands[name]
            about = _in_plain_text(getattr(command, "command", command).help or "").partition("\n")[0]
            rows.append(f"| [`levilab {name}`]({page.rpartition('/')[2]}.md#levilab-{name}) | {about} |\n")
    return "| command | what for |\n|---|---|\n" + "".join(rows)


def _app() -> Any:
    import typer.main

    from levilab.cli.main import app

    return typer.main.get_command(app)


def _described(command: Any, name: str, parent: Any = None, above: frozenset[str] = frozenset()) -> Iterator[str]:
    """Yield what stands in the help of a command and those below it; options that all of these have stand once."""
    command = getattr(command, "command", command)  # of a stand-in, see levilab.cli.later
    context = command.context_class(command, info_name=name.rpartition(" ")[2] if parent else name, parent=parent)
    yield f"{'#' * (1 + name.count(' '))} `{name}`"
    yield f"```text\n{' '.join(command.get_usage(context).removeprefix('Usage:').split())}\n```"
    yield _in_plain_text(command.help or "")
    below = {sub: command.commands[sub] for sub in sorted(getattr(command, "commands", {}))}
    yield "\n".join(row for row in _rows(command, context) if row not in above)
    common = [_rows(sub, context) for sub in below.values()]
    shared = frozenset.intersection(*map(frozenset, common)) if len(common) > 1 else frozenset[str]()
    if shared:
        yield "Options that all of them have:"
        yield "\n".join(row for row in common[0] if row in shared)
    if command.epilog:
        yield _example(command.epilog)
    for sub, one in below.items():
        yield from _described(one, f"{name} {sub}", context, shared)


def _rows(command: Any, context: Any) -> list[str]:
    """Return the options and arguments of a command, each a term and its definition."""
    command = getattr(command, "command", command)
    return [row for parameter in command.get_params(context) if (row := _row(parameter, context))]


def _row(parameter: Any, context: Any) -> str:
    """Return a term and its definition; empty for --help, which all commands have."""
    if parameter.name == "help" or getattr(parameter, "hidden", False):
        return ""
    record = parameter.get_help_record(context)
    if record is None:
        return ""
    term, text = record
    return f"`{' '.join(term.split())}`\n: {_in_plain_text(text) or 'see above'}\n"


def _example(epilog: str) -> str:
    """Return ``Example: levilab …`` as a block."""
    head, _, command = epilog.partition(": ")
    return f"{head}:\n\n```text\n{command}\n```" if command else _in_plain_text(epilog)


def _in_plain_text(text: str) -> str:
    """Help is plain text: nothing in it is markup but the backslash that keeps a bracket from rich."""
    text = text.replace(r"\[", "[")
    return re.sub(r"([\\*_<>`$\[\]])", r"\\\1", re.sub(r"[ \t]+", " ", text)).strip()


def columns() -> str:
    """Return the columns of every analysis in a table of many runs, in Markdown."""
    from levilab.pipelines.catalogue import ANALYSES

    return "\n".join(_columns_of(name, analysis.row) for name, analysis in ANALYSES.items())


def _columns_of(name: str, row: Any) -> str:
    heads = f"\n`{name}`:\n\n| column | content |\n|---|---|\n"
    # the column of a standard uncertainty stands behind that of its value
    own = [one for one in row if not one.meaning.startswith("its standard uncertainty")]
    return heads + "".join(f"| `{one.name}` | {one.meaning} |\n" for one in own)


def laws() -> str:
    """Return the drag laws with their constants, in Markdown."""
    from analysis.spindown.drag import LAWS

    return "| law | equation | constants |\n|---|---|---|\n" + "".join(
        f"| `{law.name}` | {_raised(law.equation)} | "
        + ", ".join(f"`{name}` [{unit}]" for name, unit in zip(law.constants, law.units, strict=True))
        + " |\n"
        for law in LAWS.values()
    )


def _raised(equation: str) -> str:
    return re.sub(r"\^\(([^()]*)\)", r"<sup>\1</sup>", equation)


def observables() -> str:
    """Return the columns of a sweep but for the lines of the axis, in Markdown."""
    from levilab.sweeps.quantities import GROUPS, OBSERVABLES

    rows = (f"| `{one}` | {row.meaning} |\n" for one, row in OBSERVABLES.items() if one not in GROUPS["lines"])
    return "| name | meaning |\n|---|---|\n" + "".join(rows)


def fit() -> str:
    """Return the class of a fit with an entry for each of its names, which are lmfit's, as a block."""
    from levilab.notebook.fit import FIT

    entries = (f"   .. attribute:: {name}\n\n      {meaning}\n" for name, (meaning, _) in FIT.items())
    heads = ".. autoclass:: levilab.notebook.fit.FittedModel\n   :members:"
    return "\n".join(["```{eval-rst}", f"{heads}\n", *entries, "```\n"])


def scene() -> str:
    """Return the scene that has every key with a comment, as a block."""
    from importlib.resources import files

    return f"```toml\n{files('levilab.simulator').joinpath('scenes/undriven.toml').read_text(encoding='utf-8')}```"


#: Kept results of the cross-check, and the least number of trials that the page shows.
CHECKS, FEWEST_TRIALS = Path(__file__).parents[2] / "benchmarks/results/crosscheck.json", 30


def checks() -> str:
    """Return the pulls of the kept cross-check, in Markdown."""
    kept = json.loads(CHECKS.read_text(encoding="utf-8"))["checks"]
    heads = "subject, seed | quantity | trials | mean pull | s.d. | within 1 u [%] | beyond 2 u [%] | beyond 3 u [%]"
    return f"| {heads} |\n{'|---' * 8}|\n" + "".join(
        f"| `{check['name']}`, {check['seed']} | {one['quantity']} | {one['n']} | {one['mean']:+.2f} | "
        f"{one['deviation']:.2f} | {100 * one['coverage']:.0f} | {_beyond(one, 2)} | {_beyond(one, 3)} |\n"
        for check in kept
        for one in check["spreads"]
        if one["n"] >= FEWEST_TRIALS
    )


SPIN_DOWNS = CHECKS.with_name("spindown_motion.json")


def spin_downs() -> str:
    """Return the pulls of the kept study of spin-downs, in Markdown."""
    kept = json.loads(SPIN_DOWNS.read_text(encoding="utf-8"))
    ways = (("full_motion", ""), ("full_motion_known_white", ", `--correlation none`"))
    rows = [(f"full motion, {1e3 * row['noise_hz']:.0f} mHz added{how}", row) for key, how in ways for row in kept[key]]
    rows += [(f"driven from 30 to {to} Hz", kept[f"driven_to_{to}_hz"]) for to in (33, 40)]
    rows += [("driven from 30 to 33 Hz, without the last reading", kept["driven_to_33_hz_without_the_last_reading"])]
    rows += [(f"drawn from the priors{_stated(row)}", row) for row in kept["over_the_priors"]]
    rows += [
        (f"no tilt, {row['readings']} readings down to {row['last_hz']:.1f} Hz{_stated(row)}", row)
        for row in kept["tilt_allowed_for"]
    ]
    rows += [(f"tilt known to be none, ρ = {row['rho']:g}{_stated(row)}", row) for row in kept["only_spins"]]
    white = kept["only_spins_known_white"]
    rows += [(f"tilt known to be none, `--correlation none`{_stated(row)}", row) for row in white]
    heads = ["tops", "runs", "mean pull of C, n", "of it by the priors", "s.d.", *(head for head, *_ in _SHARES)]
    return f"| {' | '.join(heads)} |\n{'|---' * len(heads)}|\n" + "".join(
        f"| {' | '.join([name, str(row.get('runs') or row['tops']), *_of_c_and_n(row)])} |\n" for name, row in rows
    )


#: Head of a column → the share that is in it.
_SHARES = (("within 1 u [%]", "within_1"), ("beyond 2 u [%]", "beyond_2"), ("beyond 3 u [%]", "beyond_3"))


def _of_c_and_n(row: Any) -> list[str]:
    """Return the numbers of C and n of a row, a text for each column."""
    places = [row["quantities"].index(name) for name in ("C", "n")]

    def both(key: str, form: str, factor: float = 1.0) -> str:
        return ", ".join(format(factor * row[key][k], form) for k in places) if key in row else ""

    first = [both("pull_mean", "+.2f"), both("of_priors", "+.2f"), both("pull_sd", ".2f")]
    return first + [both(key, ".0f" if key == "within_1" else ".1f", 100) for _, key in _SHARES]


def _stated(row: Any) -> str:
    return ", u stated" if row["reading_u_hz"] else ""


def priors() -> str:
    """Return what the trials of the cross-check draw, in Markdown."""
    from levilab.crosscheck.priors import PRIORS

    return "| subject | number | drawn from | reason |\n|---|---|---|---|\n" + "".join(
        f"| {f'`{subject}`' if k == 0 else ''} | {row.name} | {row.text} | {row.reason} |\n"
        for subject, rows in PRIORS.items()
        for k, row in enumerate(rows.values())
    )


def _beyond(spread: Any, limit: float) -> str:
    pulls = spread["pulls"]
    return f"{100 * sum(abs(pull) > limit for pull in pulls) / len(pulls):.0f}"


#: Page → mark in it → what takes its place.
MADE = {
    "crosscheck": {"<!-- all results -->": checks, "<!-- all priors -->": priors, "<!-- spin-downs -->": spin_downs},
    "reference/commands": {"<!-- all commands -->": overview},
    **{page: {"<!-- commands -->": partial(reference, page)} for page in PAGES},
    "data": {"<!-- all columns -->": columns, "<!-- all laws -->": laws},
    "glossary": {"<!-- all laws -->": laws},
    "reference/python-results": {"<!-- a fit -->": fit},
    "simulator": {"<!-- all keys -->": scene},
    "sweeps": {"<!-- all observables -->": observables},
}


def _read(_: Sphinx, page: str, source: list[str]) -> None:
    for mark, text in MADE.get(page, {}).items():
        source[0] = source[0].replace(mark, text())


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
