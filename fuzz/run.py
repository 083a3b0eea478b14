"""Fuzz the targets one after the other, guided by coverage (atheris, which is LLVM's libFuzzer for Python).

    python fuzz/run.py [--seconds 60] [TARGET ...]

What was tried is kept in .fuzz/ and gone on with next time; an input that breaks something is written there as well,
and `python fuzz/run.py --again FILE TARGET` runs it once more.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
KEPT = HERE.parent / ".fuzz"

#: Time [s] and memory [MB] that one input may take, and bytes that it may have.
SLOWEST, MOST_MEMORY, LONGEST = 25, 2500, 2000


def main() -> int:
    """Whether all targets stood it: the number of those that did not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="by default all")
    parser.add_argument("--seconds", type=int, default=60, help="for each target")
    parser.add_argument("--again", type=Path, help="an input that broke something")
    chosen = parser.parse_args()
    from fuzz_targets import TARGETS

    if unknown := set(chosen.targets) - set(TARGETS):
        parser.error(f"no target {', '.join(sorted(unknown))}: there are {', '.join(TARGETS)}")
    names = chosen.targets or list(TARGETS)
    if chosen.again:
        for name in names:
            TARGETS[name]().run(chosen.again.read_bytes())
        return 0
    if importlib.util.find_spec("atheris") is None:
        parser.error('atheris is missing: pip install "levilab[fuzz]" (it is made for Linux and macOS)')
    broken = [name for name in names if _fuzz(name, chosen.seconds)]
    print(
        f"{len(names) - len(broken)} of {len(names)} targets stood it", *(f"not: {name}" for name in broken), sep="\n"
    )
    return len(broken)


def _fuzz(name: str, seconds: int) -> int:
    """One target in a process of its own: what ends the fuzzer ends the process."""
    from fuzz_targets import TARGETS

    target = TARGETS[name]()
    corpus, words = KEPT / name, KEPT / f"{name}.dict"
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(target.seeds):
        (corpus / f"seed{number}").write_bytes(seed)
    words.write_text("".join(f'"{_escaped(word)}"\n' for word in target.words if word), encoding="ascii")
    print(f"--- {name}", flush=True)
    options = {
        "max_total_time": seconds,
        "timeout": SLOWEST,
        "rss_limit_mb": MOST_MEMORY,
        "max_len": LONGEST,
        "dict": words,
        "artifact_prefix": KEPT / f"{name}-",
        "print_final_stats": 1,
        "verbosity": 0,
    }
    command = [
        sys.executable,
        str(HERE / "one_target.py"),
        name,
        *(f"-{key}={value}" for key, value in options.items()),
    ]
    return subprocess.run([*command, str(corpus)], check=False).returncode


def _escaped(word: bytes) -> str:
    return "".join(chr(c) if 32 <= c < 127 and c not in b'"\\' else f"\\x{c:02x}" for c in word)


if __name__ == "__main__":
    sys.exit(main())
