"""Change the code in one place, run the tests that should notice, and count which changes they miss.

    python benchmarks/mutants [--number 200] [--seed 11] [--only WORD ...] [--again STATE ...] [--map]

The mutations with a name stand in named.toml, as many again as `--number` says are drawn at random over all packages.
With --laboratories N the mistakes are those of planted.toml and some at random in the rooms of acquisition; N simulated
laboratories are carried out with each as well.

First, once, the tests are run under coverage.py to learn which lines each reaches (half an hour; `--map` does nothing
else).  All takes place in a copy of the tree, .mutants/tree, and can be interrupted: what is known is kept in
.mutants/, and tried again when a file that the mutation lies in, or a test that killed it, has changed.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import hashlib
import json
import os
import sys
import time
from typing import Any

import kept
import laboratory
import places
import reach
import trial

OUTCOMES = trial.WORK / "outcomes.json"

#: Tests run in two rounds, each of this processor time at most [s]: first those of the files whose names are nearest to
#: the name of the mutation's file, then the fastest of the others.  A mutation that they all pass has survived.
NEAREST, FIRST_S, REST_S = 3, 5.0, 8.0
#: Collecting a file of tests costs about so much [s].
_FILE_S = 0.25


def main() -> int:
    """Try what is not known yet, and write all outcomes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=200, help="mutations at random")
    parser.add_argument("--seed", type=int, default=11, help="of the choice")
    parser.add_argument("--only", nargs="*", default=[], help="files, names, changes, folders of tests with it")
    parser.add_argument("--again", nargs="*", default=[], help="states to try again, as survived")
    parser.add_argument("--tests", nargs="*", help="by these tests, new ones perhaps, not by those of the map")
    parser.add_argument("--known", action="store_true", help="do with the map as far as it is known")
    parser.add_argument("--map", action="store_true", help="learn which tests reach which lines, and end")
    parser.add_argument("--laboratories", type=int, help="carried out with each mistake in acquisition, too")
    asked = parser.parse_args()
    with contextlib.suppress(AttributeError):
        os.nice(10)
    trial.WORK.mkdir(exist_ok=True)
    trial.copy_tree()
    trial.load_libraries()
    if not asked.known:
        print("which tests reach which lines:", flush=True)
        reach.measure(asked.only or (list(laboratory.TESTS) if asked.laboratories else []))
    if asked.map:
        return 0
    if asked.laboratories:
        reached = reach.load()
        return laboratory.measure(asked.number, asked.seed, asked.laboratories, lambda one: attempt(one, reached))
    known = json.loads(OUTCOMES.read_text(encoding="utf-8")) if OUTCOMES.exists() else {}
    rows, reached = [], reach.load()
    for name, mutation in places.named():
        if mutation is None:
            rows.append(kept.Row("named", "", "", "", "", "gone", name=name))
            print(f"{'gone':10} {name}", flush=True)
            continue
        if outcome := _outcome(mutation, name, known, reached, asked):
            rows.append(kept.row_of("named", mutation, outcome, name))
    drawn = places.chosen(asked.seed, asked.number)
    outcomes = [(mutation, _outcome(mutation, "", known, reached, asked)) for mutation in drawn]
    rows += [kept.row_of("generated", mutation, outcome) for mutation, outcome in outcomes if outcome]
    kept.write(rows, asked.seed)
    for kind in ("named", "generated"):
        part = [row for row in rows if row.kind == kind]
        print(f"{kind}: {len(part)} mutations, {100 * kept.share(part):.1f} % killed of those that change anything")
    return 0


