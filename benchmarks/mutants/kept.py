"""The outcome of each mutation, kept from run to run, and the page about it."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import trial

if TYPE_CHECKING:
    from collections.abc import Sequence

    from places import Mutation

RESULTS = trial.ROOT / "benchmarks" / "results" / "mutants.json"
PAGE = trial.ROOT / "docs" / "mutants.md"
REASONS = Path(__file__).with_name("survivors.toml")

#: Where the page's table stands: what is around it is written by hand.
BEGIN, END = "<!-- made by benchmarks/mutants -->\n", "<!-- end -->\n"


@dataclasses.dataclass(frozen=True)
class Row:
    """One mutation and its outcome: killed, time-out, survived, equivalent, unreached or gone."""

    kind: str
    room: str
    file: str
    function: str
    text: str
    state: str
    test: str = ""
    reason: str = ""
    name: str = ""


def reasons() -> dict[tuple[str, str, str], dict[str, str]]:
    """Of survivors: by file, function and change."""
    if not REASONS.exists():
        return {}
    with REASONS.open("rb") as table:
        rows = tomllib.load(table).get("survivor", [])
    return {(row["file"], row["function"], row["change"]): row for row in rows}


def is_equivalent(mutation: Mutation) -> bool:
    """Whether it is said to change nothing that anyone could notice."""
    return bool(reasons().get((mutation.file, mutation.function, mutation.text), {}).get("equivalent"))


def row_of(kind: str, mutation: Mutation, outcome: dict[str, Any], name: str = "") -> Row:
    """Return the row of a mutation that has been tried."""
    known = reasons().get((mutation.file, mutation.function, mutation.text), {})
    state = outcome["state"]
    if state in {"survived", "unreached"} and known.get("equivalent"):
        state = "equivalent"
    return Row(
        kind, mutation.room, mutation.file, mutation.function, mutation.text, state, outcome.get("test", ""),
        known.get("reason", ""), name,
    )  # fmt: skip


def share(rows: Sequence[Row]) -> float:
    """How many of those that change anything were killed."""
    count = Counter(row.state for row in rows)
    killed = count["killed"] + count["time-out"]
    return killed / max(killed + count["survived"] + count["unreached"], 1)


def write(rows: Sequence[Row], seed: int) -> None:
    """The results, and the table of the page."""
    results = {
        "seed": seed,
        "summary": {
            kind: dict(Counter(row.state for row in rows if row.kind == kind))
            | {"share_killed": round(share([row for row in rows if row.kind == kind]), 4)}
            for kind in ("named", "generated")
        },
        "mutations": [
            {key: value for key, value in dataclasses.asdict(row).items() if value != ""}
            for row in sorted(rows, key=lambda row: (row.kind != "named", row.file, row.function, row.text))
        ],
    }
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    put(BEGIN, _tables(rows), END)


def put(begin: str, text: str, end: str) -> None:
    """Put a text between two lines of the page."""
    before, rest = PAGE.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    PAGE.write_text(before + begin + text + end + after, encoding="utf-8")


def _tables(rows: Sequence[Row]) -> str:
    states = ("killed", "time-out", "survived", "unreached", "equivalent", "gone")
    lines = ["", "| mutations | in all | " + " | ".join(states) + " | killed of those that change anything |"]
    lines.append("|---" * (len(states) + 3) + "|")
    generated = [row for row in rows if row.kind == "generated"]
    groups = {"with a name": [row for row in rows if row.kind == "named"], "at random": generated}
    groups |= {
        f"  of them in {name}": [r for r in generated if r.file.startswith(f"{name}/")] for name in trial.PACKAGES
    }
    for name, group in groups.items():
        count = Counter(row.state for row in group)
        numbers = " | ".join(str(count[state]) for state in states)
        lines.append(f"| {name} | {len(group)} | {numbers} | {100 * share(group):.1f} % |")
    return "\n".join([*lines, "", ""])
