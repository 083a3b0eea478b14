"""The command line in this process: quick, and with the exit status that a process of its own would have."""

import contextlib
import io
import os
import sys
from dataclasses import dataclass

from levilab.cli.main import main
from levilab.texts.text import speak


@dataclass(frozen=True)
class Ended:
    """How a command ended.  status: its exit status; out, err: what it wrote."""

    status: int
    out: str
    err: str


def command(*words, cwd, encoding="utf-8"):
    """Run `levilab` with some words in a folder.  Raises what would be a traceback."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    argv, here = sys.argv, os.getcwd()  # noqa: PTH109 - also if it is gone
    sys.argv = ["levilab", *map(str, words)]
    os.chdir(cwd)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        speak("en")  # this process goes on
        sys.argv = argv
        os.chdir(here)
    texts = []
    for stream in (out, err):
        stream.flush()
        stream.seek(0)
        texts.append(stream.read())
    return Ended(status, *texts)
