"""How many mistakes the simulated laboratory notices, and how many of them the tests of the rooms do not."""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kept
import places
import trial

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = trial.ROOT / "benchmarks" / "results" / "laboratory.json"
OUTCOMES = trial.WORK / "laboratories.json"
BEGIN, END = "<!-- made by benchmarks/mutants --laboratories -->\n", "<!-- end of laboratories -->\n"
#: The rooms whose mistakes a laboratory should notice.
ROOMS = ("levilab/acquisition", "levilab/runs", "instruments/drivers", "instruments/links", "levilab/sweeps")
#: The tests of these rooms.
TESTS = tuple(f"tests/{room}" for room in ROOMS)


def measure(
    number: int, seed: int, laboratories: int, judge_by_tests: Callable[[places.Mutation], dict[str, Any]]
) -> int:
    """Carry laboratories out with one mistake after the other in the code, and run the tests against the same mistakes.

    Args:
        number: of mistakes, each room with its share by lines.
        seed: of their choice.
        laboratories: that are carried out with each, from seed 0 on, until one of them fails.
        judge_by_tests: returns the outcome of the tests that reach a mistake.
    """
    sound = trial.run({"laboratories": laboratories}, 3600.0)
    if len(sound.get("digests", ())) != laboratories:
        print(f"without any mistake: {sound}")
        return 1
    print(f"{laboratories} laboratories without a mistake: {sound['cpu_s']:.0f} s of a processor", flush=True)
    lines = trial.run({"laboratories": laboratories, "reach": True}, 7200.0)["lines"]
    limit = trial.FACTOR * sound["cpu_s"] + trial.EXTRA_S
    known = json.loads(OUTCOMES.read_text(encoding="utf-8")) if OUTCOMES.exists() else {}
    rows = []
    planted = [(mutation, name) for name, mutation in places.named("planted.toml") if mutation]
    for mutation, name in (*planted, *((one, "") for one in places.chosen(seed, number, ROOMS))):
        start, key, tests = time.monotonic(), f"{laboratories} {mutation.key}", f"tests {mutation.key}"
        if key not in known:
            order = {"laboratories": laboratories, "digests": sound["digests"]}
            found: dict[str, Any] = {"changed": 0}
            if mutation.line in lines.get(mutation.file, ()):
                with trial.changed(mutation.file, places.mutated(mutation.file, mutation.edits)):
                    found = trial.run(order, limit)
            known[key] = _outcome(found)
        if tests not in known:
            known[tests] = judge_by_tests(mutation)
        OUTCOMES.write_text(json.dumps(known, indent=0), encoding="utf-8")
        said = f"{known[key]['state']:9} {known[tests]['state']:9} {time.monotonic() - start:4.0f} s"
        print(f"{said}  {name or f'{mutation.file} {mutation.function}: {mutation.text}'}", flush=True)
        rows.append(_row(mutation, known[key], known[tests], name))
    _write(rows, seed, laboratories)
    return 0


def carry_out(order: dict[str, Any]) -> dict[str, Any]:
    """Carry laboratories out, up to the first in which something is wrong, or that ends with an error of its own."""
    coverage = None
    if order.get("reach"):
        from coverage import Coverage

        coverage = Coverage(data_file=None, source=[str(trial.TREE / room) for room in ROOMS], branch=False)
        coverage.start()
    started, digests = time.process_time(), list[str]()
    try:
        from levilab.cli.exit_codes import exit_status
        from levilab.laboratory.plan import draw
        from levilab.laboratory.visit import visit

        for seed in range(order["laboratories"]):
            told = visit(draw(seed), exit_status)
            if told.findings:
                first = told.findings[0]
                return {"oracle": first.oracle, "said": first.text[-300:], "seed": seed}
            digests.append(told.digest)
    except Exception as error:  # noqa: BLE001 - a mistake may break the laboratory itself
        return {"oracle": "broken", "said": repr(error)[-300:], "seed": len(digests)}
    changed = sum(one != other for one, other in zip(digests, order.get("digests", digests), strict=True))
    result = {"digests": digests, "changed": changed, "cpu_s": time.process_time() - started}
    if coverage is not None:
        coverage.stop()
        data = coverage.get_data()
        result["lines"] = {
            Path(name).relative_to(trial.TREE).as_posix(): data.lines(name) for name in data.measured_files()
        }
    return result


def _outcome(found: dict[str, Any]) -> dict[str, Any]:
    """Return the state of a mistake after its laboratories.

    killed: an oracle saw it, or the laboratory itself broke down; time-out; seen: traces changed, and no oracle minded;
    unseen: each trace is the same to the byte.
    """
    if "oracle" in found:
        return {"state": "killed", "oracle": found["oracle"], "seed": found["seed"], "said": found["said"]}
    if not found:
        return {"state": "time-out"}
    return {"state": "seen", "changed": found["changed"]} if found["changed"] else {"state": "unseen"}


def _row(mutation: places.Mutation, outcome: dict[str, Any], judged: dict[str, Any], name: str) -> dict[str, Any]:
    known = kept.reasons().get((mutation.file, mutation.function, mutation.text), {})
    tests = judged["state"]
    tests = "equivalent" if known.get("equivalent") and tests in {"survived", "unreached"} else tests
    return {
        **({"planted": name} if name else {}),
        "file": mutation.file,
        "function": mutation.function,
        "text": mutation.text,
        "laboratory": outcome["state"],
        **{name: outcome[name] for name in ("oracle", "seed", "changed") if name in outcome},
        "tests": tests,
    }


def _write(rows: list[dict[str, Any]], seed: int, laboratories: int) -> None:
    """Write the results, and the table of the page."""
    pairs = Counter((row["laboratory"], row["tests"]) for row in rows)
    summary = {f"{ours}, tests {tests}": count for (ours, tests), count in sorted(pairs.items())}
    results = {"seed": seed, "laboratories": laboratories, "summary": summary, "mutations": rows}
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    kept.put(BEGIN, _table(rows), END)
    print(json.dumps(summary, indent=1))


def _table(rows: list[dict[str, Any]]) -> str:
    heads = ("mistakes", "killed by a laboratory", "by the tests", "by both", "by a laboratory alone", "in trace only")
    lines = ["", "| " + " | ".join(("in", *heads)) + " |", "|---" * (len(heads) + 1) + "|"]
    drawn = [row for row in rows if "planted" not in row]
    groups = {"planted": [row for row in rows if "planted" in row], "at random": drawn}
    groups |= {f"  in {room}": [row for row in drawn if row["file"].startswith(room)] for room in ROOMS}
    for group, part in groups.items():
        ours = [row["laboratory"] in {"killed", "time-out"} for row in part]
        tests = [row["tests"] in {"killed", "time-out"} for row in part]
        both = sum(one and other for one, other in zip(ours, tests, strict=True))
        traced = sum(row["laboratory"] == "seen" for row in part)
        numbers = (len(part), sum(ours), sum(tests), both, sum(ours) - both, traced)
        lines.append(f"| {group} | " + " | ".join(map(str, numbers)) + " |")
    return "\n".join([*lines, "", ""])


if __name__ == "__main__":
    sys.exit("use: python benchmarks/mutants --laboratories")