def _outcome(
    mutation: places.Mutation, name: str, known: dict[str, Any], reached: reach.Reach, asked: argparse.Namespace
) -> dict[str, Any] | None:
    """Return the outcome of a mutation, now or before; None where it is unknown and not requested."""
    digest = hashlib.sha256(b"".join((trial.TREE / edit.file).read_bytes() for edit in mutation.edits)).hexdigest()[:16]
    before = known.get(mutation.key)
    wanted = not asked.only or any(word in f"{mutation.file} {name} {mutation.text}" for word in asked.only)
    again = before and before["state"] in asked.again and not kept.is_equivalent(mutation)
    fresh = before and before["digest"] == digest and not again
    if fresh or not wanted:
        return before
    start = time.monotonic()
    tried = dataclasses.replace(mutation, tests=tuple(asked.tests)) if asked.tests else mutation
    found = attempt(tried, reached, before.get("test", "") if before else "") | {"digest": digest}
    if before and asked.tests and found["state"] == "survived":
        return before  # they are not all that reach it
    known[mutation.key] = found
    OUTCOMES.write_text(json.dumps(known, indent=0), encoding="utf-8")
    what = name or f"{mutation.file} {mutation.function}: {mutation.text}"
    print(f"{found['state']:10} {time.monotonic() - start:4.0f} s  {what}  {found.get('test', '')}", flush=True)
    return found


def attempt(mutation: places.Mutation, reached: reach.Reach, killer: str = "") -> dict[str, Any]:
    """Run the tests against a mutation, the likeliest first: above all the one that killed it the last time."""
    rounds = _rounds(mutation, reached)
    if mutation.tests is None and "::" in killer and (trial.TREE / _file_of(killer)).exists():
        rounds.insert(0, ([_file_of(killer)], [killer], reached.seconds.get(killer, FIRST_S)))
    if not rounds:
        return {"state": "unreached", "tests": 0}
    tests = 0
    with contextlib.ExitStack() as stack:
        for file in sorted({edit.file for edit in mutation.edits}):
            stack.enter_context(trial.changed(file, places.mutated(file, mutation.edits)))
        for files, chosen, planned in rounds:
            limit = trial.FACTOR * planned + trial.EXTRA_S
            found = trial.run({"files": files, "tests": chosen, "reach": False}, limit)
            if not found:
                return {"state": "time-out", "tests": tests}
            if found["failed"]:
                return {"state": "killed", "test": found["failed"][0], "tests": tests + len(found["tests"])}
            tests += len(found["tests"])
    return {"state": "survived" if tests else "unreached", "tests": tests}


def _rounds(mutation: places.Mutation, reached: reach.Reach) -> list[tuple[list[str], list[str] | None, float]]:
    """Files of tests, the tests of them in their order, and the time that they take unchanged [s]; round by round."""
    if mutation.tests is not None:
        files = [test for test in mutation.tests if (trial.TREE / test.split("::")[0]).exists()]
        planned = sum(s for test, s in reached.seconds.items() if test.startswith(tuple(files)))
        return [(files, None, planned)] if files else []
    seconds = reached.seconds
    reaching = reached.tests(mutation.file, mutation.function, mutation.line) & seconds.keys()
    by_file: dict[str, list[str]] = {}
    for test in sorted(reaching, key=seconds.__getitem__):
        by_file.setdefault(_file_of(test), []).append(test)
    words = set(mutation.file.removesuffix(".py").split("/"))

    def rank(file: str) -> tuple[int, float]:
        alike = len(words & set(file.removesuffix(".py").replace("test_", "").split("/")))
        return -alike, seconds[by_file[file][0]]

    near = sorted(by_file, key=rank)[:NEAREST]
    first = _within(FIRST_S, [test for file in near for test in by_file[file]], seconds)
    rest = _within(REST_S, sorted(reaching - set(first), key=seconds.__getitem__), seconds)
    found = []
    for tests in (first, rest):
        files = list(dict.fromkeys(map(_file_of, tests)))
        if tests:
            found.append((files, sorted(tests, key=seconds.__getitem__), sum(map(seconds.__getitem__, tests))))
    return found


def _file_of(test: str) -> str:
    return test.split("::", maxsplit=1)[0]


def _within(limit: float, tests: list[str], seconds: dict[str, float]) -> list[str]:
    """Return the first tests that together, with the collection of their files, take so long [s]; one at least."""
    chosen: list[str] = []
    files: set[str] = set()
    for test in tests:
        limit -= seconds[test] + (0 if _file_of(test) in files else _FILE_S)
        if limit < 0 and chosen:
            break
        files.add(_file_of(test))
        chosen.append(test)
    return chosen


if __name__ == "__main__":
    sys.exit(main())
