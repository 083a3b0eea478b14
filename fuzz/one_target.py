"""One target under libFuzzer; started by run.py."""

import sys

import atheris

with atheris.instrument_imports(include=["instruments"]):
    from fuzz_targets import TARGETS


def main() -> None:
    """argv: the target, then libFuzzer's own options."""
    name = sys.argv.pop(1)
    atheris.Setup(sys.argv, TARGETS[name]().run)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
